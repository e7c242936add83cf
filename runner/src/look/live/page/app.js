// The page: what the server says goes where it belongs.

import { COLORS } from "./controls.js";
import { decode } from "./frame.js";
import { find } from "./hand.js";
import { listen, say, tell } from "./link.js";
import { beyond, clock, difference, figures, legend, name_shapes, note, pace, speed } from "./panel.js";
import { at, state } from "./state.js";
import { boxes, draw, fit, paper, redraw, start_drawing } from "./view.js";
import { list, options } from "./words.js";

const heard = { hello, pace, figures, body, difference, tiles, shapes, note, failed, over };
listen(({ type, ...message }) => heard[type]?.(message), (data) => show(decode(data)));

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
  at("compared").hidden = message.sources.length < 2;
  at("difference").disabled = true;
  const is_compared = message.sources.every(({ hertz }) => hertz === message.sources[0].hertz);
  at("difference").textContent = is_compared ? "Comparing…" : "Not compared: steps of other lengths";
  at("apart").hidden = true;
  beyond();
  state.asked = "";
  fit();
}

/// There are more kinds of bodies than before.
function shapes({ shapes }) {
  state.hello.sources[0].shapes = shapes;
  start_drawing();
  name_shapes();
  redraw();
}

/// Tiles were cut or joined, or have gone to other ranks.
function tiles({ worlds }) {
  worlds.forEach((held, i) => {
    const source = Object.assign(state.hello.sources[i], held);
    if (state.drawing) state.drawing.grid(state.sources[i], source, state.hello.rank_colors);
  });
  if (state.drawing) redraw();
}

function show(frame) {
  if (!state.drawing) return;
  state.drawing.load(state.sources[frame.source], frame);
  // That of another run may be shorter or longer; the time is the same.
  if (frame.source === 0) state.step = frame.step;
  state.time = frame.time;
  if (state.following && frame.followed && frame.source === state.body?.source) {
    [state.camera.x, state.camera.y] = frame.followed;
  }
  if (frame.followed) state.marked = frame.followed;
  legend(frame.source, frame.legend);
  say("");
  clock();
  redraw();
  // The next may come once this one is drawn.
  if (frame.source === state.sources.length - 1) {
    requestAnimationFrame(() => tell({ do: "ack", frame: frame.number }));
    state.frames += 1;
  }
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
    find();
  }
  at("follow").setAttribute("aria-pressed", state.following);
  redraw();
}

function failed({ why }) {
  state.failure = `${state.hello?.recorded ? "This view" : "The run"} has failed: ${why}`;
  say(state.failure);
}

function over() {
  state.over = true;
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
