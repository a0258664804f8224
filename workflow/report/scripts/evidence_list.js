// The charts of a recording: its signals, and what a detector judged by. Each has a title, a caption, a description and a drawing.

const OWN = { colour: "accent", width: 2.5 };

/** Return the chart of the readings, each sensor about its median. */
function readingsChart(evidence) {
  const rows = unpack(evidence.readings);
  const middles = rows.map((row) => {
    const known = row.filter((value) => value !== null).sort((a, b) => a - b);
    return known[Math.floor(known.length / 2)];
  });
  const time = evenly(rows[0].length, 0, evidence.interval_s);
  const unit = evidence.unit === "V" ? "volts" : "counts of the ADC";
  return {
    title: "Readings",
    caption: `As recorded, in ${unit}, one sensor below the other. All sensors have the scale of the bar.`,
    description: `Readings of ${rows.length} sensors over time, in ${unit}.`,
    draw: (canvas) => drawStacked(canvas, { time, rows, middles, unit: evidence.unit, height: 230 }),
  };
}

/** Return the chart of the envelopes and the threshold. */
function envelopeChart({ envelope, interval_s: interval, threshold, peaks }) {
  const rows = unpack(envelope);
  const time = evenly(rows[0].length, 0, envelope.every * interval);
  const scales = { y: { range: [0, 1.05 * Math.max(highest(rows), threshold)] } };
  const sensorLines = () => rows.map((_, sensor) => line(sensorLine(sensor).colour, 1.25, sensorLine(sensor).dash));
  const strongest = peaks.map(([value, at], sensor) => `sensor ${sensor + 1} ${number(value, 2)} SD at ${number(at, 1)} s`);
  return {
    title: "Envelope",
    hasKey: true,
    caption: `RMS envelope of the normalized readings; the dotted line is the threshold of ${number(threshold)} SD.`,
    description: `RMS envelopes. Highest values: ${strongest.join(", ")}. The table below lists them.`,
    draw: (canvas) => {
      const series = [{}, ...sensorLines(), line(themeColour("ink"), 1, [1, 3])];
      return makeChart(canvas, 200, "envelope (SD)", { scales, series }, [time, ...rows, time.map(() => threshold)]);
    },
  };
}

/** Return the chart of the matrix, with the fitted particle over it. */
function matrixChart(evidence) {
  const fitted = evidence.fitted ? "; lines are the fitted particle at a quarter, half and three quarters of its height." : ". No particle is fitted to it.";
  return {
    title: "Matrix",
    caption: `What exceeds the threshold, as shades over sensor and time${fitted}`,
    description: `Matrix of what exceeds the threshold, sensor 1 on top.${evidence.fitted ? " The fitted particle's contours lie over it." : ""}`,
    draw: (canvas) => drawMatrix(canvas, evidence, evidence.fitted),
  };
}

/** Return the chart of a verdict's score among the marks of the archive, one row a true size. */
function scoreChart({ score, threshold }, marks) {
  const side =
    threshold === null
      ? "No threshold could be learned."
      : `The threshold is ${significant(threshold)}: the score ${score > threshold ? "exceeds it" : "does not exceed it"}.`;
  const isThinned = ({ of, scores }) => of > scores.length;
  const sizes = marks.map((row) => `${sizeWords(row.size_mm)} (${isThinned(row) ? `${row.scores.length} of ` : ""}${row.of})`).join(", ");
  const thinned = marks.some(isThinned) ? " Not all are drawn; those that are have evenly spaced ranks." : "";
  const known = [...marks.flatMap(({ scores }) => scores), score, threshold].filter((value) => value !== null);
  const [least, most] = [Math.min(...known), Math.max(...known)];
  const room = 0.06 * (most - least) || 1;
  const rows = Math.max(marks.length, 1);
  const [top, bottom] = [-2.1, rows - 0.4];
  const across = (chart, value, text, place, look) => {
    strokeLine(chart, [value, top], [value, bottom], look);
    writeBeside(chart, text, value, place, look.colour);
  };
  const options = {
    xLabel: "score",
    cursor: { show: false },
    scales: { x: { range: [least - room, most + room] }, y: { dir: -1, range: [top, bottom] } },
    yAxis: {
      splits: () => marks.map((_, row) => row),
      values: () => marks.map(({ size_mm: size }) => sizeWords(size)),
      grid: { show: false },
      label: null,
      size: 78,
    },
    series: [{}, line("transparent", 1)],
    draw: (chart) => {
      marks.forEach(({ scores }, row) =>
        scores.forEach((each) => strokeLine(chart, [each, row - 0.32], [each, row + 0.32], { colour: "soft", width: 1.5 })),
      );
      if (threshold !== null) across(chart, threshold, "threshold", 1, { colour: "ink", width: 1.5, dash: [2, 3] });
      across(chart, score, "this recording", 0, OWN);
    },
  };
  return {
    title: "Score",
    caption:
      `This recording scores ${significant(score)}. ${side} Each mark is the score of a recording of the archive, in the row of ` +
      `its true size. The place that is scored does not teach.${thinned}`,
    description: `Score ${significant(score)} among the scores of the archive. ${side} Marks: ${sizes || "none"}.`,
    draw: (canvas) => makeChart(canvas, 92 + 21 * rows, "", options, [[least, most], [0, 0]]),
  };
}

/** Extend rows of values, and their times, over the whole time of a recording. */
function overRecording({ readings, interval_s: interval }, { first_s: first, step_s: step }, rows) {
  const time = evenly(rows[0].length, first, step);
  const duration = (readings.rows[0].length - 1) * interval;
  return [[Math.min(0, first), ...time, Math.max(duration, time.at(-1))], ...rows.map((row) => [null, ...row, null])];
}

