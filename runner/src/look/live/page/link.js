// The socket to the server.

import { at, state } from "./state.js";

const token = new URLSearchParams(location.search).get("token") ?? "";

/// What the user is told upon the world.
export const say = (text) => { at("message").textContent = text; };

const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket?token=${encodeURIComponent(token)}`);
socket.binaryType = "arraybuffer";

/// Tells the server something, and says whether it can be told.
export function tell(message) {
  const is_open = socket.readyState === WebSocket.OPEN;
  if (is_open) socket.send(JSON.stringify(message));
  return is_open;
}

/// Has words and frames heard from now on.
export function listen(hear, show) {
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : show(data));
}

socket.onopen = () => say("Waiting for the first picture…");
socket.onclose = () => {
  const end = state.failure ? state.failure
    : state.over ? `${state.hello?.recorded ? "This view" : "The run"} is over; this is what was seen last.`
      : state.hello ? "The program has ended without a word, or cannot be reached; this is what was seen last."
        : "There is no run here, or this is not its address.";
  say(end);
};
