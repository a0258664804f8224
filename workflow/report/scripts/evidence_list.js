// The charts of a recording: its signals, and what a detector judged by. Each has a title, a caption and a drawing.

/** Return the chart of the readings. */
function readingsChart(evidence) {
  const rows = unpack(evidence.readings);
  const time = evenly(rows[0].length, 0, evidence.interval_s);
  const unit = evidence.unit === "V" ? "volts" : "counts of the ADC";
  return {
    title: "Readings",
    caption: `As recorded, in ${unit}, one sensor below the other. All sensors have one scale.`,
    draw: (canvas) => drawStacked(canvas, { time, rows, unit: evidence.unit, height: 230 }),
  };
}

/** Return the chart of the envelopes and the threshold. */
function envelopeChart({ envelope, interval_s: interval, threshold }) {
  const rows = unpack(envelope);
  const time = evenly(rows[0].length, 0, envelope.every * interval);
  return {
    title: "Envelope",
    caption: `RMS envelope of the normalized readings; the dotted line is the threshold of ${number(threshold)} SD. The table below lists the highest values.`,
    draw: (canvas) => drawStacked(canvas, { time, rows, middle: 0, level: threshold, unit: "SD", height: 230 }),
  };
}

/** Return the chart of the matrix, with the fitted particle over it. */
function matrixChart(evidence) {
  const fitted = evidence.fitted ? "; lines are the fitted particle at a quarter, half and three quarters of its height." : ". No particle is fitted to it.";
  return {
    title: "Matrix",
    caption: `What exceeds the threshold, as shades over sensor and time${fitted}`,
    draw: (canvas) => drawMatrix(canvas, evidence, evidence.fitted),
  };
}

/** Return the chart of a verdict's score among those of the archive, one row a true size. */
function scoreChart({ score, threshold }, archive) {
  const side =
    threshold === null
      ? "No threshold could be learned."
      : `The threshold is ${significant(threshold)}: the score ${score > threshold ? "exceeds it" : "does not exceed it"}.`;
  const isThinned = archive.some(({ of, scores }) => of > scores.length);
  const known = [...archive.flatMap(({ scores }) => scores), score, threshold].filter((value) => value !== null);
  const [least, most] = [Math.min(...known), Math.max(...known)];
  const room = 0.06 * (most - least) || 1;
  const rows = Math.max(archive.length, 1);
  const options = {
    xLabel: "score",
    cursor: { show: false },
    // Two lines of text have room above.
    scales: { x: { range: [least - room, most + room] }, y: { dir: -1, range: [-2.1, rows - 0.4] } },
    yAxis: {
      splits: () => archive.map((_, row) => row),
      values: () => archive.map(({ size }) => size),
      grid: { show: false },
      label: null,
      size: 78,
    },
    series: [{}, line("transparent", 1)],
    marks: [
      ...archive.flatMap(({ scores }, row) => scores.map((x) => ({ x, y: [row - 0.32, row + 0.32], colour: "soft", width: 1.5 }))),
      { x: threshold, text: "threshold", row: 1, colour: "ink", width: 1.5, dash: [2, 3] },
      { x: score, text: "this recording" },
    ],
  };
  return {
    title: "Score",
    caption:
      `This recording scores ${significant(score)}. ${side} Each mark is the score of a recording of the archive, in the row of ` +
      `its true size. The place that is scored does not teach.${isThinned ? " Not all are drawn; those that are have evenly spaced ranks." : ""}`,
    draw: (canvas) => makeChart(canvas, 92 + 21 * rows, "", options, [[least, most], [0, 0]]),
  };
}

/** Extend rows of values, and their times, over the whole time of a recording. */
function overRecording({ readings, interval_s: interval }, { first_s: first, step_s: step }, rows) {
  const time = evenly(rows[0].length, first, step);
  const duration = (readings.rows[0].length - 1) * interval;
  return [[Math.min(0, first), ...time, Math.max(duration, time.at(-1))], ...rows.map((row) => [null, ...row, null])];
}

