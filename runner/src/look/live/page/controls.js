// What the user does: pointer, buttons, keys.

import { drag, release, take, tool } from "./hand.js";
import { tell } from "./link.js";
import { at, canvas, state } from "./state.js";
import { fit, follow, place, ratio, redraw, start_drawing, zoom } from "./view.js";
import { list } from "./words.js";

/// What colors may tell, by their keys.
export const COLORS = ["kind", "speed", "spin", "tile", "rank", "contacts", "asleep"];
const KEYS = [
  ["space", "play or pause"], ["→ ←", "a step on, a record back"], ["+ −", "zoom"], ["arrows + shift", "move"],
  ["f", "all of the world"], ["t", "tiles and ranks"], ["1 to 7", "color"], ["n", "first difference"],
  ["v p d e", "hand: view, pull, drop, erase"],
  ["Esc", "let go of a body"],
];

// What the button says follows once the run has heard it, which other pages may have told something else.
function play() {
  tell({ do: state.playing ? "pause" : "play" });
}

// Time stands still then.
function step(by) {
  tell({ do: "step", by });
}

function to_difference() {
  if (state.difference === null) return;
  if (state.playing) play();
  tell({ do: "seek", step: state.difference });
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
  drag(event);
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
  release();
});
canvas.addEventListener("pointercancel", () => {
  dragged = null;
  release(true);
});
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
