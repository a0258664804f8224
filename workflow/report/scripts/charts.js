// What all charts share: axes, lines and marks, rows below each other, and a matrix as shades.

const FONT = "12px system-ui, sans-serif";
// Parts of its height at which a particle has contours.
const CONTOURS = [0.25, 0.5, 0.75];

/** Return the rows of values of packed numbers; a missing sample is null. */
function unpack(packed) {
  return packed.rows.map((row) => {
    let sum = 0;
    return row.map((difference) => {
      if (difference === null) return null;
      sum += difference;
      return packed.low + packed.scale * sum;
    });
  });
}

/** Return the recording's matrix: by how much the envelope exceeds the threshold (eq. ReLU). */
function matrixOf({ envelope, threshold }) {
  return unpack(envelope).map((row) => row.map((value) => Math.max((value ?? 0) - threshold, 0)));
}

/** Return the largest value of some rows, or 0 if there is none. */
function highest(rows) {
  return rows.reduce((sofar, row) => row.reduce((most, value) => Math.max(most, value), sofar), 0);
}

function evenly(count, first, step) {
  return Array.from({ length: count }, (_, index) => first + index * step);
}

/** Draw a chart with the axes, cursor and size that all charts share. Over it are what `draw` draws, and marks. */
function makeChart(container, height, yLabel, { xLabel = "time (s)", yAxis, draw = () => {}, marks = [], ...options }, data) {
  const axis = {
    stroke: themeColour("soft"),
    grid: { stroke: themeColour("rule"), width: 1 },
    ticks: { stroke: themeColour("rule"), width: 1 },
    font: FONT,
    labelFont: FONT,
    labelSize: 20,
    values: (_, splits) => splits.map((value) => (value === null ? "" : number(value))),
  };
  const made = {
    width: container.clientWidth,
    height,
    hooks: { draw: [draw, (chart) => marks.forEach((mark) => drawMark(chart, mark))] },
    series: [{}, line(themeColour("ink"), 1.75)],
    legend: { show: false },
    padding: [10, 12, 0, 0],
    cursor: { sync: { key: xLabel }, points: { show: false }, y: false, drag: { x: true, y: false } },
    ...options,
    scales: { ...options.scales, x: { time: false, ...options.scales?.x } },
    axes: [
      { ...axis, label: xLabel, size: 34 },
      { ...axis, label: yLabel, size: 52, ...yAxis },
    ],
  };
  return new uPlot(made, data, container);
}

/** Return a line without marks at its points. */
function line(colour, width) {
  return { stroke: colour, width, points: { show: false } };
}

/**
 * Draw a mark over a chart: a line, and a text at its right, or at its left where there is no room. `x` and `y` are values of the
 * chart, or the two ends of the line; without them it crosses the chart, and with null it is not drawn. Texts are in rows from the top.
 */
function drawMark(chart, { x, y, text = "", row = 0, colour = "accent", width = 2.5, dash = [] }) {
  const pixels = (axis, ends) => {
    const { min, max } = chart.scales[axis];
    return [ends ?? [min, max]].flat().map((value) => chart.valToPos(value, axis, true) / devicePixelRatio);
  };
  const [first, last] = pixels("x");
  const [left, right = left] = pixels("x", x);
  const [low, high = low] = pixels("y", y);
  if (x === null || y === null || left > last || right < first) return;
  const { ctx } = chart;
  ctx.save();
  ctx.scale(devicePixelRatio, devicePixelRatio);
  ctx.strokeStyle = ctx.fillStyle = themeColour(colour);
  ctx.lineWidth = width;
  ctx.setLineDash(dash);
  ctx.stroke(new Path2D(`M${left} ${low}L${right} ${high}`));
  ctx.font = FONT;
  ctx.textAlign = "left";
  ctx.textBaseline = "top";
  const wide = ctx.measureText(text).width + 5;
  const at = [left + wide <= last ? left + 5 : left - wide, chart.bbox.top / devicePixelRatio + 2 + 15 * row];
  // A halo keeps the text legible over lines.
  ctx.strokeStyle = themeColour("paper");
  ctx.lineWidth = 4;
  ctx.setLineDash([]);
  ctx.strokeText(text, ...at);
  ctx.fillText(text, ...at);
  ctx.restore();
}

/** Return the axis of rows of sensors: sensor s is at -s, and its number begins with 1. */
function sensorAxis(rows) {
  return { splits: () => rows.map((_, sensor) => -sensor), values: (_, splits) => splits.map((at) => String(1 - at)) };
}

/**
 * Draw rows of values, one sensor below the other, each about its mean or about `middle`, all with one scale: rows are `distance` apart.
 * A dotted line crosses each row at `level`. Heights of marks count rows; that of sensor s is at -s.
 */
