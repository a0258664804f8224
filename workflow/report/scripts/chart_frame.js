// Shared parts of all charts: axes, time, scale bar, lines.

const ChartFrame = ((uPlot, Palette, Elements) => {
  "use strict";

  const { number } = Elements;
  const { sensorLine, themeColour } = Palette;
  const FONT = "12px system-ui, sans-serif";
  // Room at the right for the scale bar. It is the same in all charts, so that their time axes align.
  const MARGIN = 30;

  /** Draw a chart with the axes, cursor and size that all charts share; `draw` draws over it. */
  function makeChart(container, height, yLabel, { xLabel = "time (s)", yAxis, draw, ...options }, data) {
    const axis = {
      stroke: themeColour("soft"),
      grid: { stroke: themeColour("rule"), width: 1 },
      ticks: { stroke: themeColour("rule"), width: 1 },
      font: FONT,
      labelFont: FONT,
      values: (_, splits) => splits.map((value) => (value === null ? "" : number(value))),
    };
    const made = {
      width: container.clientWidth,
      height,
      hooks: draw ? { draw: [draw] } : {},
      legend: { show: false },
      padding: [10, MARGIN, 0, 0],
      cursor: { sync: { key: xLabel }, points: { show: false }, y: false, drag: { x: true, y: false } },
      ...options,
      scales: { x: { time: false }, ...options.scales },
      axes: [
        { ...axis, label: xLabel, labelSize: 20, size: 34 },
        { ...axis, label: yLabel, labelSize: 20, size: 52, ...yAxis },
      ],
    };
    return new uPlot(made, data, container);
  }

  /** Return a line without marks at its points. */
  function line(colour, width, dash = []) {
    return { stroke: colour, width, dash, points: { show: false } };
  }

  function sensorLines(count) {
    return Array.from({ length: count }, (_, sensor) => line(sensorLine(sensor).colour, 1.25, sensorLine(sensor).dash));
  }

  /** Return the axis and the lines of sensors that are drawn below each other at a distance. */
  function sensorsBelow(count, distance) {
    return {
      yAxis: {
        splits: () => Array.from({ length: count }, (_, sensor) => -sensor * distance),
        values: (_, splits) => splits.map((__, sensor) => String(sensor + 1)),
      },
      series: [{}, ...sensorLines(count).map((series) => ({ ...series, dash: [] }))],
    };
  }

  function evenly(count, first, step) {
    return Array.from({ length: count }, (_, index) => first + index * step);
  }

  /** Extend times and rows so that a chart begins and ends with the recording. */
  function overWholeRun(time, rows, duration) {
    return [
      [Math.min(0, time[0]), ...time, Math.max(duration, time[time.length - 1])],
      ...rows.map((row) => [null, ...row, null]),
    ];
  }

  /** Return the largest of 1, 2, 5, 10 ... that does not exceed a positive number. */
  function roundLength(most) {
    const power = 10 ** Math.floor(Math.log10(most));
    return power * [5, 2, 1].find((digit) => digit * power <= most * 1.0000001);
  }

  /** Draw a line on a chart between two points, given in the chart's values. */
  function strokeLine(chart, from, to, { colour, width = 1, dash = [] }) {
    const { ctx } = chart;
    const [start, end] = [from, to].map(([x, y]) => `${chart.valToPos(x, "x", true)} ${chart.valToPos(y, "y", true)}`);
    ctx.save();
    ctx.strokeStyle = themeColour(colour);
    ctx.lineWidth = width * devicePixelRatio;
    ctx.setLineDash(dash.map((part) => part * devicePixelRatio));
    ctx.stroke(new Path2D(`M${start}L${end}`));
    ctx.restore();
  }

  /** Draw a dotted line at a value across a chart. */
  function strokeLevel(chart, value, colour) {
    const { min, max } = chart.scales.x;
    strokeLine(chart, [min, value], [max, value], { colour, dash: [2, 3] });
  }

  /** Write a text beside a vertical line at `x`, on the side that has room. */
  function writeBeside(chart, text, x, line, colour) {
    const { ctx, bbox } = chart;
    const left = chart.valToPos(x, "x", true);
    if (left < bbox.left || left > bbox.left + bbox.width) return;
    ctx.save();
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.fillStyle = themeColour(colour);
    ctx.textBaseline = "top";
    const gap = 5 * devicePixelRatio;
    const fits = left + gap + ctx.measureText(text).width <= bbox.left + bbox.width;
    ctx.textAlign = fits ? "left" : "right";
    const top = bbox.top + (2 + 15 * line) * devicePixelRatio;
    // A halo keeps the text legible over lines.
    ctx.strokeStyle = themeColour("paper");
    ctx.lineWidth = 4 * devicePixelRatio;
    ctx.strokeText(text, fits ? left + gap : left - gap, top);
    ctx.fillText(text, fits ? left + gap : left - gap, top);
    ctx.restore();
  }

  /** Draw a scale bar of a length at the right of a chart, upwards from a value. */
  function drawScaleBar(chart, length, unit, above) {
    const { ctx, bbox } = chart;
    const x = bbox.left + bbox.width + 7 * devicePixelRatio;
    const [bottom, top] = [above, above + length].map((value) => chart.valToPos(value, "y", true));
    ctx.save();
    ctx.strokeStyle = themeColour("ink");
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.stroke(new Path2D(`M${x} ${bottom}V${top}`));
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.fillStyle = themeColour("ink");
    ctx.textAlign = "left";
    ctx.textBaseline = "top";
    ctx.translate(x + 5 * devicePixelRatio, bottom);
    ctx.rotate(-Math.PI / 2);
    ctx.fillText(`${number(length)} ${unit}`, 0, 0);
    ctx.restore();
  }

  return { makeChart, line, sensorLines, sensorsBelow, evenly, overWholeRun, roundLength, strokeLine, strokeLevel, writeBeside, drawScaleBar };
})(uPlot, Palette, Elements);
