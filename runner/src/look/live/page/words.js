// Words and numbers, and the elements that hold them.

export function options(select, entries) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
}

/// A list of names and texts; what is there already is changed, so that nothing flickers.
export function list(place, entries) {
  const cells = entries.flat();
  while (place.children.length > cells.length) place.lastChild.remove();
  while (place.children.length < cells.length) place.append(document.createElement(place.children.length % 2 ? "dd" : "dt"));
  cells.forEach((text, i) => { if (place.children[i].textContent !== text) place.children[i].textContent = text; });
}

export function count(number) {
  return number.toLocaleString("en");
}

export function short(number) {
  return number >= 100 ? number.toFixed(0) : number >= 1 ? number.toFixed(1) : number.toFixed(2);
}

export function css([r, g, b]) {
  return `rgb(${r} ${g} ${b})`;
}
