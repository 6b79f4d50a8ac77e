// Who commands, and the steps: arm, then start. Nothing here happens by itself.
import { ask, by, put, seconds, show } from "./dom.js";

const me = document.body.dataset.me;
const STEPS = {
  arm: { path: "/api/arm", when: (s) => s.state === "disarmed", done: (lines) => ["Armed.", ...lines].join("\n") },
  start: { path: "/api/start", body: () => ({}), when: (s) => (s.state === "armed" || s.state === "done") && s.left_s > 0 && !s.working, done: () => "Started." },
  "ramp-down": { path: "/api/ramp-down", body: () => ({}), when: (s) => ["armed", "running", "done"].includes(s.state), done: (result) => result.did },
  "after-current": { path: "/api/ramp-down", body: () => ({ after_current: true }), when: (s) => s.state === "running", done: (result) => result.did },
  reset: { path: "/api/reset", when: (s) => s.state === "fault", done: () => "Reset: disarmed." },
};
let commanding = false;

export const isCommanding = () => commanding;

export function wire() {
  for (const [id, step] of Object.entries(STEPS)) {
    by(id).addEventListener("click", () => carryOut(step.path, step.body?.() ?? {}, step.done));
  }
  by("take").addEventListener("click", () => carryOut("/api/command/take", {}, () => "You command."));
  by("give-up").addEventListener("click", () => carryOut("/api/command/give-up", {}, () => "You look on."));
  by("mark").addEventListener("submit", async (event) => {
    event.preventDefault();
    if (await carryOut("/api/mark", { text: by("mark-text").value }, () => "Marked.")) by("mark-text").value = "";
  });
}

// Returns whether it was done; what was said stands under the buttons.
export async function carryOut(path, body, done, to = "answer") {
  put(to, "…");
  try {
    put(to, done((await ask(path, body, 150000)).result));
    return true;
  } catch (error) {
    put(to, `Not done: ${error.message}`);
    return false;
  }
}

export function status(message) {
  if (message.badge === "no daemon") return;
  commanding = message.commander === me;
  const who = commanding ? "You command." : message.commander ? `Browser ${message.commander} commands; you look on.` : "Nobody commands by this page.";
  put("commander", who + " Everybody may stop.");
  show("take", !commanding);
  by("take").disabled = Boolean(message.commander);
  show("give-up", commanding);
  for (const [id, step] of Object.entries(STEPS)) by(id).disabled = !(commanding && step.when(message));
  by("arm").classList.toggle("primary", true);
  by("start").classList.toggle("primary", true);
  by("ramp-down").textContent = message.state === "running" ? "Ramp down" : "Disarm";
  progress(message);
  document.dispatchEvent(new CustomEvent("status", { detail: message }));
}

function progress({ record, left_s, working, pause_s }) {
  const rest = pause_s > 0 ? ` The muscles rest, ${seconds(pause_s)} left.` : "";
  const queue = left_s > 0 ? `${seconds(left_s)} of work left${working ? "" : ", held: Start goes on"}.` : "Nothing waits.";
  put("work", (record ? `${record.name}: ${Math.round(record.done * 100)} %, ${seconds(record.left_s)} left. ` : "") + queue + rest);
  show("progress", Boolean(record));
  if (record) by("progress").value = record.done;
}
