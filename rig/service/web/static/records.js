// Past records: their plots, whether they are valid and whole, and one beside another.
import { ask, by, fill, make, put, show, shown } from "./dom.js";
import { curves, line, overTime } from "./plots.js";
import { inputAxis, outputAxis, rig, setPointColumns, setPointLines } from "./units.js";

let plots = null;
let units = null;
let chosen = null;
let kept = null;

const path = (record) => `/api/records/${encodeURIComponent(record.session)}/${encodeURIComponent(record.name)}`;

export function wire() {
  document.addEventListener("part", ({ detail }) => { if (detail === "records") begin(); });
  by("session").addEventListener("change", list);
  by("sessions-again").addEventListener("click", sessions);
  by("record-check").addEventListener("click", checkFile);
  by("record-keep").addEventListener("click", () => {
    kept = kept ? null : chosen;
    told();
  });
}

function begin() {
  if (!plots) plotsFor(rig);
  sessions();
}

// A folder may hold records of several rigs: the plots speak of the one that is shown.
function plotsFor(wanted) {
  if (JSON.stringify(wanted) === JSON.stringify(units)) return;
  units = wanted;
  for (const plot of Object.values(plots ?? {})) plot.destroy();
  const both = [line("this record", 2), line("compared with", 3, [8, 4])];
  plots = {
    pressure: overTime(by("plot-record-pressure"), setPointLines(units), units.valves ? "pressure [MPa]" : inputAxis(units), 220),
    angle: overTime(by("plot-record-angle"), both, outputAxis(units), 220),
    difference: overTime(by("plot-record-difference"), [line("this − compared with", 1)], `difference [${units.output_unit}]`, 190),
    loop: curves(by("plot-record-loop"), both, inputAxis(units), outputAxis(units), 420, units.least),
  };
}

async function sessions() {
  const before = by("session").value;
  try {
    const found = (await ask("/api/sessions")).sessions;
    fill("session", ...found.map(({ name, records }) => make("option", { value: name }, `${name} (${records})`)));
    if (!found.length) { put("record-said", "No records yet."); fill("record-list"); return; }
    if (found.some(({ name }) => name === before)) by("session").value = before;
    await list();
  } catch (error) {
    put("record-said", error.message);
  }
}

function judged(valid) {
  return valid ? "✔ valid" : valid === false ? "✖ not valid" : "nobody saw its run";
}

async function list() {
  const session = by("session").value;
  try {
    const { records } = await ask(`/api/sessions/${encodeURIComponent(session)}`);
    fill("record-list", ...records.map((record) => make("tr", {},
      make("th", { scope: "row" }, make("button", { type: "button", onclick: () => choose({ session, name: record.name }) }, record.name)),
      make("td", {}, record.problem ? "✖ cannot be read" : judged(record.valid)),
      make("td", {}, record.problem || record.ended || "–"),
      make("td", { class: "n" }, record.missed === null || record.missed === undefined ? "–" : String(record.missed)))));
  } catch (error) {
    put("record-said", error.message);
  }
}

export async function choose(record) {
  chosen = record;
  put("record-name", record.name);
  put("record-said", "Reading …");
  by("record-file").href = `${path(record)}/file`;
  by("record-file").hidden = false;
  by("record-check").disabled = by("record-keep").disabled = false;
  told();
  try {
    const found = await ask(path(record));
    if (chosen !== record) return;
    if (found.problem) throw new Error(found.problem);
    put("record-said", `${judged(found.valid)}, ${shown(found.seconds, 1)} s, ${found.missed} missed, ${found.dropped} dropped${found.fault ? `, fault ${found.fault}` : ""}`);
    fill("record-lines", ...found.lines.map((one) => make("tr", {}, make("td", { class: "n" }, shown(one.t_s, 3, "s")), make("td", {}, one.level), make("td", {}, one.text))));
    show("record-seen", true);
    plotsFor(found.units);
    draw(found.columns);
    if (kept && kept !== record) await compare(record);
  } catch (error) {
    if (chosen === record) put("record-said", `It cannot be shown: ${error.message}`);
  }
}

const none = (columns) => columns.t_s.map(() => null);
const loopOf = (columns) => [columns.input, columns.output ?? none(columns)];

function draw(columns) {
  const of = (name) => columns[name] ?? none(columns);
  plots.pressure.setData([columns.t_s, ...setPointColumns(units).map(of)]);
  plots.angle.setData([columns.t_s, of("output"), none(columns)]);
  plots.difference.setData([[], []]);
  plots.loop.setData([[], loopOf(columns), [[], []]]);
}

async function compare(record) {
  const side = (one) => encodeURIComponent(`${one.session}/${one.name}`);
  const found = await ask(`/api/compare?a=${side(kept)}&b=${side(record)}`);
  plots.angle.setData([found.b.t_s, found.b.output, found.a.output]);
  plots.difference.setData([found.b.t_s, found.difference]);
  plots.loop.setData([[], loopOf(found.b), loopOf(found.a)]);
  put("compare-said", `Compared with ${kept.name} of ${kept.session}: difference ${shown(found.rmse, 3)} ${units.output_unit} rms, ${shown(found.max, 3)} ${units.output_unit} at most, mean ${shown(found.mean, 3)} ${units.output_unit}.`);
}

function told() {
  by("record-keep").textContent = kept ? "Compare no more" : "Compare others with this";
  put("compare-said", kept ? `Choose a record to compare with ${kept.name} of ${kept.session}.` : "");
}

async function checkFile() {
  put("record-said", "Checking …");
  try {
    const { ok, findings } = await ask(`${path(chosen)}/check`);
    put("record-said", ok ? "✔ The file is whole and true." : `✖ ${findings.join("\n✖ ")}`);
  } catch (error) {
    put("record-said", `It cannot be checked: ${error.message}`);
  }
}
