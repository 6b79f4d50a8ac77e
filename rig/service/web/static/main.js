// The page comes alive: Stop first, then what the server tells, then everything else.
import * as bringup from "./bringup.js";
import * as command from "./command.js";
import * as diagnosis from "./diagnosis.js";
import * as live from "./live.js";
import * as records from "./records.js";
import * as runs from "./runs.js";
import * as state from "./state.js";
import * as stop from "./stop.js";
import * as parts from "./parts.js";

stop.wire();
command.wire();
live.wire();
runs.wire();
records.wire();
diagnosis.wire();
bringup.wire();
parts.wire();

const AGAIN_MS = 500;
const listeners = {
  hello: (message) => { state.hello(message); live.hello(message); },
  status: (message) => { state.status(message); command.status(message); },
  rows: live.rows,
  anew: live.anew,
  behind: () => socket.close(),
  stopped: state.stopped,
  marker: live.marker,
};
let socket;

// Reconnects by itself and does nothing else by itself: what the rig does, only a person asks for.
function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
  socket.onmessage = (event) => {
    const message = JSON.parse(event.data);
    state.heard();
    listeners[message.kind]?.(message);
  };
  socket.onclose = () => setTimeout(connect, AGAIN_MS);
}
connect();
setInterval(state.look, 200);