/** Return the chart of the depth of each sensor's beats; "passing" marks when each sensor passes the place. */
function beatsChart(evidence, _, { drawn }) {
  const { beats } = evidence;
  const [time, ...rows] = overRecording(evidence, beats, unpack(beats));
  const passed = drawn.includes("passing") ? beats.passed_s : [];
  const marks = passed.map((x, sensor) => ({ x, y: [-sensor - 0.15, -sensor + 0.75] }));
  const said = passed.map((at) => (at === null ? "never" : number(at, 1))).join(", ");
  return {
    title: "Beats",
    caption:
      "Every wave presses every sensor. Lines show how deep each press is, in units of the sensor’s usual depth (dotted line); a nodule " +
      `makes it deeper.${said && ` Bars: when each sensor passes the place with the highest score (${said} s).`}`,
    draw: (canvas) => drawStacked(canvas, { time, rows, middle: 1, level: 1, unit: "× usual", height: 250, marks }),
  };
}

/** Return the chart of the score along the gut, with the threshold, the place with the highest score, and the true place. */
function gutChart(evidence, { threshold, location_mm: location }) {
  const [scores] = unpack(evidence.gut);
  const places = evenly(scores.length, 0, evidence.gut.step_mm);
  const most = Math.max(...scores);
  const best = places[scores.indexOf(most)];
  const truth = evidence.nodule_at_mm;
  const [low, high] = [Math.min(...scores, threshold ?? 0, 0), Math.max(most, threshold ?? most)];
  // Leave room for two lines of text above.
  const range = [low - 0.05 * (high - low), high + 0.35 * (high - low)];
  const options = {
    xLabel: "way of sensor 1 from the start (mm)",
    scales: { x: { range: [0, Math.max(places.at(-1), truth ?? 0) || 1] }, y: { range } },
    marks: [
      { y: threshold, colour: "ink", width: 1, dash: [2, 3] },
      { x: best, y: [range[0], most], text: `${location === null ? "highest" : "found"} ${number(best, 1)} mm` },
      { x: truth, y: [range[0], high], text: truth === null ? "" : `true ${number(truth, 1)} mm`, row: 1, colour: "good-ink", dash: [7, 4] },
    ],
  };
  return {
    title: "Score along the gut",
    caption:
      `Evidence from the beats of all sensors for a nodule at each place, highest at ${number(best, 1)} mm. Each value is the largest ` +
      "score over all mean speeds of the capsule. The dotted line is the threshold." +
      `${truth === null ? "" : ` The dashed line is the true place, ${number(truth, 1)} mm, from the header.`}`,
    draw: (canvas) => makeChart(canvas, 220, "score", options, [places, scores]),
  };
}

/** Return the chart of the loss of score without each stretch. */
function stretchesChart(evidence, verdict) {
  const { stretches } = evidence;
  const [loss] = unpack(stretches);
  const [least, most] = [Math.min(0, ...loss), Math.max(0, ...loss)];
  const room = 0.1 * (most - least) || 1;
  const options = { scales: { y: { range: [least - room, most + room] } }, marks: [{ y: 0, colour: "soft", width: 1, dash: [2, 3] }] };
  const added = verdict.score === null ? "" : ` The adaptation changes it by ${significant(verdict.score - stretches.score)}.`;
  return {
    title: "What each stretch adds",
    caption:
      "Each stretch of two waves in turn is replaced by usual beats. The line shows how much the score falls: a high " +
      `value speaks for a nodule. The score before the archive adapts it is ${significant(stretches.score)}.${added}`,
    draw: (canvas) => makeChart(canvas, 190, "loss of score", options, overRecording(evidence, stretches, [loss])),
  };
}

/** Return the chart of the nearest template over the matrix. */
function templateChart(evidence, verdict) {
  const { template } = evidence;
  const nearer = verdict.score !== null && verdict.score <= 0 ? " The template of no nodule, which is zero, is nearer." : "";
  return {
    title: "Nearest template",
    caption:
      `The template of ${template.size}, from all recordings that teach, at its best lag (lines) over the matrix ` +
      `(shades). The score is by how much the nearest template that this place did not teach reduces the squared difference.${nearer}`,
    draw: (canvas) => drawMatrix(canvas, evidence, template),
  };
}

// The charts of evidence, by the name of what a detector draws. Those without data are left out.
const EVIDENCE = { template: templateChart, beats: beatsChart, gut: gutChart, stretches: stretchesChart };

/** Return the charts of what a detector judged by, in order. */
function judgedCharts(evidence, verdict, detector) {
  const charts = verdict.score === null ? [] : [scoreChart(verdict, detector.scores)];
  const shown = Object.keys(EVIDENCE).filter((name) => detector.drawn.includes(name) && evidence[name]);
  return [...charts, ...shown.map((name) => EVIDENCE[name](evidence, verdict, detector))];
}
