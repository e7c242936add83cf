// The page: what is looked at, what the server is told, and what is shown beside the world.

import { Drawing } from "./draw.js";
import { decode } from "./frame.js";

const at = (id) => document.getElementById(id);
const canvas = at("canvas");
const token = new URLSearchParams(location.search).get("token") ?? "";

const COLORS = ["kind", "speed", "spin", "tile", "rank", "contacts", "asleep"];
const KEYS = [
  ["space", "play or pause"], ["→ ←", "a step on, a record back"], ["+ −", "zoom"], ["arrows + shift", "move"],
  ["f", "all of the world"], ["t", "tiles and ranks"], ["1 to 7", "color"], ["n", "first difference"],
  ["v p d e", "hand: view, pull, drop, erase"],
  ["Esc", "let go of a body"],
];

/// Pixels of the canvas in one of the page: no more in all than the server draws.
const ratio = () => Math.min(devicePixelRatio, Math.sqrt(2 ** 24 / (canvas.clientWidth * canvas.clientHeight)), 8192 / canvas.clientWidth);

/// Everything there is to know, besides what the controls hold.
const state = {
  drawing: null,
  hello: null,
  sources: [],
  camera: { x: 0, y: 0, zoom: 1 },
  playing: true,
  body: null,
  difference: null,
  following: false,
  step: 0,
  frames: 0,
  legend: "",
  due: false,
  asked: "",
  failure: null,
  over: false,
};

