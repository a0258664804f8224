// Choose the charts of a detector's evidence on one recording, and write their captions.

const EvidenceList = ((Charts, ScoreChart, EvidenceCharts, Elements) => {
  "use strict";

  const { number, significant, sizeWords } = Elements;

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
      draw: (canvas) => ScoreChart.draw(canvas, verdict, marks),
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
      draw: (canvas) => EvidenceCharts.drawBeats(canvas, evidence, passing),
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
      draw: (canvas) => EvidenceCharts.drawGut(canvas, evidence, verdict),
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
      draw: (canvas) => EvidenceCharts.drawStretches(canvas, evidence),
    };
  }

  function templateChart(evidence, verdict, template) {
    const nearer = verdict.score !== null && verdict.score <= 0 ? " The template of no nodule, which is zero, is nearer." : "";
    return {
      title: "Nearest template",
      caption:
        `The template of ${sizeWords(template.size_mm)} at its best lag (lines) over the matrix (shades). The score is the ` +
        `margin: by how much this template reduces the squared difference from the matrix.${nearer}`,
      description: `Matrix with the contours of the template of ${sizeWords(template.size_mm)} over it.`,
      draw: (canvas) => Charts.drawMatrix(canvas, evidence, template),
    };
  }

  /** Return the charts of a detector in order; charts without data are left out. */
  function chartsOf(evidence, verdict, detector, marks) {
    const charts = [];
    if (verdict.score !== null) charts.push(scoreChart(verdict, marks));
    const drawn = (name) => detector.drawn.includes(name);
    const template = evidence.templates[verdict.scheme];
    if (drawn("template") && template) charts.push(templateChart(evidence, verdict, template));
    if (drawn("beats") && evidence.beats) charts.push(beatsChart(evidence, drawn("passing")));
    if (drawn("gut") && evidence.gut) charts.push(gutChart(evidence, verdict));
    if (drawn("stretches") && evidence.stretches) charts.push(stretchesChart(evidence, verdict));
    return charts;
  }

  return { chartsOf };
})(Charts, ScoreChart, EvidenceCharts, Elements);
