// Draw a score on an axis, with the threshold and the scores of the archive by true size.

const ScoreChart = ((uPlot, Palette, ChartFrame, Elements) => {
  "use strict";

  const { themeColour } = Palette;
  const { chartOptions, strokeLine, writeBeside } = ChartFrame;
  const { sizeWords } = Elements;

  /** Draw a verdict's score among the marks of the archive. */
  function draw(container, verdict, marks) {
    const rows = marks.length ? marks : [{ size_mm: null, scores: [] }];
    const every = [...rows.flatMap((row) => row.scores), verdict.score, verdict.threshold];
    const known = every.filter((value) => value !== null);
    const [least, most] = [Math.min(...known), Math.max(...known)];
    const room = 0.06 * (most - least) || 1;
    const last = rows.length - 1;
    const options = chartOptions(container.clientWidth, 92 + 21 * rows.length, "", {
      xLabel: "score",
      cursor: { show: false },
      scales: {
        x: { time: false, range: () => [least - room, most + room] },
        y: { dir: -1, range: () => [-2.1, last + 0.6] },
      },
      yAxis: {
        splits: () => rows.map((_, row) => row),
        values: () => rows.map((row) => (row.size_mm === null ? "" : sizeWords(row.size_mm))),
        grid: { show: false },
        label: null,
        size: 78,
      },
      series: [{}, { stroke: "transparent", points: { show: false } }],
      hooks: {
        draw: [
          (chart) => {
            const tick = { colour: themeColour("soft"), width: 1.5 };
            rows.forEach(({ scores }, row) =>
              scores.forEach((score) => strokeLine(chart, [score, row - 0.32], [score, row + 0.32], tick)),
            );
            if (verdict.threshold !== null) {
              const line = { colour: themeColour("ink"), width: 1.5, dash: [2, 3] };
              strokeLine(chart, [verdict.threshold, -2.1], [verdict.threshold, last + 0.6], line);
              writeBeside(chart, "threshold", verdict.threshold, 1, themeColour("ink"));
            }
            const own = { colour: themeColour("accent"), width: 2.5 };
            strokeLine(chart, [verdict.score, -2.1], [verdict.score, last + 0.6], own);
            writeBeside(chart, "this recording", verdict.score, 0, themeColour("accent"));
          },
        ],
      },
    });
    return new uPlot(options, [[least, most], [0, 0]], container);
  }

  return { draw };
})(uPlot, Palette, ChartFrame, Elements);
