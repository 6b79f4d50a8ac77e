// State at a glance: badge, fault, figures, and whether any of it is still true.
import { by, put, seconds, show, shown } from "./dom.js";
import { rig } from "./units.js";

const MARKS = { ready: "○", armed: "◐", running: "▶", stopping: "▼", fault: "✖", "no daemon": "✖", stale: "✖", opening: "…" };
let freshS = 0.8;
let heardAt = performance.now();
let now = null;
let announced = "";

export function hello(message) { freshS = message.fresh_s; }

export function heard() { heardAt = performance.now(); }

export function status(message) {
  if (now?.state === "fault" && message.state && message.state !== "fault") put("stop-said", "");  // it was of that fault
  now = message;
  badge(message.badge, message.means);
  if (message.badge === "no daemon") return;
  const { loop } = message;
  by("reality").dataset.simulated = message.simulated ? "yes" : "no";
  put("reality", message.simulated ? "SIMULATED" : "REAL RIG");
  put("rig-name", message.rig);
  const pressure = (valve) => `${shown(loop[`p${valve}_mpa`], 3)} of ${shown(loop[`p${valve}_cmd_mpa`], 3, "MPa")}`;
  if (rig.valves) {
    put("now-p1", pressure(1));
    put("now-p2", pressure(2));
  } else put("now-input", shown(message.now.input, 2, rig.input_unit));
  put("now-output", shown(message.now.output, 2, rig.output_unit));
  put("now-armed", message.state === "armed" || message.state === "running" || message.state === "done" ? message.armed_by || "somebody at the command line" : "nobody");
  const gone = Object.keys(message.processes).filter((name) => !message.processes[name]);
  put("now-watchdogs", gone.length ? `✖ not running: ${gone.join(", ")}` : `✔ ${Object.keys(message.processes).join(", ")}`);
  put("now-lateness", shown(message.lateness_us.p99, 0, "µs"));
  put("now-missed", message.missed === null || message.missed === undefined ? "–" : String(message.missed));
  put("now-disk", message.disk_free_gb === null ? "✖ the folder for the records is gone" : shown(message.disk_free_gb, 1, "GB"));
  put("now-viewers", `${message.viewers} ${message.viewers === 1 ? "page" : "pages"}`);
  put("warnings", [message.recording_error && `Records cannot be written: ${message.recording_error}`, message.denied.length ? `Real-time measures: ${message.denied.join("; ")}` : ""].filter(Boolean).join("\n"));
  fault(message);
}

function badge(word, means) {
  by("badge").dataset.badge = word;
  put("badge-mark", MARKS[word] || "");
  put("badge-word", word);
  put("means", means);
  document.title = `${word} · ${now?.rig || "rig"} · pamrig`;
}

function fault({ fault, fault_since_s, safe_state, black_box }) {
  show("fault", Boolean(fault));
  announce(fault ? `Fault ${fault.name}: ${fault.cause}. What to do: ${fault.hint}` : "");
  if (!fault) return;
  put("fault-name", fault.name);
  put("fault-cause", fault.cause + (fault.said ? ` (${fault.said})` : ""));
  put("fault-hint", fault.hint + (fault.name === "ESTOP" ? "" : " Then: Reset."));
  put("fault-safe", [safe_state?.words, black_box && `Last seconds: ${black_box.split("/").pop()}`].filter(Boolean).join(". "));
  if (fault_since_s !== null) {
    const at = new Date(Date.now() - fault_since_s * 1000);
    put("fault-time", `at ${at.toLocaleTimeString()}, ${seconds(fault_since_s)} ago`);
  }
}

// Once, for who hears the page: what is shown beside it counts seconds, and would be read again with each.
function announce(text) {
  if (text === announced) return;
  announced = text;
  put("announce", text);
}

export function stopped(message) {
  put("stop-said", message.safe ? `Stopped by browser ${message.by}: ${message.said}` : `NOT CONFIRMED: ${message.said}`);
}

// Called a few times a second: what is old is said to be old.
export function look() {
  const silentS = (performance.now() - heardAt) / 1000;
  let why = "";
  let sinceS = null;
  if (silentS > freshS) {
    why = "STALE: nothing is heard from the page's server. Stop still sends; pamrig estop and the dump valve always work.";
    sinceS = silentS;
  } else if (now?.badge === "no daemon") why = `STALE: ${now.why}`;
  else if (now?.loop?.live === false && now.loop.tick !== null) {
    why = "STALE: the loop is not seen any more.";
    sinceS = now.loop.age_s;
  }
  document.body.classList.toggle("old", Boolean(why));
  show("stale", Boolean(why));
  put("stale-why", why);
  put("stale-since", why ? shown(sinceS, 1, "s").replace("–", "") : "");
  if (silentS > freshS) badge("stale", "What is shown is old");
}
