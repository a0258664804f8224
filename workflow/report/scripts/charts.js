// The charts of one recording: readings, envelopes, matrix with the fitted particle.

const Charts = ((uPlot, Signals, Palette, Matrix) => {
  "use strict";

  const { highest, unpack } = Signals;
  const { sensorLine, themeColour } = Palette;

  /** Axes, cursor and size that all charts share. */
  function chartOptions(width, height, yLabel, options) {
    const axis = {
      stroke: themeColour("soft"),
      grid: { stroke: themeColour("rule"), width: 1 },
      ticks: { stroke: themeColour("rule"), width: 1 },
      font: "12px system-ui, sans-serif",
      labelFont: "12px system-ui, sans-serif",
    };
    return {
      width,
      height,
      legend: { show: false },
      cursor: { sync: { key: "recording" }, points: { show: false }, y: false, drag: { x: true, y: false } },
      ...options,
      scales: { x: { time: false }, ...options.scales },
      axes: [
        { ...axis, label: "time (s)", labelSize: 20, size: 34 },
        { ...axis, label: yLabel, labelSize: 20, size: 52, ...options.yAxis },
      ],
    };
  }

  function sensorSeries(count) {
    return Array.from({ length: count }, (_, sensor) => {
      const { colour, dash } = sensorLine(sensor);
      return { label: `sensor ${sensor + 1}`, stroke: colour, dash, width: 1.25 };
    });
  }

  function times(count, step, interval) {
    return Array.from({ length: count }, (_, index) => index * step * interval);
  }

  /** Draw the readings, one sensor below the other, all to one scale. */
  function drawReadings(container, evidence) {
    const rows = unpack(evidence.readings);
    const known = rows.map((row) => row.filter((value) => value !== null).sort((a, b) => a - b));
    const middle = known.map((row) => row[Math.floor(row.length / 2)]);
    const span = Math.max(...known.map((row, s) => Math.max(row[row.length - 1] - middle[s], middle[s] - row[0])));
    const distance = 1.4 * span || 1;
    const shifted = rows.map((row, sensor) =>
      row.map((value) => (value === null ? null : value - middle[sensor] - sensor * distance)),
    );
    const options = chartOptions(container.clientWidth, 220, "sensor", {
      scales: { y: { range: () => [-(rows.length - 0.3) * distance, 0.7 * distance] } },
      yAxis: {
        splits: () => rows.map((_, sensor) => -sensor * distance),
        values: (_, splits) => splits.map((__, sensor) => String(sensor + 1)),
      },
      series: [{}, ...sensorSeries(rows.length).map((series) => ({ ...series, dash: [], width: 1 }))],
    });
    const time = times(rows[0].length, evidence.readings.every, evidence.interval_s);
    return new uPlot(options, [time, ...shifted], container);
  }

  /** Draw the envelopes and the threshold. */
  function drawEnvelopes(container, evidence) {
    const rows = unpack(evidence.envelope);
    const time = times(rows[0].length, evidence.envelope.every, evidence.interval_s);
    const threshold = time.map(() => evidence.threshold);
    const top = 1.05 * Math.max(highest(rows), evidence.threshold);
    const options = chartOptions(container.clientWidth, 200, "envelope (SD)", {
      scales: { y: { range: () => [0, top] } },
      series: [
        {},
        ...sensorSeries(rows.length),
        { label: "threshold", stroke: themeColour("ink"), width: 1, dash: [1, 3] },
      ],
    });
    return new uPlot(options, [time, ...rows, threshold], container);
  }

  /** Draw the matrix as shades, and the fitted particle's contours over it. */
  function drawMatrix(container, evidence) {
    const rows = unpack(evidence.matrix);
    const fitted = evidence.fitted ? unpack(evidence.fitted) : null;
    const time = times(rows[0].length, evidence.matrix.every, evidence.interval_s);
    const sensors = rows.length;
    const [first, last] = sensors > 1 ? [1, sensors] : [0.5, 1.5];
    const options = chartOptions(container.clientWidth, 190, "sensor", {
      scales: { y: { dir: -1, range: () => [first, last] } },
      yAxis: {
        splits: () => rows.map((_, sensor) => sensor + 1),
        values: (_, splits) => splits.map(String),
        grid: { show: false },
      },
      series: [{}, { label: "matrix", show: true, stroke: "transparent", points: { show: false } }],
      hooks: {
        draw: [
          (chart) => {
            const step = time.length > 1 ? time[1] - time[0] : 1;
            const x = (column) => chart.valToPos(time[0] + column * step, "x", true);
            const y = (row) => chart.valToPos(first + row, "y", true);
            const { left, top, width: wide, height: high } = chart.bbox;
            chart.ctx.save();
            chart.ctx.beginPath();
            chart.ctx.rect(left, top, wide, high);
            chart.ctx.clip();
            Matrix.shade(chart.ctx, rows, x, y);
            if (fitted) Matrix.strokeContours(chart.ctx, fitted, x, y);
            chart.ctx.restore();
          },
        ],
      },
    });
    return new uPlot(options, [time, time.map(() => first)], container);
  }

  return { drawReadings, drawEnvelopes, drawMatrix };
})(uPlot, Signals, Palette, Matrix);
