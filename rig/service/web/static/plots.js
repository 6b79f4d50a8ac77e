// Plots: uPlot with the page's colours. Lines differ by dash and name too, never by colour alone.

const dark = () => matchMedia("(prefers-color-scheme: dark)").matches;
const ink = () => (dark() ? "#edf0f2" : "#14171a");
const faint = () => (dark() ? "#3a4248" : "#d9dde1");
const COLOURS = [["#0068a5", "#6fc3ff"], ["#b04a00", "#ffab6b"], ["#00704f", "#53d8ae"], ["#7a2f8f", "#e0a0f0"]];

export const line = (label, colour, dash) => ({
  label,
  stroke: () => COLOURS[colour][dark() ? 1 : 0],
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
  plot.hooks.destroy = [() => watch.disconnect()];
  return plot;
}

// Lines over a common time.
export function overTime(element, series, unit, height, hooks = {}) {
  return timed(element, series, unit, height, hooks, { time: false }, axis("time [s]"));
}

// Points over calendar time (seconds since 1970), from zero on.
export function overDays(element, series, unit, height, hooks = {}) {
  const plot = timed(element, series.map((one) => ({ ...one, points: { show: true, size: 8 } })), unit, height, hooks, { time: true }, axis("day of the records"));
  return plot;
}

function timed(element, series, unit, height, hooks, x, xAxis) {
  return draw(element, {
    height,
    series: [{ label: "s" }, ...series],
    scales: { x },
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