function drawStacked(container, { time, rows, unit, height, middle, level = null, distance, marks = [], ...options }) {
  const centred = rows.map((row) => {
    const known = row.filter((value) => value !== null);
    const about = middle ?? known.reduce((sum, value) => sum + value, 0) / Math.max(known.length, 1);
    return row.map((value) => (value === null ? null : value - about));
  });
  const apart = distance ?? (1.4 * highest(centred.map((row) => row.map(Math.abs))) || 1);
  const levels = rows.map((_, sensor) => (level === null ? null : (level - middle) / apart - sensor));
  const shifted = centred.map((row, sensor) => row.map((value) => (value === null ? null : value / apart - sensor)));
  // A press deeper than the distance, as of a nodule, stays in the picture.
  const range = shifted.flat().reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [0.3 - rows.length, 0.8]);
  const stacked = {
    ...options,
    scales: { ...options.scales, y: { range } },
    yAxis: sensorAxis(rows),
    series: [{}, ...rows.map((_, sensor) => line(sensorColour(sensor), 1.25))],
    marks: [...levels.map((y) => ({ y, colour: "soft", width: 1, dash: [2, 3] })), ...marks],
  };
  return makeChart(container, height, `sensor (${significant(apart)} ${unit} apart)`, stacked, [time, ...shifted]);
}

/** Draw the matrix as shades into a box of left, top, width and height. */
function shade(context, matrix, box) {
  // A single sensor becomes a band.
  const rows = matrix.length > 1 ? matrix : [matrix[0], matrix[0]];
  const [red, green, blue] = themeColour("accent").match(/\d+/g).map(Number);
  const most = highest(rows) || 1;
  const pixels = rows.flat().flatMap((value) => [red, green, blue, Math.round((235 * value) / most)]);
  const canvas = element("canvas", { width: rows[0].length, height: rows.length });
  canvas.getContext("2d").putImageData(new ImageData(Uint8ClampedArray.from(pixels), canvas.width), 0, 0);
  // From the middle of the first row to that of the last: between sensors, the browser interpolates.
  context.drawImage(canvas, 0, 0.5, canvas.width, rows.length - 1, ...box);
}

/** Draw the contours of a particle (eq. G) at parts of its height: each surface's is an ellipse, and inner arcs are left out. */
function strokeContours(context, { amplitude, vertical, peak, horizontal }, x, y) {
  const { width, height } = context.canvas;
  const layer = element("canvas", { width, height }).getContext("2d");
  for (const level of CONTOURS.map((part) => part * Math.max(...amplitude))) {
    const ellipses = new Path2D();
    amplitude.forEach((top, s) => {
      if (top <= level) return;
      const reach = Math.sqrt(2 * Math.log(top / level));
      const radii = [reach * horizontal[s] * (x(1) - x(0)), reach * vertical[s] * (y(1) - y(0))];
      const ellipse = new Path2D();
      ellipse.ellipse(x(peak[s]), y(s), ...radii, 0, 0, 2 * Math.PI);
      ellipses.addPath(ellipse);
    });
    // A halo of the page's colour keeps the lines visible on every shade.
    for (const [colour, wide] of [["paper", 5], ["ink", 2.8]]) {
      layer.strokeStyle = themeColour(colour);
      layer.lineWidth = wide * devicePixelRatio;
      layer.stroke(ellipses);
    }
    // Higher levels lie within lower ones, so only inner halves and arcs of lines are cleared.
    layer.globalCompositeOperation = "destination-out";
    layer.fill(ellipses);
    layer.globalCompositeOperation = "source-over";
  }
  context.drawImage(layer.canvas, 0, 0);
}

/** Draw the matrix as shades, with a particle's contours over it. */
function drawMatrix(container, evidence, particle) {
  const rows = matrixOf(evidence);
  const { interval_s: interval, envelope } = evidence;
  const time = evenly(rows[0].length, 0, envelope.every * interval);
  const range = rows.length > 1 ? [1 - rows.length, 0] : [-0.5, 0.5];
  const options = {
    scales: { y: { range } },
    yAxis: { ...sensorAxis(rows), grid: { show: false } },
    series: [{}, line("transparent", 1)],
    draw: (chart) => {
      const { ctx } = chart;
      const { left, top, width, height } = chart.bbox;
      const x = (sample) => chart.valToPos(sample * interval, "x", true);
      const y = (sensor) => chart.valToPos(-sensor, "y", true);
      const clip = (from, to) => {
        ctx.beginPath();
        ctx.rect(from, top, to - from, height);
        ctx.clip();
      };
      ctx.save();
      clip(left, left + width);
      const end = x((rows[0].length - 1) * envelope.every);
      shade(ctx, rows, [x(0), top, end - x(0), height]);
      if (particle) {
        clip(x(particle.from), x(particle.to));
        strokeContours(ctx, particle, x, y);
      }
      ctx.restore();
    },
  };
  return makeChart(container, 190, "sensor", options, [time, time.map(() => range[0])]);
}
