// Plots: uPlot with the page's colours. Lines differ by dash and name too, never by colour alone.

const DAY_S = 86400;
const scheme = matchMedia("(prefers-color-scheme: dark)");
const ink = () => (scheme.matches ? "#edf0f2" : "#14171a");
const faint = () => (scheme.matches ? "#3a4248" : "#d9dde1");
const COLOURS = [["#0068a5", "#6fc3ff"], ["#b04a00", "#ffab6b"], ["#00704f", "#53d8ae"], ["#7a2f8f", "#e0a0f0"]];
const drawn = new Set();

// Lights go out while the page is open: what was drawn is drawn again, and the legends with it.
scheme.addEventListener("change", () => {
  for (const plot of drawn) {
    plot.redraw(false);
    for (const [index, one] of plot.series.entries()) {
      const marker = index && plot.root.querySelectorAll(".u-series .u-marker")[index - 1];
      if (marker) marker.style.borderColor = one.stroke(plot, index);
    }
  }
});

export const line = (label, colour, dash) => ({
  label,
  stroke: () => COLOURS[colour][scheme.matches ? 1 : 0],
  width: 1.5,
  dash,
  points: { show: false },
  spanGaps: false,
});

const axis = (label) => ({ label, stroke: ink, grid: { stroke: faint, width: 1 }, ticks: { stroke: faint }, labelSize: 22, size: 52 });

// A line that is dashed is dashed in the legend too.
const LEGEND = { live: false, markers: { width: 3, dash: (plot, index) => (plot.series[index].dash ? "dashed" : "solid") } };

const widthOf = (element) => Math.max(element.clientWidth, 200);

function draw(element, options, data) {
  const plot = new uPlot({ ...options, width: widthOf(element) }, data, element);
  const watch = new ResizeObserver(() => plot.setSize({ width: widthOf(element), height: options.height }));
  watch.observe(element);
  drawn.add(plot);
  plot.hooks.destroy = [() => { watch.disconnect(); drawn.delete(plot); }];
  return plot;
}

// Paint beside the curves, in the colour of the text and within the axes; for a hook `draw`.
export const inked = (paint) => (plot) => {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.fillStyle = ctx.strokeStyle = ink();
  ctx.font = `${Math.round(12 * devicePixelRatio)}px system-ui`;
  ctx.textAlign = "left";
  paint(plot);
  ctx.restore();
};

// A word beside a line at x: to its left where there is no room to its right.
export function word({ ctx, bbox }, text, x) {
  const width = ctx.measureText(text).width + 8 * devicePixelRatio;
  const fits = x + width < bbox.left + bbox.width;
  ctx.fillText(text, fits ? x + 4 * devicePixelRatio : x - width + 4 * devicePixelRatio, bbox.top + 14 * devicePixelRatio);
}

// Lines over a common time.
export function overTime(element, series, unit, height, hooks = {}) {
  return timed(element, series, unit, height, hooks, { time: false }, axis("time [s]"));
}

// Points over days (seconds since 1970), from zero on; `beside` are further values that are to be within the axes.
export function overDays(element, series, unit, height, hooks = {}, beside = []) {
  const dotted = series.map((one) => ({ ...one, points: { show: true, size: 8 } }));
  const days = {
    ...axis("day of the records"),
    incrs: [1, 2, 7, 14, 28, 91, 182, 364].map((count) => count * DAY_S),
    values: (plot, times) => times.map((time) => new Date(time * 1000).toLocaleDateString(undefined, { day: "numeric", month: "short" })),
  };
  return timed(element, dotted, unit, height, hooks, { time: true }, days, [0, ...beside.filter((value) => value !== null)]);
}

function timed(element, series, unit, height, hooks, x, xAxis, within = []) {
  // Without a value there is an axis all the same, so that the plots stay below each other.
  const range = (plot, low, high) => (low === null ? [-1, 1] : uPlot.rangeNum(Math.min(low, ...within), Math.max(high, ...within), 0.1, true));
  return draw(element, {
    height,
    series: [{ label: "s" }, ...series],
    scales: { x, y: { range } },
    axes: [xAxis, axis(unit)],
    cursor: { drag: { x: false, y: false }, sync: { key: "time" } },
    legend: LEGEND,
    hooks,
  }, [[], ...series.map(() => [])]);
}

// Curves of one quantity over another, each with its own points: data is [[x, y], [x, y] ...].
// `least` is what is left around them at least, so that a rig at rest does not show its noise as a loop.
export function curves(element, series, xUnit, yUnit, height, least) {
  const path = (plot, index) => {
    const [xs, ys] = plot.data[index];
    const shape = new Path2D();
    let drawing = false;
    for (let i = 0; i < xs.length; i++) {
      if (xs[i] === null || ys[i] === null) { drawing = false; continue; }
      const x = plot.valToPos(xs[i], "x", true);
      const y = plot.valToPos(ys[i], "y", true);
      if (drawing) shape.lineTo(x, y); else shape.moveTo(x, y);
      drawing = true;
    }
    return { stroke: shape, fill: null, clip: null, flags: 1 };
  };
  const reach = (which) => (plot) => {
    let low = Infinity;
    let high = -Infinity;
    for (const pair of plot.data.slice(1)) {
      for (const value of pair[which]) if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
    }
    if (low > high) return [-10 * least[which], 10 * least[which]];
    const margin = Math.max((high - low) * 0.05, least[which]);
    return [low - margin, high + margin];
  };
  return draw(element, {
    mode: 2,
    height,
    series: [{}, ...series.map((one) => ({ ...one, facets: [{ scale: "x", auto: true }, { scale: "y", auto: true }], paths: path }))],
    scales: { x: { time: false, range: reach(0) }, y: { range: reach(1) } },
    axes: [axis(xUnit), axis(yUnit)],
    cursor: { show: false },
    legend: LEGEND,
  }, [[], ...series.map(() => [[], []])]);
}
