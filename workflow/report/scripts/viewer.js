// Show one recording: the chosen detector's evidence, the signals, and the tables.

/** Return a verdict's detector and scheme in words. */
function labelOf(verdict) {
  return `${verdict.detector}, ${verdict.scheme}`;
}

/** Return the recording's truth and a verdict in words. */
function titleOf(evidence, verdict) {
  if (!verdict || verdict.said === "no verdict") return `${evidence.title}, not judged`;
  const outcome = verdict.outcome === "unlabelled" ? "" : ` (${verdict.outcome})`;
  return `${evidence.title}, taken for ${verdict.said} by ${verdict.detector}${outcome}`;
}

/** Return a distance as a number with a bar, which makes the shortest distance easy to see. */
function distanceCell(value, nearest, longest) {
  if (value === null) return UNKNOWN;
  const bar = element("progress", { value, max: longest || 1, "aria-hidden": "true" });
  return element("span", {}, element(value === nearest ? "strong" : "span", {}, number(value, 4)), bar);
}

/** Return the table of distances to all templates, for each detector that uses them. */
function distancesTable(evidence, sizes) {
  const shown = evidence.verdicts.filter((verdict) => verdict.distances.length);
  const known = shown.map((verdict) => verdict.distances.filter((value) => value !== null));
  const longest = Math.max(0, ...known.flat());
  const rows = sizes.map((size, index) => [
    size,
    ...shown.map((verdict, which) => distanceCell(verdict.distances[index], Math.min(...known[which]), longest)),
  ]);
  const caption = "RMSE to every template; the shortest distance is the verdict of the paper’s detector, template.";
  return textTable("distances", caption, ["Template", ...shown.map(labelOf)], rows);
}

/** Return the table of all detectors' verdicts. */
function verdictsTable({ verdicts }) {
  const rows = verdicts.map((verdict) => [labelOf(verdict), element("strong", {}, verdict.said), verdict.details]);
  return textTable("verdicts", "Every detector’s verdict.", ["Detector", "Verdict", "Details"], rows);
}

/** Return the table of the envelopes in numbers. */
function peaksTable({ peaks, threshold }) {
  const rows = peaks.map(([value, at, above], sensor) => [`Sensor ${sensor + 1}`, number(value, 2), number(at, 1), number(above, 1)]);
  const heads = ["Sensor", "Highest (SD)", "At (s)", `Above ${number(threshold)} SD for (s)`];
  return textTable("envelopes", "The envelopes in numbers.", heads, rows);
}

/** Return the facts from the recording's file, header and fit. */
function factsOf({ facts, fit }) {
  const named = Object.entries(fit ? { ...facts, Fit: fit } : facts);
  return named.flatMap(([name, text]) => [element("dt", {}, name), element("dd", {}, text || UNKNOWN)]);
}

/** Return links to the same recording with other detectors. */
function detectorLinks(verdicts, shown) {
  return verdicts.map((verdict) => {
    const current = verdict.detector === shown.detector ? { "aria-current": "true" } : {};
    const link = element("a", { href: addressOf({ ...shown, detector: verdict.detector }), ...current }, verdict.detector);
    return element("li", {}, link, element("span", {}, verdict.said));
  });
}

/** Return a verdict of a detector in words. */
function judgement(verdict, detector) {
  if (!verdict) return ["This detector gave no verdict on the recording."];
  const parts = [verdict.said, verdict.details].filter(Boolean).join(": ");
  const needs = verdict.score === null && detector.needs ? ` It needs ${detector.needs}.` : "";
  return [element("strong", {}, `${parts}.`), ` ${labelOf(verdict)}.${needs}`];
}

/** Fill the viewer with one recording. Return a function to call when width or theme changes. */
function showRecording(viewer, evidence, shown, { detectors, sizes }) {
  const verdictOf = ({ name }) => evidence.verdicts.find((each) => each.detector === name);
  const detector = detectors.find(({ name }) => name === shown.detector);
  const verdict = verdictOf(detector);
  const prepare = (chart, ...judge) => {
    const made = { ...chart, ...chartFigure(chart) };
    const title = `${shown.recording}: ${[chart.title, ...judge].join(", ")}`;
    const png = () => saveChart(made.canvas.querySelector("canvas"), title, [shown.recording, ...judge, chart.title].join(" "));
    addTools(made.figure, ["PNG", `Save the chart as PNG: ${title}`, png]);
    return made;
  };
  const judged = verdict ? judgedCharts(evidence, verdict, detector) : [];
  const open = [...judged.map((chart) => prepare(chart, detector.name)), prepare(readingsChart(evidence))];
  const folded = [envelopeChart(evidence), matrixChart(evidence)].map((chart) => prepare(chart));
  const fill = (part, ...content) => viewer.querySelector(part).replaceChildren(...content);
  const figures = (charts) => charts.map(({ figure }) => figure);
  byId("viewer-title").textContent = `${shown.recording}: ${titleOf(evidence, verdict)}`;
  fill(".judges", ...detectorLinks(detectors.map(verdictOf).filter(Boolean), shown));
  fill("h4 code", detector.name);
  fill(".verdict", ...judgement(verdict, detector));
  fill(".open", ...figures(open));
  fill(".folded", ...figures(folded), verdictsTable(evidence));
  fill(".tables", distancesTable(evidence, sizes), peaksTable(evidence));
  viewer.querySelectorAll("table").forEach((table) => addTableTools(table, `${shown.recording} ${table.className}`));
  fill(".facts", ...factsOf(evidence));
  let drawn = [];
  const redraw = () => {
    drawn.forEach((chart) => chart.destroy());
    // Draw no chart in a closed fold, because it has no width there.
    drawn = [...open, ...(viewer.querySelector("details").open ? folded : [])].map(({ draw, canvas }) => draw(canvas));
  };
  redraw();
  return redraw;
}