/** Return the chart of the depth of each sensor's beats; `passing` marks when each sensor passes the place. */
function beatsChart(evidence, passing) {
  const { beats } = evidence;
  const passed = beats.passed_s.map((at, s) => `sensor ${s + 1} ${at === null ? "never" : `at ${number(at, 1)} s`}`);
  const [time, ...rows] = overRecording(evidence, beats, unpack(beats));
  const across = (chart, distance) =>
    beats.passed_s.forEach((at, sensor) => {
      const y = -sensor * distance;
      strokeLevel(chart, y, "soft");
      if (passing && at !== null) strokeLine(chart, [at, y - 0.15 * distance], [at, y + 0.75 * distance], OWN);
    });
  return {
    title: "Beats",
    caption:
      "Every wave presses every sensor. Lines show how deep each press is, in units of the sensor’s usual depth " +
      `(dotted line); a nodule makes it deeper.${passing ? " Bars: when each sensor passes the place with the highest score." : ""}`,
    description: `Depth of the beats of every sensor.${passing ? ` The place is passed by ${passed.join(", ")}.` : ""}`,
    draw: (canvas) => drawStacked(canvas, { time, rows, middles: rows.map(() => 1), unit: "× usual", height: 250, across }),
  };
}

/** Return the chart of the score along the gut, with the threshold, the place with the highest score, and the true place. */
function gutChart(evidence, { threshold, location_mm: location, predicted_mm: predicted }) {
  const [scores] = unpack(evidence.gut);
  const places = evenly(scores.length, 0, evidence.gut.step_mm);
  const most = Math.max(...scores);
  const best = places[scores.indexOf(most)];
  const truth = evidence.nodule_at_mm;
  const [low, high] = [Math.min(...scores, threshold ?? 0, 0), Math.max(most, threshold ?? most)];
  // Leave room for two lines of text above.
  const range = [low - 0.05 * (high - low), high + 0.35 * (high - low)];
  const farthest = Math.max(places.at(-1), truth ?? 0) || 1;
  if (farthest > places.at(-1)) {
    places.push(farthest);
    scores.push(null);
  }
  const options = {
    xLabel: "way of sensor 1 from the start (mm)",
    scales: { x: { range: [0, farthest] }, y: { range } },
    draw: (chart) => {
      if (threshold !== null) strokeLevel(chart, threshold, "ink");
      strokeLine(chart, [best, range[0]], [best, most], OWN);
      writeBeside(chart, `${predicted ? "found" : "highest"} ${number(best, 1)} mm`, best, 0, "accent");
      if (truth !== null) {
        strokeLine(chart, [truth, range[0]], [truth, high], { colour: "good-rule", width: 2.5, dash: [7, 4] });
        writeBeside(chart, `true ${number(truth, 1)} mm`, truth, 1, "ink");
      }
    },
  };
  const found = location === null ? "No place exceeds the threshold." : `The highest lies at ${number(location, 1)} mm.`;
  return {
    title: "Score along the gut",
    caption:
      "Evidence from the beats of all sensors for a nodule at each place. Each value is the largest score over all mean " +
      `speeds of the capsule. The dotted line is the threshold.${truth === null ? "" : " The dashed line is the true place, from the header."}`,
    description: `Score along the gut. ${found}${truth === null ? "" : ` The nodule lies at ${number(truth, 1)} mm.`}`,
    draw: (canvas) => makeChart(canvas, 220, "score", options, [places, scores]),
  };
}

/** Return the chart of the loss of score without each stretch. */
function stretchesChart(evidence, verdict) {
  const { stretches } = evidence;
  const [loss] = unpack(stretches);
  const data = overRecording(evidence, stretches, [loss]);
  const [least, most] = [Math.min(0, ...loss), Math.max(0, ...loss)];
  const room = 0.1 * (most - least) || 1;
  const options = { scales: { y: { range: [least - room, most + room] } }, draw: (chart) => strokeLevel(chart, 0, "soft") };
  const added = verdict.score === null ? "" : ` The adaptation changes it by ${significant(verdict.score - stretches.score)}.`;
  return {
    title: "What each stretch adds",
    caption:
      "Each stretch of two waves in turn is replaced by usual beats. The line shows how much the score falls: a high " +
      `value speaks for a nodule. The score before the archive adapts it is ${significant(stretches.score)}.${added}`,
    description: "Loss of score without each stretch of the recording, over time.",
    draw: (canvas) => makeChart(canvas, 190, "loss of score", options, data),
  };
}

/** Return the chart of the nearest template over the matrix. */
function templateChart(evidence, verdict) {
  const { template } = evidence;
  const nearer = verdict.score !== null && verdict.score <= 0 ? " The template of no nodule, which is zero, is nearer." : "";
  return {
    title: "Nearest template",
    caption:
      `The template of ${sizeWords(template.size_mm)}, from all recordings that teach, at its best lag (lines) over the matrix ` +
      `(shades). The score is by how much the nearest template that this place did not teach reduces the squared difference.${nearer}`,
    description: `Matrix with the contours of the template of ${sizeWords(template.size_mm)} over it.`,
    draw: (canvas) => drawMatrix(canvas, evidence, template),
  };
}

/** Return the charts of what a detector judged by, in order; charts without data are left out. */
function judgedCharts(evidence, verdict, detector) {
  const charts = verdict.score === null ? [] : [scoreChart(verdict, detector.scores)];
  const shows = (name) => detector.drawn.includes(name) && evidence[name];
  if (shows("template")) charts.push(templateChart(evidence, verdict));
  if (shows("beats")) charts.push(beatsChart(evidence, detector.drawn.includes("passing")));
  if (shows("gut")) charts.push(gutChart(evidence, verdict));
  if (shows("stretches")) charts.push(stretchesChart(evidence, verdict));
  return charts;
}
