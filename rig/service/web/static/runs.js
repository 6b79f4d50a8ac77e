// Sweeps: looked at before they run, started by who commands, and the queue.
import { carryOut, isCommanding } from "./command.js";
import { ask, by, fill, make, parsed, put, seconds, show, shown } from "./dom.js";
import { line, overTime } from "./plots.js";
import { inputAxis, rig } from "./units.js";

const OPEN = ["waiting", "running", "stopped"];
let plot = null;
let fits = false;
let latest = null;

export function wire() {
  document.addEventListener("part", ({ detail }) => { if (detail === "runs" && !plot) begin(); });
  document.addEventListener("status", ({ detail }) => { latest = detail; queue(detail); });
  by("sweep").addEventListener("change", preview);
  by("pause-s").addEventListener("input", check);
  by("queue-form").addEventListener("submit", start);
  by("clear").addEventListener("click", () => carryOut("/api/clear", {}, () => "Taken out.", "runs-answer"));
}

async function begin() {
  const lines = rig.valves ? [line("p1 set-point", 0), line("p2 set-point", 1, [6, 3])] : [line(rig.input, 0)];
  plot = overTime(by("plot-preview"), lines, rig.valves ? "pressure [MPa]" : inputAxis(rig), 240);
  try {
    const { sweeps } = await ask("/api/sweeps");
    fill("sweep", ...sweeps.map((name) => make("option", { value: name }, name)));
    if (sweeps.includes("quick")) by("sweep").value = "quick";
    await preview();
  } catch (error) {
    put("preview-said", error.message);
  }
}

async function preview() {
  const name = by("sweep").value;
  fits = false;
  check();
  put("preview-said", "Expanding …");
  try {
    const found = await ask(`/api/sweeps/${encodeURIComponent(name)}`);
    if (name !== by("sweep").value) return;
    const { columns } = found;
    plot.setData([columns.t_s, ...(rig.valves ? [columns.p1_cmd_mpa, columns.p2_cmd_mpa] : [columns.input])]);
    const unit = rig.input_unit;
    const allowed = found.allowed ? ` of ${found.allowed[0]} to ${found.allowed[1]}` : "";
    put("preview-records", String(found.records));
    put("preview-seconds", seconds(found.seconds));
    put("preview-range", `${shown(found.lowest, 3)} to ${shown(found.highest, 3)}${allowed} ${unit}`);
    put("preview-rate", `${shown(found.fastest_per_s, 2)} of ${found.allowed_per_s} ${unit}/s`);
    put("preview-said", "It fits the rig's envelope. Nothing has moved.");
    fits = true;
  } catch (error) {
    plot.setData([[], ...(rig.valves ? [[], []] : [[]])]);
    for (const id of ["records", "seconds", "range", "rate"]) put(`preview-${id}`, "–");
    put("preview-said", `It cannot run: ${error.message}`);
  }
  check();
}

// The rest may be written with a comma; what is no number is told, and nothing is sent.
function check() {
  const rest = parsed(by("pause-s").value);
  const wrong = Number.isNaN(rest) || rest < 0 || rest > 86400;
  put("pause-said", wrong ? "A number of seconds from 0 to 86400, for example 1,5" : "");
  const ready = latest && (latest.state === "armed" || latest.state === "running" || latest.state === "done");
  by("queue-it").disabled = !(fits && !wrong && ready && isCommanding());
  by("queue-it").textContent = latest?.working ? "Add this sweep to the queue" : "Start this sweep";
}

async function start(event) {
  event.preventDefault();
  const asked = !by("before").hidden && document.querySelector("input[name=before]:checked").value;
  const body = { sweeps: [by("sweep").value], pause_s: by("pause-s").value, before: asked || "" };
  await carryOut("/api/start", body, ([job]) => `Queued: ${job.records} ${job.records === 1 ? "record" : "records"}, ${seconds(job.seconds)}.`, "runs-answer");
}

function queue(message) {
  const jobs = message.queue;
  const open = jobs.filter((job) => OPEN.includes(job.state));
  show("before", message.interrupted.length > 0);
  put("queue-total", open.length ? `${open.length} to do, ${seconds(message.left_s)} left${message.working ? "" : "; held"}` : "Nothing waits.");
  by("clear").disabled = !(isCommanding() && jobs.some((job) => job.state !== "running" && job.state !== "done"));
  check();
  const key = JSON.stringify(jobs);
  if (by("queue").dataset.key === key) return;
  by("queue").dataset.key = key;
  fill("queue", ...jobs.toReversed().map((job) => make("tr", {},
    make("th", { scope: "row" }, job.name),
    make("td", {}, job.state),
    make("td", { class: "n" }, `${job.done} of ${job.total}`),
    make("td", {}, [job.not_valid ? `${job.not_valid} not valid` : "", job.error].filter(Boolean).join("; ")))));
}
