// The hand: it pulls bodies, drops them and takes them away.

import { tell } from "./link.js";
import { at, state } from "./state.js";
import { place } from "./view.js";

/// What the hand holds: where it is, and whether it takes away what is there.
let held = null;

/// Has something done to the world before its next step. A name may have more digits than numbers have here: so it is text.
function command(line) {
  tell({ do: "command", line });
}

export function tool(name) {
  at("tool").value = name;
  at("shape-choice").hidden = name !== "drop";
  held = null;
}

/// Takes hold of the body that is there, or puts one there.
export function take(event) {
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

/// The body that was pointed at, where it is now.
export function find() {
  if (!held) return;
  held.found = true;
  if (held.erases) {
    command(`{"remove":${state.body.id}}`);
    held = null;
    tell({ do: "drop" });
  }
  pull();
}

/// The hand has moved.
export function drag(event) {
  if (!held || held.erases) return;
  held.at = place(event).at;
  pull();
}

/// It lets go; what is to be taken away once it is found still is, unless all is off.
export function release(all = false) {
  if (all || !held?.erases) held = null;
}
