// What is shown beside the world: figures, time, colors and what they mean, the body that was picked.

import { at, state } from "./state.js";
import { count, css, list, options, short } from "./words.js";

export function name_shapes() {
  const chosen = at("shape").value;
  options(at("shape"), state.hello.sources[0].shapes.map(({ name }, kind) => [kind, name]));
  if (chosen) at("shape").value = chosen;
}

/// Where on the bar two worlds part.
function mark_difference() {
  const { steps } = state.hello, { difference } = state;
  at("apart").hidden = difference === null;
  if (difference !== null) {
    const part = steps.indexOf(difference) / Math.max(1, steps.length - 1);
    // A slider's knob is 16 px wide, and its middle is where the value is.
    at("apart").style.left = `calc(${part} * (100% - 16px) + 7px)`;
  }
}

/// Two worlds differ from a record on, or nowhere.
export function difference({ step }) {
  state.difference = step;
  at("compared").hidden = false;
  at("difference").disabled = step === null;
  at("difference").textContent = step === null ? "No difference" : "First difference";
  mark_difference();
  if (state.time !== undefined) clock();
}

/// Which records of two worlds are compared and shown, if one of them has more than the other.
export function beyond() {
  const { steps, sources } = state.hello;
  const more = sources.filter(({ records }) => records > steps.length)
    .map(({ name, records }) => `only ${name} has ${count(records - steps.length)} more`);
  const compared = steps.length === 1 ? "record" : `${count(steps.length)} records`;
  at("beyond").hidden = !more.length;
  at("beyond").textContent = `in the ${compared} of both; ${more.join(", ")}`;
}

export function clock() {
  const { recorded, steps, last_step } = state.hello;
  const last = recorded ? steps[steps.length - 1] : last_step;
  at("clock").textContent = `${state.time.toFixed(2)} s · step ${count(state.step)} of ${count(last)}`;
  at("clock").classList.toggle("difference", state.difference !== null && state.step >= state.difference);
  if (recorded && document.activeElement !== at("scrub")) {
    at("scrub").value = Math.max(0, steps.findLastIndex((step) => step <= state.step));
  }
}

/// Somebody has changed how time goes on.
export function pace({ playing, times }) {
  state.playing = playing;
  at("play").textContent = playing ? "Pause" : "Play";
  const select = at("speed");
  if (![...select.options].some(({ value }) => Number(value) === times)) select.add(new Option(...speed(times).reverse()));
  select.value = times;
}

/// A speed that can be chosen.
export const speed = (times) => [times, `${times} ×`];

export function figures({ figures, phases, busy }) {
  list(at("figures"), figures);
  at("time").hidden = !phases.length;
  list(at("phases"), phases.map(([name, ms]) => [name.replaceAll("_", " "), `${short(ms)} ms`]));
  at("balance").hidden = !busy.length;
  if (at("ranks").children.length !== busy.length) {
    at("ranks").replaceChildren(...busy.map((_, rank) => {
      const row = document.createElement("div");
      row.className = "strip";
      row.innerHTML = "<span></span><div><i></i></div><span></span>";
      row.children[0].textContent = rank;
      row.querySelector("i").style.background = css(state.hello.rank_colors[rank % state.hello.rank_colors.length]);
      return row;
    }));
  }
  busy.forEach((part, rank) => {
    const row = at("ranks").children[rank];
    row.querySelector("i").style.width = `${100 * part}%`;
    row.children[2].textContent = `${Math.round(100 * part)} %`;
  });
}

/// What colors mean: told once if that is the same in all worlds, or else under the name of each.
export function legend(source, meaning) {
  state.legends[source] = meaning;
  // Those of the others come with it.
  if (source < state.sources.length - 1) return;
  const texts = state.legends.map((meaning) => JSON.stringify(meaning)), text = texts.join();
  if (text === state.legend) return;
  state.legend = text;
  const parts = [];
  const add = (name, text) => {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    parts.push(made);
    return made;
  };
  add("strong", meaning.title);
  const differ = texts.some((text) => text !== texts[0]);
  (differ ? state.legends : [meaning]).forEach(({ scale, rows }, i) => {
    if (differ) add("em", state.hello.sources[i].name);
    if (scale) {
      const [low, , high] = scale.marks;
      const bar = add("span");
      const colors = document.createElement("b");
      colors.style.background = `linear-gradient(to right, ${scale.colors.map(css).join(", ")})`;
      bar.append(low, colors, high);
    }
    for (const [name, color, is_round] of rows) {
      const entry = add("span");
      const swatch = document.createElement("i");
      if (color) swatch.style.background = css(color);
      if (is_round) swatch.style.borderRadius = "50%";
      entry.append(swatch, name);
    }
  });
  at("legend").replaceChildren(...parts);
}

/// Something was refused, which is to be read before it goes.
export function note({ text }) {
  const place = at("note");
  place.textContent = text;
  place.hidden = false;
  clearTimeout(state.fading);
  state.fading = setTimeout(() => { place.hidden = true; }, 10000);
}
