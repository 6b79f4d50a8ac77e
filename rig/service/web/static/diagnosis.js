// Diagnosis: which records against what, the report, and what was found over the days.
import { carryOut, isCommanding } from "./command.js";
import { ask, by, fill, make, put, show, shown } from "./dom.js";
import * as history from "./history.js";
import { hearKeys } from "./stop.js";

const LOOK_MS = 2000;
let timer = null;
let wanted = null;

export function wire() {
  document.addEventListener("part", ({ detail }) => {
    clearInterval(timer);
    if (detail === "diagnosis") { begin(); timer = setInterval(list, LOOK_MS); }
  });
  document.addEventListener("status", ({ detail }) => {
    by("diagnose-begin").disabled = !(isCommanding() && detail.state !== "running" && by("diagnose-session").value);
  });
  by("diagnose").addEventListener("submit", start);
  by("report").addEventListener("load", () => { if (by("report").contentDocument) hearKeys(by("report").contentDocument); });
  for (const each of ["model", "reference"]) by(`diagnose-${each}`).addEventListener("change", history.look);
}

const options = (names) => names.map((name) => make("option", { value: name }, name));

async function begin() {
  try {
    const [{ sessions }, { models, references }] = await Promise.all([ask("/api/sessions"), ask("/api/diagnoses")]);
    const names = sessions.map(({ name }) => name);
    const before = ["session", "model", "reference"].map((each) => by(`diagnose-${each}`).value);
    fill("diagnose-session", ...options(names));
    fill("diagnose-model", ...options(models));
    fill("diagnose-reference", ...options(references));
    ["session", "model", "reference"].forEach((each, index) => { if (before[index]) by(`diagnose-${each}`).value = before[index]; });
    if (!before[1] && models.includes("simulated")) by("diagnose-model").value = "simulated";
    if (!before[2]) by("diagnose-reference").value = names.length > 1 ? "auto" : "simulator";
    fill("diagnose-baselines", ...names.map((name) => make("label", { class: "choice" },
      make("input", { type: "checkbox", name: "baseline", value: name }), name)));
    const { hunts } = await ask("/api/hunts");
    fill("hunts", ...(hunts.length ? hunts.map(hunted) : ["None below the folder of records."]));
    await list();
  } catch (error) {
    put("diagnose-answer", error.message);
  }
}

async function start(event) {
  event.preventDefault();
  const baselines = [...document.querySelectorAll("input[name=baseline]:checked")].map((each) => each.value);
  const body = { session: by("diagnose-session").value, model: by("diagnose-model").value, reference: by("diagnose-reference").value, baselines };
  if (await carryOut("/api/diagnoses/begin", body, (name) => { wanted = name; return "At work; it may take a minute."; }, "diagnose-answer")) await list();
}

async function list() {
  let found;
  try { found = (await ask("/api/diagnoses")).diagnoses; } catch { return; }
  const key = JSON.stringify(found);
  if (by("diagnoses").dataset.key !== key) {
    by("diagnoses").dataset.key = key;
    fill("diagnoses", ...found.map(row));
    history.look();
  }
  const over = found.find((one) => one.name === wanted && one.state !== "at work");
  if (over) {
    wanted = null;
    put("diagnose-answer", over.state === "done" ? "Done." : `Not done: ${over.said}`);
    if (over.state === "done") open(over);
  }
}

const when = ({ name, asked }) => (asked.asked_s ? new Date(asked.asked_s * 1000).toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" }) : name);

function row(one) {
  const opens = one.state === "done" ? make("button", { type: "button", onclick: () => open(one) }, when(one)) : when(one);
  return make("tr", {},
    make("th", { scope: "row" }, opens),
    make("td", {}, one.asked.session ?? "–"),
    make("td", {}, one.state === "done" ? `${String(one.verdict).replaceAll("_", " ")}${one.confidence ? `, ${Math.round(one.confidence * 100)} %` : ""}` : `${one.state} ${one.said}`),
    make("td", {}, one.causes?.join(", ") || "–"),
    make("td", { class: "n" }, shown(one.gap, 3, one.gap === null || one.gap === undefined ? "" : one.unit)));
}

const possible = (step) => (step.done ? `still possible: ${step.possible.map(({ name, probability }) => `${name} ${Math.round(probability * 100)} %`).join(", ") || "–"}` : "not run yet");

function hunted(hunt) {
  return make("div", {},
    make("h3", {}, `${hunt.name}: ${hunt.ended || "goes on"}`),
    make("ol", {}, ...hunt.steps.map((step) => make("li", {}, `${step.sweep}, ${shown(step.minutes, 1)} min: ${step.why}; ${possible(step)}`))));
}

function open(one) {
  show("report-card", true);
  put("report-title", `Report of ${one.asked.session}`);
  const address = `/diagnoses/${encodeURIComponent(one.name)}`;
  by("report").src = address;
  by("report-link").href = address;
  by("report-title").focus();
}
