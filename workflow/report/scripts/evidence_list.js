// Draw the evidence of a detector on one recording, with captions: score, beats, the score along the gut, stretches.

const EvidenceList = ((uPlot, Palette, ChartFrame, Elements, Signals, Charts) => {
  "use strict";

  const { themeColour } = Palette;
  const { chartOptions, evenly, overWholeRun, strokeLine, writeBeside } = ChartFrame;
  const { number, significant, sizeWords } = Elements;
  const { unpack } = Signals;

  /** Draw a verdict's score among the marks of the archive. */
  function drawScore(container, verdict, marks) {
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

  function duration(evidence) {
    return (evidence.readings.rows[0].length - 1) * evidence.interval_s;
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

  /** Return the chart of the score among the scores of the archive. */
  function scoreChart(verdict, marks) {
    const { score, threshold } = verdict;
    const side =
      threshold === null
        ? "No threshold could be learned."
        : `The threshold is ${significant(threshold)}: the score ${score > threshold ? "exceeds it" : "does not exceed it"}.`;
    const counted = marks.map((row) => (row.of > row.scores.length ? `${row.scores.length} of ${row.of}` : `${row.of}`));
    const thinned = marks.some((row) => row.of > row.scores.length) ? " Not all are drawn; those that are have evenly spaced ranks." : "";
    const sizes = marks.map((row, place) => `${sizeWords(row.size_mm)} (${counted[place]})`).join(", ");
    return {
      title: "Score",
      caption:
        `This recording scores ${significant(score)}. ${side} Each mark is the score of a recording of the archive, in the row of ` +
        `its true size. The place that is scored does not teach.${thinned}`,
      description: `Score ${significant(score)} among the scores of the archive. ${side} Marks: ${sizes || "none"}.`,
      draw: (canvas) => drawScore(canvas, verdict, marks),
    };
  }

  /** Return the chart of the beats' depth. `passing` adds marks at the times when each sensor passes the place. */
  function beatsChart(evidence, passing) {
    const passed = evidence.beats.passed_s.map((at, s) => `sensor ${s + 1} ${at === null ? "never" : `at ${number(at, 1)} s`}`);
    const marks = passing ? " Bars: when each sensor passes the place with the highest score." : "";
    return {
      title: "Beats",
      bySensor: true,
      caption:
        "Every wave presses every sensor. Lines show how deep each press is, in units of the sensor’s usual depth " +
        `(dotted line); a nodule makes it deeper.${marks}`,
      description: `Depth of the beats of every sensor.${passing ? ` The place is passed by ${passed.join(", ")}.` : ""}`,
      draw: (canvas) => drawBeats(canvas, evidence, passing),
    };
  }

  function gutChart(evidence, verdict) {
    const truth = evidence.nodule_at_mm === null ? "" : " The dashed line is the true place, from the header.";
    return {
      title: "Score along the gut",
      caption:
        "Evidence from the beats of all sensors for a nodule at each place. Each value is the largest score over all mean " +
        `speeds of the capsule. The dotted line is the threshold.${truth}`,
      description:
        `Score along the gut.${verdict.location_mm === null ? " No place exceeds the threshold." : ` The highest lies at ${number(verdict.location_mm, 1)} mm.`}` +
        `${evidence.nodule_at_mm === null ? "" : ` The nodule lies at ${number(evidence.nodule_at_mm, 1)} mm.`}`,
      draw: (canvas) => drawGut(canvas, evidence, verdict),
    };
  }

  function stretchesChart(evidence, verdict) {
    const { score } = evidence.stretches;
    const added = verdict.score === null ? "" : ` The adaptation changes it by ${significant(verdict.score - score)}.`;
    return {
      title: "What each stretch adds",
      caption:
        "Each stretch of two waves in turn is replaced by usual beats. The line shows how much the score falls: a high " +
        `value speaks for a nodule. The score before the archive adapts it is ${significant(score)}.${added}`,
      description: "Loss of score without each stretch of the recording, over time.",
      draw: (canvas) => drawStretches(canvas, evidence),
    };
  }

  function templateChart(evidence, verdict, template) {
    const nearer = verdict.score !== null && verdict.score <= 0 ? " The template of no nodule, which is zero, is nearer." : "";
    return {
      title: "Nearest template",
      caption:
        `The template of ${sizeWords(template.size_mm)}, from all recordings that teach, at its best lag (lines) over the matrix ` +
        `(shades). The score is by how much the nearest template that this place did not teach reduces the squared difference.${nearer}`,
      description: `Matrix with the contours of the template of ${sizeWords(template.size_mm)} over it.`,
      draw: (canvas) => Charts.drawMatrix(canvas, evidence, template),
    };
  }

  /** Return the charts of a detector in order; charts without data are left out. */
  function chartsOf(evidence, verdict, detector) {
    const charts = [];
    if (verdict.score !== null) charts.push(scoreChart(verdict, detector.scores));
    const drawn = (name) => detector.drawn.includes(name);
    if (drawn("template") && evidence.template) charts.push(templateChart(evidence, verdict, evidence.template));
    if (drawn("beats") && evidence.beats) charts.push(beatsChart(evidence, drawn("passing")));
    if (drawn("gut") && evidence.gut) charts.push(gutChart(evidence, verdict));
    if (drawn("stretches") && evidence.stretches) charts.push(stretchesChart(evidence, verdict));
    return charts;
  }

  return { chartsOf };
})(uPlot, Palette, ChartFrame, Elements, Signals, Charts);
