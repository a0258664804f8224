// Draw the evidence of a detector: beats, the score along the gut, and the part of each stretch.

const EvidenceCharts = ((uPlot, Signals, Palette, Charts, ChartFrame, Elements) => {
  "use strict";

  const { unpack } = Signals;
  const { themeColour } = Palette;
  const { number } = Elements;
  const { chartOptions, evenly, overWholeRun, strokeLine, writeBeside } = ChartFrame;

  function duration(evidence) {
    const { data, bits, rows } = evidence.readings;
    const count = atob(data).length / (bits / 8) / rows;
    return (count - 1) * evidence.interval_s;
  }

  /** Draw the depth of each sensor's beats, its usual depth, and the time at which it passes the place. */
  function drawBeats(container, evidence, passing) {
    const { beats } = evidence;
    const rows = unpack(beats);
    const time = evenly(rows[0].length, beats.first_s, beats.step_s);
    const [whole, ...longer] = overWholeRun(time, rows, duration(evidence));
    const across = (chart, distance) =>
      rows.forEach((_, sensor) => {
        const y = -sensor * distance;
        const usual = { colour: themeColour("soft"), dash: [2, 3] };
        strokeLine(chart, [whole[0], y], [whole[whole.length - 1], y], usual);
        const at = beats.passed_s[sensor];
        const mark = { colour: themeColour("accent"), width: 2.5 };
        if (passing && at !== null) strokeLine(chart, [at, y - 0.15 * distance], [at, y + 0.75 * distance], mark);
      });
    const middles = rows.map(() => 1);
    return Charts.drawStacked(container, {
      time: whole,
      rows: longer,
      middles,
      unit: "× usual",
      height: 250,
      across,
    });
  }

  /** Draw the score along the gut, the threshold, the place with the highest score, and the true place. */
  function drawGut(container, evidence, verdict) {
    const [scores] = unpack(evidence.gut);
    const places = evenly(scores.length, 0, evidence.gut.step_mm);
    const { threshold } = verdict;
    const levels = [...scores, ...(threshold === null ? [] : [threshold])];
    const [least, most] = [Math.min(...levels, 0), Math.max(...levels)];
    // Leave room for two lines of text above.
    const range = [least - 0.05 * (most - least), most + 0.35 * (most - least)];
    const best = places[scores.indexOf(Math.max(...scores))];
    const truth = evidence.nodule_at_mm;
    const farthest = Math.max(places[places.length - 1], truth ?? 0) || 1;
    const options = chartOptions(container.clientWidth, 220, "score", {
      xLabel: "way of sensor 1 from the start (mm)",
      scales: { x: { time: false, range: (_, from, to) => (from === to ? [0, farthest] : [from, to]) }, y: { range: () => range } },
      series: [{}, { label: "score", stroke: themeColour("ink"), width: 1.75 }],
      hooks: {
        draw: [
          (chart) => {
            const { min, max } = chart.scales.x;
            if (threshold !== null) {
              strokeLine(chart, [min, threshold], [max, threshold], { colour: themeColour("ink"), dash: [2, 3] });
            }
            const found = { colour: themeColour("accent"), width: 2.5 };
            strokeLine(chart, [best, range[0]], [best, Math.max(...scores)], found);
            const words = verdict.predicted_mm ? "found" : "highest";
            writeBeside(chart, `${words} ${number(best, 1)} mm`, best, 0, themeColour("accent"));
            if (truth !== null) {
              strokeLine(chart, [truth, range[0]], [truth, most], { colour: themeColour("good-rule"), width: 2.5, dash: [7, 4] });
              writeBeside(chart, `true ${number(truth, 1)} mm`, truth, 1, themeColour("ink"));
            }
          },
        ],
      },
    });
    const beyond = farthest > places[places.length - 1];
    const x = beyond ? [...places, farthest] : places;
    return new uPlot(options, [x, beyond ? [...scores, null] : scores], container);
  }

  /** Draw the loss of score without each stretch. */
  function drawStretches(container, evidence) {
    const { stretches } = evidence;
    const [loss] = unpack(stretches);
    const time = evenly(loss.length, stretches.first_s, stretches.step_s);
    const [whole, longer] = overWholeRun(time, [loss], duration(evidence));
    const [least, most] = [Math.min(0, ...loss), Math.max(0, ...loss)];
    const room = 0.1 * (most - least) || 1;
    const options = chartOptions(container.clientWidth, 190, "loss of score", {
      scales: { y: { range: () => [least - room, most + room] } },
      series: [{}, { label: "loss", stroke: themeColour("ink"), width: 1.75, points: { show: false } }],
      hooks: {
        draw: [
          (chart) => {
            const { min, max } = chart.scales.x;
            strokeLine(chart, [min, 0], [max, 0], { colour: themeColour("soft"), dash: [2, 3] });
          },
        ],
      },
    });
    return new uPlot(options, [whole, longer], container);
  }

  return { drawBeats, drawGut, drawStretches };
})(uPlot, Signals, Palette, Charts, ChartFrame, Elements);
