// Draw a survey's readings around one moment, one sensor below the other.

const SurveySignals = ((uPlot, Signals, Palette, ChartFrame) => {
  "use strict";

  const { chartOptions, drawScaleBar, roundLength, sensorsBelow, strokeLine } = ChartFrame;
  const AROUND_S = 30;

  /** Return the span of values that 90 % of the pieces of one minute do not exceed. */
  function usualSpan(rows, perMinute) {
    const spans = [];
    for (const row of rows) {
      for (let from = 0; from + perMinute <= row.length; from += perMinute) {
        const known = row.slice(from, from + perMinute).filter((value) => value !== null);
        if (known.length) spans.push(Math.max(...known) - Math.min(...known));
      }
    }
    spans.sort((a, b) => a - b);
    return spans[Math.floor(0.9 * spans.length)] || 1;
  }

  /** Set up a chart. Return functions to move it to a time and to draw it again. */
  function setUp(container, signals, startTime) {
    const rows = signals.rows.map((packed) => Signals.unpack(packed)[0]);
    const distance = 1.1 * usualSpan(rows, Math.max(Math.round((2 * AROUND_S) / signals.every_s), 1));
    let now = startTime;

    const about = (time) => {
      const first = Math.max(Math.floor((time - AROUND_S - signals.from_s) / signals.every_s), 0);
      const after = Math.max(Math.ceil((time + AROUND_S - signals.from_s) / signals.every_s) + 1, first + 2);
      const times = Array.from({ length: after - first }, (_, at) => signals.from_s + (first + at) * signals.every_s);
      const shifted = rows.map((row, sensor) => {
        const piece = Array.from({ length: after - first }, (_, at) => row[first + at] ?? null);
        const known = piece.filter((value) => value !== null);
        const mean = known.reduce((sum, value) => sum + value, 0) / Math.max(known.length, 1);
        return piece.map((value) => (value === null ? null : value - mean - sensor * distance));
      });
      return [times, ...shifted];
    };

    const make = () => {
      const lowest = -(rows.length - 0.4) * distance;
      const options = chartOptions(container.clientWidth, 200, "sensor", {
        cursor: { show: false },
        scales: {
          x: { time: false, range: () => [now - AROUND_S, now + AROUND_S] },
          y: { range: () => [lowest, 0.6 * distance] },
        },
        ...sensorsBelow(rows.length, distance),
        hooks: {
          draw: [
            (chart) => {
              drawScaleBar(chart, roundLength(0.7 * distance), "counts", -(rows.length - 1) * distance);
              strokeLine(chart, [now, lowest], [now, 0.6 * distance], { colour: Palette.themeColour("ink"), dash: [2, 2] });
            },
          ],
        },
      });
      return new uPlot(options, about(now), container);
    };

    let chart = make();
    return {
      moveTo(time) {
        now = time;
        chart.setData(about(time));
      },
      redraw() {
        chart.destroy();
        chart = make();
      },
    };
  }

  return { setUp };
})(uPlot, Signals, Palette, ChartFrame);
