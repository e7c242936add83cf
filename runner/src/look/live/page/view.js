// What is looked at: where the world is upon the page, and its drawing.

import { Drawing } from "./draw.js";
import { tell } from "./link.js";
import { at, canvas, state } from "./state.js";

/// Pixels of the canvas in one of the page: no more in all than the server draws.
export const ratio = () => Math.min(devicePixelRatio, Math.sqrt(2 ** 24 / (canvas.clientWidth * canvas.clientHeight)), 8192 / canvas.clientWidth);

export function start_drawing() {
  state.drawing = new Drawing(canvas);
  state.sources = state.hello.sources.map((source) => {
    const made = state.drawing.source(source, state.hello.static_color);
    state.drawing.grid(made, source, state.hello.rank_colors);
    return made;
  });
}

export function redraw() {
  if (!state.due) {
    state.due = true;
    requestAnimationFrame(draw);
  }
}

export function boxes() {
  const count = Math.max(1, state.sources.length);
  const width = Math.floor(canvas.width / count);
  return Array.from({ length: count }, (_, i) => [i * width, 0, width, canvas.height]);
}

export function paper() {
  const [r, g, b] = getComputedStyle(at("stage")).backgroundColor.match(/[\d.]+/g).map(Number);
  return [r / 255, g / 255, b / 255];
}

export function draw() {
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
  const message = {
    do: "look", view: [x - half[0], y - half[1], x + half[0], y + half[1]], size: [width, height], color: at("color").value,
  };
  const asked = JSON.stringify(message);
  if (asked !== state.asked && width && height && tell(message)) state.asked = asked;
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

export function fit() {
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

export function follow(on) {
  state.following = on;
  at("follow").setAttribute("aria-pressed", on);
  if (on && state.marked) [state.camera.x, state.camera.y] = state.marked;
  redraw();
}

/// The source under the pointer, and the place in the world.
export function place({ offsetX, offsetY }) {
  const [, , width, height] = boxes()[0];
  const [x, y] = [offsetX * ratio(), offsetY * ratio()];
  const source = Math.min(state.sources.length - 1, Math.floor(x / width));
  const { camera } = state;
  return { source, at: [camera.x + (x - source * width - width / 2) / camera.zoom, camera.y - (y - height / 2) / camera.zoom] };
}

export function zoom(times, around) {
  const { camera } = state;
  // Nobody wants to see less than a micrometer or more than what doubles can tell apart.
  const next = Math.min(1e6, Math.max(1e-6, camera.zoom * times));
  const [x, y] = around ?? [camera.x, camera.y];
  camera.x = x + (camera.x - x) * camera.zoom / next;
  camera.y = y + (camera.y - y) * camera.zoom / next;
  camera.zoom = next;
  redraw();
}
