// Draw the charts of one recording: readings, envelopes, and the matrix with a particle over it.

const Charts = ((Signals, Palette, Elements, ChartFrame) => {
  "use strict";

  const { highest, matrixOf, unpack } = Signals;
  const { themeColour } = Palette;
  const { makeChart, drawScaleBar, evenly, line, roundLength, sensorLines, sensorsBelow } = ChartFrame;
  // Parts of its height at which a particle has contours.
  const CONTOURS = [0.25, 0.5, 0.75];

  /** Draw the matrix as shades into a box of left, top, width and height; heights between sensors are interpolated. */
  function shade(context, matrix, box) {
    // A single sensor becomes a band.
    const rows = matrix.length > 1 ? matrix : [matrix[0], matrix[0]];
    const [red, green, blue] = themeColour("shade").match(/\d+/g).map(Number);
    const between = 24;
    const columns = rows[0].length;
    const lines = (rows.length - 1) * between + 1;
    const most = highest(rows) || 1;
    const image = new ImageData(columns, lines);
    for (let at = 0; at < lines; at += 1) {
      const row = Math.min(Math.floor(at / between), rows.length - 2);
      const part = at / between - row;
      for (let column = 0; column < columns; column += 1) {
        const value = (1 - part) * rows[row][column] + part * rows[row + 1][column];
        image.data.set([red, green, blue, Math.round((235 * value) / most)], 4 * (at * columns + column));
      }
    }
    const canvas = Object.assign(Elements.element("canvas"), { width: columns, height: lines });
    canvas.getContext("2d").putImageData(image, 0, 0);
    context.drawImage(canvas, ...box);
  }

  /** Draw the contours of a particle (eq. G) at parts of its height: each surface's is an ellipse, and inner arcs are left out. */
  function strokeContours(context, { amplitude, vertical, peak, horizontal }, x, y) {
    const { width, height } = context.canvas;
    const layer = Object.assign(Elements.element("canvas"), { width, height }).getContext("2d");
    for (const level of CONTOURS.map((part) => part * Math.max(...amplitude))) {
      const ellipses = new Path2D();
      amplitude.forEach((top, s) => {
        if (top <= level) return;
        const reach = Math.sqrt(2 * Math.log(top / level));
        const ellipse = new Path2D();
        ellipse.ellipse(x(peak[s]), y(s), reach * horizontal[s] * (x(1) - x(0)), reach * vertical[s] * (y(1) - y(0)), 0, 0, 2 * Math.PI);
        ellipses.addPath(ellipse);
      });
      // A halo of the page's colour keeps the lines visible on every shade.
      for (const [colour, wide] of [["paper", 2.5], ["ink", 1.4]]) {
        layer.clearRect(0, 0, width, height);
        layer.strokeStyle = themeColour(colour);
        layer.lineWidth = 2 * wide * devicePixelRatio;
        layer.globalCompositeOperation = "source-over";
        layer.stroke(ellipses);
        layer.globalCompositeOperation = "destination-out";
        layer.fill(ellipses);
        context.drawImage(layer.canvas, 0, 0);
      }
    }
  }

  /**
   * Draw rows of values, one sensor below the other, with one scale for all and a scale bar.
   * `middles` are the values at the sensors' ticks. `across` draws over the chart: it gets the chart and the distance of the rows.
   */
  function drawStacked(container, { time, rows, middles, unit, height, across = () => {} }) {
    const centred = rows.map((row, sensor) => row.map((value) => (value === null ? null : value - middles[sensor])));
    const distance = 1.4 * highest(centred.map((row) => row.map(Math.abs))) || 1;
    const shifted = centred.map((row, sensor) => row.map((value) => (value === null ? null : value - sensor * distance)));
    const lowest = -(rows.length - 1) * distance;
    const options = {
      scales: { y: { range: () => [-(rows.length - 0.3) * distance, 0.8 * distance] } },
      ...sensorsBelow(rows.length, distance),
      draw: (chart) => {
        drawScaleBar(chart, roundLength(0.7 * distance), unit, lowest);
        across(chart, distance);
      },
    };
    return makeChart(container, height, "sensor", options, [time, ...shifted]);
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
    const top = 1.05 * Math.max(highest(rows), evidence.threshold);
    const options = {
      scales: { y: { range: () => [0, top] } },
      series: [{}, ...sensorLines(rows.length), line(themeColour("ink"), 1, [1, 3])],
    };
    return makeChart(container, 200, "envelope (SD)", options, [time, ...rows, time.map(() => evidence.threshold)]);
  }

  /** Draw the matrix as shades, with a particle's contours over it. */
  function drawMatrix(container, evidence, particle) {
    const rows = matrixOf(evidence);
    const { interval_s: interval, envelope } = evidence;
    const time = evenly(rows[0].length, 0, envelope.every * interval);
    const [first, last] = rows.length > 1 ? [1, rows.length] : [0.5, 1.5];
    const options = {
      scales: { y: { dir: -1, range: () => [first, last] } },
      yAxis: {
        splits: () => rows.map((_, sensor) => sensor + 1),
        values: (_, splits) => splits.map(String),
        grid: { show: false },
      },
      series: [{}, line("transparent", 1)],
      draw: (chart) => {
        const { left, top, width, height } = chart.bbox;
        const x = (sample) => chart.valToPos(sample * interval, "x", true);
        const y = (sensor) => chart.valToPos(1 + sensor, "y", true);
        const box = (from, to) => {
          chart.ctx.beginPath();
          chart.ctx.rect(from, top, to - from, height);
          chart.ctx.clip();
        };
        chart.ctx.save();
        box(left, left + width);
        const end = x((rows[0].length - 1) * envelope.every);
        shade(chart.ctx, rows, [x(0), top, end - x(0), height]);
        if (particle) {
          box(x(particle.from), x(particle.to));
          strokeContours(chart.ctx, particle, x, y);
        }
        chart.ctx.restore();
      },
    };
    return makeChart(container, 190, "sensor", options, [time, time.map(() => first)]);
  }

  return { drawStacked, drawReadings, drawEnvelopes, drawMatrix };
})(Signals, Palette, Elements, ChartFrame);
