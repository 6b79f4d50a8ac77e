// Stop: sent at once, sent again while nobody answers, and the answer said aloud. Never disabled.
import { by, put } from "./dom.js";

const AGAIN_MS = 400;
const GIVE_UP_MS = 20000;
const PRESS_MS = 1000;
const LOGGED_OUT = "this page is not logged in any more. Open the dump valve; pamrig estop on the rig's machine. Then load the page again.";

async function one(controller) {
  const answer = await fetch("/stop", {
    method: "POST",
    headers: { Accept: "application/json", "Content-Type": "application/json" },
    body: JSON.stringify({ form_key: document.body.dataset.formKey }),
    signal: controller.signal,
    keepalive: true,
  });
  if (answer.status === 401) return { ok: false, said: LOGGED_OUT };
  return answer.json();
}

// Several requests may be under way: a server that froze is replaced, and the next one hears the next request.
function insist() {
  return new Promise((resolve, reject) => {
    const controllers = [];
    const over = (settle, value) => {
      clearInterval(timer);
      clearTimeout(end);
      settle(value);
      controllers.forEach((controller) => controller.abort());
    };
    const send = () => {
      const controller = new AbortController();
      controllers.push(controller);
      one(controller).then((said) => over(resolve, said), () => {});
    };
    const timer = setInterval(send, AGAIN_MS);
    const end = setTimeout(() => over(reject, new Error("no answer")), GIVE_UP_MS);
    send();
  });
}

export async function stop() {
  const sent = performance.now();
  put("stop-said", "Stop sent …");
  try {
    const { ok, said } = await insist();
    const ms = Math.round(performance.now() - sent);
    put("stop-said", ok ? `Stopped: ${said} (${ms} ms)` : `NOT CONFIRMED: ${said}`);
  } catch {
    put("stop-said", "NOT CONFIRMED: nobody answers. Open the dump valve; pamrig estop on the rig's machine.");
  }
}

function byKey(event) {
  if (event.key !== "Escape" || event.repeat) return;
  event.preventDefault();
  stop();
}

// The Escape key stops wherever the keyboard is, also in a report that is shown within the page.
export function hearKeys(of) { of.addEventListener("keydown", byKey, { capture: true }); }

export function wire() {
  let pressedAt = -Infinity;
  // A finger or a mouse stops as it comes down; the click that follows, and the keyboard's, is the form's.
  by("stop-button").addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    pressedAt = performance.now();
    stop();
  });
  by("stop").addEventListener("submit", (event) => {
    event.preventDefault();
    if (performance.now() - pressedAt > PRESS_MS) stop();
  });
  hearKeys(document);
}
