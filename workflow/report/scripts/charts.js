// What all charts share: axes, lines, words and marks, rows below each other, and a matrix as shades.

const FONT = "12px system-ui, sans-serif";
// Room at the right for the scale bar. It is the same in all charts, so that their time axes align.
const MARGIN = 30;
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

/** Return the largest of 1, 2, 5, 10 ... that does not exceed a positive number. */
function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * [5, 2, 1].find((digit) => digit * power <= most * 1.0000001);
}

/** Draw a chart with the axes, cursor and size that all charts share; `draw` draws over it. */
function makeChart(container, height, yLabel, { xLabel = "time (s)", yAxis, draw, ...options }, data) {
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
    hooks: draw ? { draw: [draw] } : {},
    series: [{}, line(themeColour("ink"), 1.75)],
    legend: { show: false },
    padding: [10, MARGIN, 0, 0],
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
function line(colour, width, dash = []) {
  return { stroke: colour, width, dash, points: { show: false } };
}

/** Draw over a chart in a colour of the theme. `draw` gets the context and the places of values, in pixels of the page. */
function drawOver(chart, colour, draw) {
  const { ctx } = chart;
  const [x, y] = ["x", "y"].map((axis) => (value) => chart.valToPos(value, axis, true) / devicePixelRatio);
  ctx.save();
  ctx.scale(devicePixelRatio, devicePixelRatio);
  ctx.strokeStyle = ctx.fillStyle = themeColour(colour);
  ctx.font = FONT;
  ctx.textAlign = "left";
  ctx.textBaseline = "top";
  draw(ctx, x, y);
  ctx.restore();
}

/** Draw a line on a chart between two points, given in the chart's values. */
function strokeLine(chart, from, to, { colour, width = 1, dash = [] }) {
  drawOver(chart, colour, (ctx, x, y) => {
    ctx.lineWidth = width;
    ctx.setLineDash(dash);
    ctx.stroke(new Path2D(`M${x(from[0])} ${y(from[1])}L${x(to[0])} ${y(to[1])}`));
  });
}

/** Draw a dotted line at a value across a chart. */
function strokeLevel(chart, value, colour) {
  const { min, max } = chart.scales.x;
  strokeLine(chart, [min, value], [max, value], { colour, dash: [2, 3] });
}

/** Write a text beside a vertical line at a value, on the side that has room. */
function writeBeside(chart, text, value, line, colour) {
  const { min, max } = chart.scales.x;
  if (value < min || value > max) return;
  drawOver(chart, colour, (ctx, x) => {
    const wide = ctx.measureText(text).width + 5;
    const at = [x(value) + wide <= x(max) ? x(value) + 5 : x(value) - wide, chart.bbox.top / devicePixelRatio + 2 + 15 * line];
    // A halo keeps the text legible over lines.
    ctx.strokeStyle = themeColour("paper");
    ctx.lineWidth = 4;
    ctx.strokeText(text, ...at);
    ctx.fillText(text, ...at);
  });
}

/** Draw a scale bar of a length at the right of a chart, upwards from a value. */
function drawScaleBar(chart, length, unit, above) {
  drawOver(chart, "ink", (ctx, x, y) => {
    const right = x(chart.scales.x.max) + 7;
    ctx.lineWidth = 2;
    ctx.stroke(new Path2D(`M${right} ${y(above)}V${y(above + length)}`));
    ctx.translate(right + 5, y(above));
    ctx.rotate(-Math.PI / 2);
    ctx.fillText(`${number(length)} ${unit}`, 0, 0);
  });
}

/**
 * Draw rows of values, one sensor below the other, with one scale for all and a scale bar.
 * `middles` are the values at the sensors' ticks. `across` draws over the chart: it gets the chart and the distance of the rows.
 */
function drawStacked(container, { time, rows, middles, unit, height, across = () => {}, ...options }) {
  const centred = rows.map((row, sensor) => row.map((value) => (value === null ? null : value - middles[sensor])));
  const distance = options.distance ?? (1.4 * highest(centred.map((row) => row.map(Math.abs))) || 1);
  const shifted = centred.map((row, sensor) => row.map((value) => (value === null ? null : value - sensor * distance)));
  const stacked = {
    ...options,
    scales: { ...options.scales, y: { range: [-(rows.length - 0.3) * distance, 0.8 * distance] } },
    yAxis: {
      splits: () => rows.map((_, sensor) => -sensor * distance),
      values: (_, splits) => splits.map((__, sensor) => String(sensor + 1)),
    },
    series: [{}, ...rows.map((_, sensor) => line(sensorLine(sensor).colour, 1.25))],
    draw: (chart) => {
      drawScaleBar(chart, roundLength(0.7 * distance), unit, -(rows.length - 1) * distance);
      across(chart, distance);
    },
  };
  return makeChart(container, height, "sensor", stacked, [time, ...shifted]);
}

/** Draw the matrix as shades into a box of left, top, width and height; heights between sensors are interpolated. */
function shade(context, matrix, box) {
  // A single sensor becomes a band.
  const rows = matrix.length > 1 ? matrix : [matrix[0], matrix[0]];
  const between = 24;
  const lines = Array.from({ length: (rows.length - 1) * between + 1 }, (_, at) => {
    const row = Math.min(Math.floor(at / between), rows.length - 2);
    const part = at / between - row;
    return rows[row].map((value, column) => (1 - part) * value + part * rows[row + 1][column]);
  });
  const [red, green, blue] = themeColour("shade").match(/\d+/g).map(Number);
  const most = highest(rows) || 1;
  const pixels = lines.flat().flatMap((value) => [red, green, blue, Math.round((235 * value) / most)]);
  const canvas = element("canvas", { width: rows[0].length, height: lines.length });
  canvas.getContext("2d").putImageData(new ImageData(Uint8ClampedArray.from(pixels), canvas.width), 0, 0);
  context.drawImage(canvas, ...box);
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
  const range = rows.length > 1 ? [1, rows.length] : [0.5, 1.5];
  const options = {
    scales: { y: { dir: -1, range } },
    yAxis: {
      splits: () => rows.map((_, sensor) => sensor + 1),
      values: (_, splits) => splits.map(String),
      grid: { show: false },
    },
    series: [{}, line("transparent", 1)],
    draw: (chart) => {
      const { ctx } = chart;
      const { left, top, width, height } = chart.bbox;
      const x = (sample) => chart.valToPos(sample * interval, "x", true);
      const y = (sensor) => chart.valToPos(1 + sensor, "y", true);
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
