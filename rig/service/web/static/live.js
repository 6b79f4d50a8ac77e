// The live plots: rows come many times a second, drawing follows the screen's frames, at most 30 a second.
import { by, put } from "./dom.js";
import { curves, inked, line, overTime, word } from "./plots.js";
import { inputAxis, outputAxis, rig, setPointLines } from "./units.js";

const [T, INPUT, OUTPUT, SIM, RESIDUAL, P1C, P2C, P1, P2] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
const COMMANDS = rig.valves ? [P1C, P1, P2C, P2] : [INPUT];
const FINE_S = 60;
const COARSE_S = 600;
const FRAME_MS = 33;
const STRETCHES = 200;
const fine = [];
const coarse = [];
const markers = [];
let plots = null;
let dirty = false;
let paused = false;
let drawnAt = 0;
let frames = 0;

export function wire() {
  const marks = (named) => ({ draw: [inked((plot) => drawMarkers(plot, named))] });
  plots = {
    pressure: overTime(by("plot-pressure"), setPointLines(rig), rig.valves ? "pressure [MPa]" : inputAxis(rig), 220, marks(true)),
    angle: overTime(by("plot-angle"), [line(rig.output, 2), line("simulator", 3, [8, 4])], outputAxis(rig), 220, marks(false)),
    residual: overTime(by("plot-residual"), [line(`${rig.output} − simulator`, 1)], `residual [${rig.output_unit}]`, 190, marks(false)),
    loop: curves(by("plot-loop"), [line("rig", 2), line("simulator", 3, [8, 4])], inputAxis(rig), outputAxis(rig), 420, rig.least),
  };
  by("window").addEventListener("change", () => { dirty = true; });
  by("pause").addEventListener("click", () => {
    paused = !paused;
    by("pause").setAttribute("aria-pressed", String(paused));
    by("pause").textContent = paused ? "Go on" : "Pause";
    dirty = true;
  });
  requestAnimationFrame(frame);
  setInterval(() => { put("rate", paused ? "paused" : `${frames / 2} frames a second`); frames = 0; }, 2000);
}

export function hello(message) {
  anew();
  fine.push(...message.fine);
  coarse.push(...message.coarse);
  dirty = true;
}

export function anew() {
  fine.length = coarse.length = markers.length = 0;
  dirty = true;
}

export function rows(message) {
  fine.push(...message.fine);
  coarse.push(...message.coarse);
  forget(fine, FINE_S + 5);
  forget(coarse, COARSE_S + 20);
  dirty = true;
}

export function marker(message) {
  markers.push({ t: fine.at(-1)?.[T] ?? 0, text: message.text });
  dirty = true;
}

function forget(list, keptS) {
  const since = (list.at(-1)?.[T] ?? 0) - keptS;
  let count = 0;
  while (count < list.length && list[count][T] < since) count++;
  if (count > 100) list.splice(0, count);
}

function frame(now) {
  const { length } = fine;
  if (dirty && !paused && length && !by("rig").hidden && now - drawnAt >= FRAME_MS - 8) {
    drawnAt = now;
    dirty = false;
    frames++;
    draw();
  }
  requestAnimationFrame(frame);
}

function draw() {
  const windowS = Number(by("window").value);
  const rows = windowS > FINE_S ? coarse : fine;
  if (!rows.length) return;
  const end = rows.at(-1)[T];
  const seen = thinned(rows.slice(from(rows, end - windowS)), windowS / STRETCHES);
  const column = (index) => seen.map((row) => row[index]);
  const time = seen.map((row) => row[T] - end);
  put("live-title", `Live: the last ${by("window").selectedOptions[0].text}`);
  over(plots.pressure, windowS, [time, ...COMMANDS.map(column)]);
  over(plots.angle, windowS, [time, column(OUTPUT), column(SIM)]);
  over(plots.residual, windowS, [time, column(RESIDUAL)]);
  plots.loop.setData([[], [column(INPUT), column(OUTPUT)], [column(INPUT), column(SIM)]]);
  plots.end = end;
}

// Of each stretch of time the rows with the smallest and the largest output: no more than a screen shows, no peak lost.
// Stretches stand still in time, so that nothing flickers.
function thinned(rows, stretchS) {
  if (rows.length <= 2 * STRETCHES) return rows;
  const kept = [];
  for (let i = 0; i < rows.length;) {
    const stretch = Math.floor(rows[i][T] / stretchS);
    let low = i;
    let high = i;
    for (; i < rows.length && Math.floor(rows[i][T] / stretchS) === stretch; i++) {
      if (rows[i][OUTPUT] < rows[low][OUTPUT]) low = i;
      if (rows[i][OUTPUT] > rows[high][OUTPUT]) high = i;
    }
    kept.push(rows[Math.min(low, high)]);
    if (low !== high) kept.push(rows[Math.max(low, high)]);
  }
  if (kept.at(-1) !== rows.at(-1)) kept.push(rows.at(-1));
  return kept;
}

function over(plot, windowS, data) {
  plot.batch(() => {
    plot.setData(data, false);
    plot.setScale("x", { min: -windowS, max: 0 });
  });
}

// The first row at or after a time.
function from(rows, time) {
  let low = 0;
  let high = rows.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (rows[middle][T] < time) low = middle + 1; else high = middle;
  }
  return low;
}

function drawMarkers(plot, named) {
  const { ctx, bbox } = plot;
  for (const { t, text } of markers) {
    const x = plot.valToPos(t - (plots?.end ?? 0), "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) continue;
    ctx.fillRect(x, bbox.top, devicePixelRatio, bbox.height);
    if (named) word(plot, text.slice(0, 40), x);
  }
}
