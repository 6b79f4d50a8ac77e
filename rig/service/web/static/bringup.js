// Bring-up and calibration: the steps of the command line, what is seen of them, and what comes next.
import { carryOut, isCommanding } from "./command.js";
import { ask, by, fill, make, put } from "./dom.js";

const LOOK_MS = 2000;
let timer = null;

export function wire() {
  document.addEventListener("part", ({ detail }) => {
    clearInterval(timer);
    if (detail === "bringup") { look(); timer = setInterval(look, LOOK_MS); }
  });
}

async function look() {
  try { draw(await ask("/api/bring-up")); } catch (error) { put("bringup-next", error.message); }
}

function draw({ steps, next, calibrated }) {
  const key = JSON.stringify([steps.map(({ seen, ...rest }) => ({ ...rest, seen: Boolean(seen) })), isCommanding()]);
  const coming = steps.find((step) => step.name === next);
  put("bringup-next", (coming ? `Next: ${coming.title}` : "All steps are done.") + (calibrated.length ? ` Calibrated: ${calibrated.join(", ")}.` : ""));
  if (by("bringup-steps").dataset.key === key) return;
  by("bringup-steps").dataset.key = key;
  fill("bringup-steps", ...steps.map((step) => item(step, step.name === next)));
}

function item(step, isNext) {
  const state = step.seen ? `✔ seen: ${step.seen}` : step.confirmed ? `✔ confirmed by ${step.confirmed.by}, ${new Date(step.confirmed.at_s * 1000).toLocaleString()}` : "○ open";
  const confirm = make("button", { type: "button", disabled: !isCommanding(), onclick: () => said(step) }, step.confirmed ? `Not done: ${step.title}` : `Done: ${step.title}`);
  return make("li", { class: "card", "aria-current": isNext ? "step" : null },
    make("h2", {}, step.title + (step.moves ? " · under pressure" : "")),
    make("p", {}, step.do),
    ...(step.command ? [make("p", {}, make("code", {}, step.command))] : []),
    make("p", {}, state),
    ...(step.seen ? [] : [confirm]));
}

async function said(step) {
  await carryOut("/api/bring-up/confirm", { step: step.name, done: !step.confirmed }, () => "Noted.", "bringup-next");
  await look();
}
