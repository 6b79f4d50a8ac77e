// Gap and causes over the days: what was diagnosed with the model and the reference that are chosen.
import { ask, by, fill, make, put } from "./dom.js";
import { inked, line, overDays, word } from "./plots.js";

const MOST_EFFECTS = 6;
let drawn = "";
let plots = [];

export async function look() {
  const asked = ["model", "reference"].map((each) => `${each}=${encodeURIComponent(by(`diagnose-${each}`).value)}`);
  let found;
  if (!drawn) put("history-said", "Looking back …");
  try { found = await ask(`/api/history?${asked.join("&")}`); } catch (error) { put("history-said", error.message); return; }
  put("history-said", said(found));
  const key = JSON.stringify(found);
  if (key === drawn) return;
  drawn = key;
  draw(found);
}

function said({ days, words }) {
  if (!days.length) return "Nothing was diagnosed with this simulator and this reference yet.";
  return days.length === 1 ? "One day so far." : words.join("\n");
}

function draw({ days, unit, changes, effects }) {
  for (const plot of plots) plot.destroy();
  plots = [];
  fill("history-sizes");
  if (!days.length) return;
  const times = days.map((day) => day.at_s);
  const at = Object.fromEntries(days.map((day) => [day.name, day.at_s]));
  const where = (quantity) => changes.filter((change) => change.quantity === quantity).map((change) => at[change.day]);
  const gap = overDays(by("plot-history"), [line("gap", 0), line("floor", 1, [6, 3])], `rms [${unit}]`, 240, { draw: [marks(where("gap_deg"))] });
  gap.setData([times, days.map((day) => day.gap), days.map((day) => day.floor)]);
  plots = [gap, ...Object.entries(effects).slice(0, MOST_EFFECTS).map(([effect, of]) => sizes(effect, of, days, times, where(effect)))];
}

function sizes(effect, unit, days, times, changed) {
  const name = effect.replaceAll("_", " ");
  const element = make("div", { role: "img", "aria-label": `Size of ${name} over the days, with its 95 % interval` });
  by("history-sizes").append(element);
  const of = (which) => days.map((day) => day.sizes[effect]?.[which] ?? null);
  const [low, high] = [of("low"), of("high")];
  const plot = overDays(element, [line(name, 2)], unit === "1" ? name : `${name} [${unit}]`, 220, { draw: [bars(times, low, high), marks(changed)] }, [...low, ...high]);
  plot.setData([times, of("value")]);
  return plot;
}

// The 95 % interval of each day.
const bars = (times, low, high) => inked((plot) => {
  times.forEach((time, index) => {
    if (low[index] === null) return;
    const x = plot.valToPos(time, "x", true);
    const [top, bottom] = [high[index], low[index]].map((value) => plot.valToPos(value, "y", true));
    plot.ctx.fillRect(x - devicePixelRatio, top, 2 * devicePixelRatio, bottom - top);
  });
});

// A day from which on a quantity is another: a line, named for those who do not see it in the sentences above.
const marks = (times) => inked((plot) => {
  const { ctx, bbox } = plot;
  ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
  for (const time of times) {
    const x = plot.valToPos(time, "x", true);
    ctx.beginPath();
    ctx.moveTo(x, bbox.top);
    ctx.lineTo(x, bbox.top + bbox.height);
    ctx.stroke();
    word(plot, "changed", x);
  }
});