const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket?token=${encodeURIComponent(token)}`);
socket.binaryType = "arraybuffer";
const tell = (message) => socket.readyState === WebSocket.OPEN && socket.send(JSON.stringify(message));
const say = (text) => { at("message").textContent = text; };

socket.onopen = () => say("Waiting for the first picture…");
socket.onclose = () => {
  const end = state.failure ? `The run has failed: ${state.failure}`
    : state.over ? "The run is over; this is what was seen last."
      : state.hello ? "The program has ended without a word, or cannot be reached; this is what was seen last."
        : "There is no run here, or this is not its address.";
  say(end);
};
socket.onmessage = ({ data }) => {
  if (typeof data === "string") {
    const { type, ...message } = JSON.parse(data);
    ({ hello, pace, figures, body, difference, tiles, shapes, note, failed, over })[type]?.(message);
  } else {
    show(decode(data));
  }
};

// --- what comes -----------------------------------------------------------------------------------------------------------

function hello(message) {
  state.hello = message;
  state.failure = null;
  start_drawing();
  at("source").textContent = message.sources.map(({ name }) => name).join(" and ");
  document.title = `${message.sources[0].name} · Atoll`;
  at("names").replaceChildren(...(message.sources.length > 1 ? message.sources : []).map(({ name }) => {
    const place = document.createElement("span"), text = document.createElement("i");
    text.textContent = name;
    place.append(text);
    return place;
  }));
  options(at("color"), COLORS.filter((color) => message.colors.includes(color)).map((color) => [color, color]));
  options(at("speed"), [[0, "as fast as can be"], ...[0.1, 0.25, 0.5, 1, 2, 4, 8].map(speed)]);
  for (const id of ["track", "back"]) at(id).hidden = !message.recorded;
  at("hand").hidden = message.recorded;
  name_shapes();
  if (message.recorded) {
    Object.assign(at("scrub"), { min: 0, max: message.steps.length - 1, value: 0 });
  }
  state.difference = null;
  at("difference").hidden = message.sources.length < 2;
  at("difference").disabled = true;
  at("difference").textContent = "Comparing…";
  at("apart").hidden = true;
  state.asked = "";
  fit();
}

function start_drawing() {
  state.drawing = new Drawing(canvas);
  state.sources = state.hello.sources.map((source) => {
    const made = state.drawing.source(source, state.hello.static_color);
    state.drawing.grid(made, source, state.hello.rank_colors);
    return made;
  });
}

/// There are more kinds of bodies than before.
function shapes({ shapes }) {
  state.hello.sources[0].shapes = shapes;
  start_drawing();
  name_shapes();
  redraw();
}

function name_shapes() {
  const chosen = at("shape").value;
  options(at("shape"), state.hello.sources[0].shapes.map(({ name }, kind) => [kind, name]));
  if (chosen) at("shape").value = chosen;
}

/// Tiles were cut or joined, or have gone to other ranks.
function tiles({ worlds }) {
  worlds.forEach((held, i) => {
    const source = Object.assign(state.hello.sources[i], held);
    if (state.drawing) state.drawing.grid(state.sources[i], source, state.hello.rank_colors);
  });
  if (state.drawing) redraw();
}

/// Two worlds differ from a record on, or nowhere.
function difference({ step }) {
  state.difference = step;
  at("difference").hidden = false;
  at("difference").disabled = step === null;
  at("difference").textContent = step === null ? "No difference" : "First difference";
  mark_difference();
  if (state.time !== undefined) clock();
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

function show(frame) {
  if (!state.drawing) return;
  state.drawing.load(state.sources[frame.source], frame);
  state.step = frame.step;
  state.time = frame.time;
  if (state.following && frame.followed && frame.source === state.body?.source) {
    [state.camera.x, state.camera.y] = frame.followed;
  }
  if (frame.followed) state.marked = frame.followed;
  legend(frame.legend);
  say("");
  clock();
  redraw();
  // The next may come once this one is drawn.
  if (frame.source === state.sources.length - 1) {
    requestAnimationFrame(() => tell({ do: "ack", frame: frame.number }));
    state.frames += 1;
  }
}

function clock() {
  const { recorded, steps, last_step } = state.hello;
  const last = recorded ? steps[steps.length - 1] : last_step;
  at("clock").textContent = `${state.time.toFixed(2)} s · step ${count(state.step)} of ${count(last)}`;
  at("clock").classList.toggle("difference", state.difference !== null && state.step >= state.difference);
  if (recorded && document.activeElement !== at("scrub")) {
    at("scrub").value = Math.max(0, steps.findLastIndex((step) => step <= state.step));
  }
}

/// Somebody has changed how time goes on.
function pace({ playing, times }) {
  state.playing = playing;
  at("play").textContent = playing ? "Pause" : "Play";
  const select = at("speed");
  if (![...select.options].some(({ value }) => Number(value) === times)) select.add(new Option(...speed(times).reverse()));
  select.value = times;
}

/// A speed that can be chosen.
const speed = (times) => [times, `${times} ×`];

function figures({ figures, phases, busy }) {
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

function body({ body }) {
  state.body = body;
  at("body").hidden = !body;
  if (!body) {
    state.following = false;
    state.marked = null;
  } else {
    state.marked = body.at;
    at("body-id").textContent = body.id;
    list(at("body-figures"), body.figures);
    if (held) held.found = true;
    if (held?.erases) {
      command(`{"remove":${body.id}}`);
      held = null;
      tell({ do: "drop" });
    }
    pull();
  }
  at("follow").setAttribute("aria-pressed", state.following);
  redraw();
}

/// Something was refused, which is to be read before it goes.
function note({ text }) {
  const place = at("note");
  place.textContent = text;
  place.hidden = false;
  clearTimeout(state.fading);
  state.fading = setTimeout(() => { place.hidden = true; }, 10000);
}

function failed({ why }) {
  state.failure = why;
  say(`The run has failed: ${why}`);
}

function over() {
  state.over = true;
}

function legend({ title, scale, rows }) {
  const parts = [];
  const add = (name, text) => {
    const made = document.createElement(name);
    if (text !== undefined) made.textContent = text;
    parts.push(made);
    return made;
  };
  add("strong", title);
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
    swatch.style.background = css(color);
    if (is_round) swatch.style.borderRadius = "50%";
    entry.append(swatch, name);
  }
  const text = JSON.stringify([title, scale, rows]);
  if (text !== state.legend) at("legend").replaceChildren(...parts);
  state.legend = text;
}

// --- drawing --------------------------------------------------------------------------------------------------------------

function redraw() {
  if (!state.due) {
    state.due = true;
    requestAnimationFrame(draw);
  }
}

function boxes() {
  const count = Math.max(1, state.sources.length);
  const width = Math.floor(canvas.width / count);
  return Array.from({ length: count }, (_, i) => [i * width, 0, width, canvas.height]);
}

function paper() {
  const [r, g, b] = getComputedStyle(at("stage")).backgroundColor.match(/[\d.]+/g).map(Number);
  return [r / 255, g / 255, b / 255];
}

function draw() {
  state.due = false;
  const { drawing, hello } = state;
  if (!hello || !drawing) return;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((length) => Math.floor(length * ratio()));
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  drawing.clear(paper());
  boxes().forEach((box, i) => {
    const source = hello.sources[i];
    drawing.draw(state.sources[i], box, state.camera, source.domain, at("tiles").checked);
  });
  mark();
  scale();
  look();
}

/// A ring around the body that was picked.
function mark() {
  const { marked, body, camera } = state;
  at("mark").hidden = !(marked && body);
  if (marked && body) {
    const [, , width, height] = boxes()[0];
    const x = width * (body.source + 0.5) + (marked[0] - camera.x) * camera.zoom, y = height / 2 - (marked[1] - camera.y) * camera.zoom;
    at("mark").hidden = x < width * body.source || x > width * (body.source + 1);
    Object.assign(at("mark").style, { left: `${x / ratio()}px`, top: `${y / ratio()}px` });
  }
}

/// Tells the server what is looked at, if that has changed.
function look() {
  const [, , width, height] = boxes()[0];
  const { x, y, zoom } = state.camera;
  const half = [width / 2 / zoom, height / 2 / zoom];
  const message = JSON.stringify({
    do: "look", view: [x - half[0], y - half[1], x + half[0], y + half[1]], size: [width, height], color: at("color").value,
  });
  if (message !== state.asked && width && height && socket.readyState === WebSocket.OPEN) {
    state.asked = message;
    socket.send(message);
  }
}

/// A length of 1, 2 or 5 times a power of ten that takes about a sixth of the width.
function scale() {
  const most = canvas.clientWidth / 6 / (state.camera.zoom / ratio());
  const power = 10 ** Math.floor(Math.log10(most));
  const length = power * [5, 2, 1].find((times) => times * power <= most);
  const bar = at("scale").firstElementChild;
  bar.style.width = `${length * state.camera.zoom / ratio()}px`;
  const [unit, times] = length >= 1000 ? ["km", 1e-3] : length >= 1 ? ["m", 1] : length >= 0.01 ? ["cm", 100] : ["mm", 1000];
  at("scale").lastElementChild.textContent = `${+(length * times).toPrecision(3)} ${unit}`;
}

function fit() {
  const boundaries = state.hello.sources.map(({ domain }) => domain);
  const low = [0, 1].map((axis) => Math.min(...boundaries.map((domain) => domain[axis])));
  const high = [2, 3].map((axis) => Math.max(...boundaries.map((domain) => domain[axis])));
  const width = canvas.clientWidth * ratio() / state.sources.length, height = canvas.clientHeight * ratio();
  state.camera = {
    x: (low[0] + high[0]) / 2, y: (low[1] + high[1]) / 2,
    // Beneath it is room for the scale.
    zoom: Math.min(0.94 * width / (high[0] - low[0]), Math.max(0.5 * height, height - 72 * ratio()) / (high[1] - low[1])),
  };
  state.following = false;
  at("follow").setAttribute("aria-pressed", false);
  redraw();
}

/// The source under the pointer, and the place in the world.
function place({ offsetX, offsetY }) {
  const [, , width, height] = boxes()[0];
  const [x, y] = [offsetX * ratio(), offsetY * ratio()];
  const source = Math.min(state.sources.length - 1, Math.floor(x / width));
  const { camera } = state;
  return { source, at: [camera.x + (x - source * width - width / 2) / camera.zoom, camera.y - (y - height / 2) / camera.zoom] };
}

function zoom(times, around) {
  const { camera } = state;
  // Nobody wants to see less than a micrometer or more than what doubles can tell apart.
  const next = Math.min(1e6, Math.max(1e-6, camera.zoom * times));
  const [x, y] = around ?? [camera.x, camera.y];
  camera.x = x + (camera.x - x) * camera.zoom / next;
  camera.y = y + (camera.y - y) * camera.zoom / next;
  camera.zoom = next;
  redraw();
}

// --- what the user does ---------------------------------------------------------------------------------------------------

function play() {
  state.playing = !state.playing;
  at("play").textContent = state.playing ? "Pause" : "Play";
  tell({ do: state.playing ? "play" : "pause" });
}

function step(by) {
  if (state.playing) play();
  tell({ do: "step", by });
}

function to_difference() {
  if (state.difference === null) return;
  if (state.playing) play();
  tell({ do: "seek", step: state.difference });
}

function follow(on) {
  state.following = on;
  at("follow").setAttribute("aria-pressed", on);
  if (on && state.marked) [state.camera.x, state.camera.y] = state.marked;
  redraw();
}

/// What the hand holds: where it is, and whether it takes away what is there.
let held = null;

/// Has something done to the world before its next step. A name may have more digits than numbers have here: so it is text.
function command(line) {
  tell({ do: "command", line });
}

function tool(name) {
  at("tool").value = name;
  at("shape-choice").hidden = name !== "drop";
  held = null;
}

/// Takes hold of the body that is there, or puts one there.
function take(event) {
  const { at: [x, y], source } = place(event), name = at("tool").value;
  if (name === "drop") {
    command(JSON.stringify({ add: { kind: Number(at("shape").value), x, y } }));
  } else {
    held = { at: [x, y], erases: name === "erase", found: false };
    tell({ do: "pick", source, at: held.at });
  }
}

/// Lets the body that is held come to the hand in an eighth of a second or so; let go, it flies on as it was pulled.
function pull() {
  if (!held?.found || held.erases || !state.body) return;
  const [vx, vy] = [0, 1].map((axis) => 8 * (held.at[axis] - state.body.at[axis]));
  command(`{"velocity":{"id":${state.body.id},"vx":${vx},"vy":${vy}}}`);
}

let dragged = null;
canvas.addEventListener("pointerdown", (event) => {
  canvas.setPointerCapture(event.pointerId);
  if (state.hello && !state.hello.recorded && at("tool").value !== "look") {
    take(event);
    return;
  }
  dragged = { x: event.clientX, y: event.clientY, far: false };
});
canvas.addEventListener("pointermove", (event) => {
  if (held && !held.erases) {
    held.at = place(event).at;
    pull();
  }
  if (!dragged) return;
  const [dx, dy] = [event.clientX - dragged.x, event.clientY - dragged.y];
  dragged.far ||= Math.hypot(dx, dy) > 4;
  if (dragged.far) {
    state.camera.x -= dx * ratio() / state.camera.zoom;
    state.camera.y += dy * ratio() / state.camera.zoom;
    Object.assign(dragged, { x: event.clientX, y: event.clientY });
    if (state.following) follow(false);
    redraw();
  }
});
canvas.addEventListener("pointerup", (event) => {
  if (dragged && !dragged.far && state.hello) tell({ do: "pick", ...place(event) });
  dragged = null;
  if (held && !held.erases) held = null;
});
canvas.addEventListener("pointercancel", () => { dragged = held = null; });
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
  if (state.hello) zoom(2 ** (-event.deltaY * lines / 300), state.following ? undefined : place(event).at);
}, { passive: false });
canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
canvas.addEventListener("webglcontextrestored", () => { start_drawing(); state.asked = ""; redraw(); });

at("play").onclick = play;
at("step").onclick = () => step(1);
at("back").onclick = () => step(-1);
at("fit").onclick = fit;
at("follow").onclick = () => follow(!state.following);
at("let-go").onclick = () => tell({ do: "drop" });
at("tool").onchange = ({ target }) => tool(target.value);
at("tiles").onchange = redraw;
at("color").onchange = redraw;
at("speed").onchange = ({ target }) => tell({ do: "speed", times: Number(target.value) });
at("scrub").oninput = ({ target }) => tell({ do: "seek", step: state.hello.steps[Number(target.value)] });
at("difference").onclick = to_difference;

// Whoever points at a control has the keys back afterwards; whoever goes there by keys has its own.
let pointed = false;
addEventListener("pointerdown", () => { pointed = true; }, true);
for (const controls of [at("panel"), at("bar")]) {
  controls.addEventListener("change", () => pointed && canvas.focus());
  controls.addEventListener("click", ({ target, detail }) => detail && target.tagName !== "SELECT" && canvas.focus());
}

addEventListener("keydown", (event) => {
  if (event.key === "Tab") pointed = false;
  if (event.key === "Escape") canvas.focus();
  const has_keys = event.target.tagName === "SELECT" || event.target.tagName === "INPUT" && !pointed;
  if (!state.hello || event.ctrlKey || event.metaKey || event.altKey || has_keys) return;
  const { camera } = state;
  const move = (x, y) => {
    camera.x += x * 80 * ratio() / camera.zoom;
    camera.y += y * 80 * ratio() / camera.zoom;
    follow(false);
  };
  const toggle = () => { at("tiles").checked = !at("tiles").checked; redraw(); };
  const color = COLORS[Number(event.key) - 1];
  const act = {
    " ": play, f: fit, t: toggle, "+": () => zoom(1.25), "=": () => zoom(1.25), "-": () => zoom(0.8),
    ArrowRight: () => (event.shiftKey ? move(1, 0) : step(1)),
    ArrowLeft: () => (event.shiftKey ? move(-1, 0) : step(-1)),
    ArrowUp: () => event.shiftKey && move(0, 1),
    ArrowDown: () => event.shiftKey && move(0, -1),
    n: to_difference,
    ...(state.hello.recorded ? {} : { v: () => tool("look"), p: () => tool("pull"), d: () => tool("drop"), e: () => tool("erase") }),
    Escape: () => tell({ do: "drop" }),
  }[event.key] ?? (state.hello.colors.includes(color) ? () => { at("color").value = color; redraw(); } : null);
  if (act) {
    event.preventDefault();
    act();
  }
});

new ResizeObserver(redraw).observe(at("stage"));
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
list(at("keys"), KEYS);

// --- words and numbers ----------------------------------------------------------------------------------------------------

function options(select, entries) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value)));
}

/// A list of names and texts; what is there already is changed, so that nothing flickers.
function list(place, entries) {
  const cells = entries.flat();
  while (place.children.length > cells.length) place.lastChild.remove();
  while (place.children.length < cells.length) place.append(document.createElement(place.children.length % 2 ? "dd" : "dt"));
  cells.forEach((text, i) => { if (place.children[i].textContent !== text) place.children[i].textContent = text; });
}

function count(number) {
  return number.toLocaleString("en");
}

function short(number) {
  return number >= 100 ? number.toFixed(0) : number >= 1 ? number.toFixed(1) : number.toFixed(2);
}

function css([r, g, b]) {
  return `rgb(${r} ${g} ${b})`;
}

/// For tests: draws, and counts the pixels that are not paper, in the middle or in all of it.
window.atoll = {
  state,
  pixels(part = 1) {
    draw();
    return boxes().map(([x, y, width, height]) => {
      const [w, h] = [Math.round(width * part), Math.round(height * part)];
      return state.drawing.count([x + ((width - w) >> 1), y + ((height - h) >> 1), w, h], paper());
    });
  },
};
