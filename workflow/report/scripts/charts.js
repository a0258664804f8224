// Draw the charts of one recording: readings, envelopes, and the matrix with a particle over it.

const Charts = ((Signals, Palette, uPlot, ChartFrame) => {
  "use strict";

  const { atLeastTwoRows, contourSegments, highest, matrixOf, surfaceRows, unpack } = Signals;
  const { themeColour } = Palette;
  const { chartOptions, drawScaleBar, evenly, roundLength, sensorSeries, sensorsBelow } = ChartFrame;
  const CONTOURS = [0.25, 0.5, 0.75];

  /** Draw the matrix as shades. `x` and `y` convert a column and a row to canvas coordinates. */
  function shade(context, matrix, x, y) {
    const rows = atLeastTwoRows(matrix);
    const [red, green, blue] = themeColour("shade").split(",").map(Number);
    const between = 24;
    const columns = rows[0].length;
    const lines = (rows.length - 1) * between + 1;
    const most = highest(rows) || 1;
    const image = new ImageData(columns, lines);
    for (let line = 0; line < lines; line += 1) {
      const row = Math.min(Math.floor(line / between), rows.length - 2);
      const part = line / between - row;
      for (let column = 0; column < columns; column += 1) {
        const value = (1 - part) * rows[row][column] + part * rows[row + 1][column];
        image.data.set([red, green, blue, Math.round((235 * value) / most)], 4 * (line * columns + column));
      }
    }
    const canvas = document.createElement("canvas");
    canvas.width = columns;
    canvas.height = lines;
    canvas.getContext("2d").putImageData(image, 0, 0);
    context.drawImage(canvas, x(0), y(0), x(columns - 1) - x(0), y(rows.length - 1) - y(0));
  }

  /** Draw the contours of a particle at fractions of its height. */
  function strokeContours(context, particle, x, y) {
    const rows = atLeastTwoRows(particle);
    const most = highest(rows);
    if (most <= 0) return;
    context.beginPath();
    for (const part of CONTOURS) {
      for (const [x0, y0, x1, y1] of contourSegments(rows, part * most)) {
        context.moveTo(x(x0), y(y0));
        context.lineTo(x(x1), y(y1));
      }
    }
    // A halo of the page's colour keeps the lines visible on every shade.
    context.strokeStyle = themeColour("paper");
    context.lineWidth = 3.5 * devicePixelRatio;
    context.stroke();
    context.strokeStyle = themeColour("contour");
    context.lineWidth = 1.4 * devicePixelRatio;
    context.stroke();
  }

  /**
   * Draw rows of values, one sensor below the other, with one scale for all and a scale bar.
   * `middles` are the values at the sensors' ticks. `across` draws over the chart: it gets the chart and the distance of the rows.
   */
  function drawStacked(container, { time, rows, middles, unit, height, across = () => {} }) {
    const span = Math.max(
      ...rows.map((row, s) => row.reduce((most, v) => (v === null ? most : Math.max(most, Math.abs(v - middles[s]))), 0)),
    );
    const distance = 1.4 * span || 1;
    const shifted = rows.map((row, sensor) =>
      row.map((value) => (value === null ? null : value - middles[sensor] - sensor * distance)),
    );
    const bar = roundLength(0.7 * distance);
    const lowest = -(rows.length - 1) * distance;
    const options = chartOptions(container.clientWidth, height, "sensor", {
      scales: { y: { range: () => [-(rows.length - 0.3) * distance, 0.8 * distance] } },
      ...sensorsBelow(rows.length, distance),
      hooks: {
        draw: [
          (chart) => {
            drawScaleBar(chart, bar, unit, lowest);
            across(chart, distance);
          },
        ],
      },
    });
    return new uPlot(options, [time, ...shifted], container);
  }

  /** Draw the readings, each sensor about its median. */
  function drawReadings(container, evidence) {
    const rows = unpack(evidence.readings);
    const middles = rows.map((row) => {
      const known = row.filter((value) => value !== null).sort((a, b) => a - b);
      return known[Math.floor(known.length / 2)];
    });
    const time = evenly(rows[0].length, 0, evidence.interval_s);
    return drawStacked(container, { time, rows, middles, unit: evidence.unit, height: 230 });
  }

  /** Draw the envelopes and the threshold. */
  function drawEnvelopes(container, evidence) {
    const rows = unpack(evidence.envelope);
    const time = evenly(rows[0].length, 0, evidence.envelope.every * evidence.interval_s);
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

  /** Draw the matrix as shades, with a particle's contours over it. */
  function drawMatrix(container, evidence, particle) {
    const rows = matrixOf(evidence);
    const { every } = evidence.envelope;
    const laid = particle ? surfaceRows(particle, rows.length, rows[0].length, every) : null;
    const time = evenly(rows[0].length, 0, every * evidence.interval_s);
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
            shade(chart.ctx, rows, x, y);
            if (laid) strokeContours(chart.ctx, laid, x, y);
            chart.ctx.restore();
          },
        ],
      },
    });
    return new uPlot(options, [time, time.map(() => first)], container);
  }

  return { drawStacked, drawReadings, drawEnvelopes, drawMatrix };
})(Signals, Palette, uPlot, ChartFrame);
