// Show one recording: the chosen detector's evidence, the signals, and the tables.

const Viewer = ((Elements, Palette, Charts, EvidenceList, Saving, Shown) => {
  "use strict";

  const { UNKNOWN, chartFigure, element, number, sizeWords, svgElement, textTable } = Elements;
  const { sensorLine } = Palette;

  /** Return a verdict's detector and scheme in words. */
  function labelOf(verdict) {
    return `${verdict.detector}, ${verdict.scheme}`;
  }

  /** Return a verdict's size in words, or that there is no verdict; its details then tell the reason. */
  function verdictWords(verdict) {
    return verdict.predicted_mm === null ? "no verdict" : sizeWords(verdict.predicted_mm);
  }

  /** Return a distance as a number with a bar, which makes the shortest distance easy to see. */
  function distanceCell(value, nearest, longest) {
    if (value === null) return document.createTextNode(UNKNOWN);
    const cell = element("span", value === nearest ? "distance nearest" : "distance");
    cell.append(element("span", "number", number(value, 4)));
    const bar = element("span", "bar");
    bar.style.width = `${(6 * value) / (longest || 1)}rem`;
    bar.setAttribute("aria-hidden", "true");
    cell.append(bar);
    return cell;
  }

  /** Return the table of distances to all templates, for each detector that uses them. */
  function distances(evidence, data) {
    const shown = evidence.verdicts.filter((verdict) => verdict.distances.length);
    const heads = ["Template", ...shown.map(labelOf)];
    const known = shown.map((verdict) => verdict.distances.filter((value) => value !== null));
    const longest = Math.max(0, ...known.flat());
    const rows = data.sizes.map((size, index) => [
      sizeWords(size),
      ...shown.map((verdict, which) => distanceCell(verdict.distances[index], Math.min(...known[which]), longest)),
    ]);
    const caption = "RMSE to every template; the shortest distance is the verdict of the paper’s detector, template.";
    return textTable("distances", "distances", caption, heads, rows);
  }

  /** Return the table of all detectors' verdicts. */
  function verdicts(evidence) {
    const rows = evidence.verdicts.map((verdict) => [
      labelOf(verdict),
      element("strong", "", verdictWords(verdict)),
      verdict.details,
    ]);
    return textTable("verdicts", "verdicts", "Every detector’s verdict.", ["Detector", "Verdict", "Details"], rows);
  }

  /** Return the table of the envelopes in numbers. */
  function peaks(evidence) {
    const rows = evidence.peaks.map(([value, at, above], sensor) => [
      `Sensor ${sensor + 1}`,
      number(value, 2),
      number(at, 1),
      number(above, 1),
    ]);
    const heads = ["Sensor", "Highest (SD)", "At (s)", `Above ${number(evidence.threshold)} SD for (s)`];
    return textTable("peaks", "envelopes", "The envelopes in numbers.", heads, rows);
  }

  /** Return the list of facts from the recording's file, fit and header. */
  function facts(evidence) {
    const list = element("dl", "facts");
    const add = (name, text) => list.append(element("dt", "", name), element("dd", "", text || UNKNOWN));
    for (const [name, text] of Object.entries(evidence.facts)) {
      add(name, text);
      if (name === "SHA-256" && evidence.fit) add("Fit", evidence.fit);
    }
    return list;
  }

  /** Return the key of the lines: a sample of each sensor's line with its number. */
  function keyEntries(sensors) {
    return Array.from({ length: sensors }, (_, sensor) => {
      const { colour, dash } = sensorLine(sensor);
      const sample = svgElement("svg", { viewBox: "0 0 32 6", "aria-hidden": "true", stroke: colour });
      sample.append(svgElement("line", { x1: 0, y1: 3, x2: 32, y2: 3, "stroke-dasharray": dash.join(" ") }));
      const entry = element("li", "", `sensor ${sensor + 1}`);
      entry.prepend(sample);
      return entry;
    });
  }

  /** Return the charts of the signals in order, each with title, caption, description and drawing function. */
  function signalCharts(evidence) {
    const sensors = evidence.peaks.length;
    const strongest = evidence.peaks
      .map(([value, at], sensor) => `sensor ${sensor + 1} ${number(value, 2)} SD at ${number(at, 1)} s`)
      .join(", ");
    const fitted = evidence.fitted
      ? {
          caption: "; lines are the fitted particle at a quarter, half and three quarters of its height.",
          description: " The fitted particle's contours lie over it.",
        }
      : { caption: ". No particle is fitted to it.", description: "" };
    const unit = evidence.unit === "V" ? "volts" : "counts of the ADC";
    return [
      {
        title: "Readings",
        bySensor: true,
        caption: `As recorded, in ${unit}, one sensor below the other. All sensors have the scale of the bar.`,
        description: `Readings of ${sensors} sensors over time, in ${unit}.`,
        draw: (canvas) => Charts.drawReadings(canvas, evidence),
      },
      {
        title: "Envelope",
        bySensor: true,
        caption: `RMS envelope of the normalized readings; the dotted line is the threshold of ${number(evidence.threshold)} SD.`,
        description: `RMS envelopes. Highest values: ${strongest}. The table below lists them.`,
        draw: (canvas) => Charts.drawEnvelopes(canvas, evidence),
      },
      {
        title: "Matrix",
        caption: `What exceeds the threshold, as shades over sensor and time${fitted.caption}`,
        description: `Matrix of what exceeds the threshold, sensor 1 on top.${fitted.description}`,
        draw: (canvas) => Charts.drawMatrix(canvas, evidence, evidence.fitted),
      },
    ];
  }

  /** Return a detector's verdict. */
  function verdictOf(evidence, detector) {
    return evidence.verdicts.find((each) => each.detector === detector);
  }

  /** Return the recording's truth and the chosen detector's verdict in words. */
  function titleOf(evidence, detector) {
    const verdict = verdictOf(evidence, detector);
    if (!verdict || verdict.predicted_mm === null) return `${evidence.title}, not judged`;
    const outcome = verdict.outcome === "unlabelled" ? "" : ` (${verdict.outcome})`;
    return `${evidence.title}, taken for ${sizeWords(verdict.predicted_mm)} by ${detector}${outcome}`;
  }

  /** Return links to the same recording with other detectors. */
  function detectorLinks(evidence, shown, data) {
    const list = element("ul", "judges");
    list.setAttribute("aria-label", "Detectors");
    for (const { name } of data.detectors) {
      const verdict = verdictOf(evidence, name);
      if (!verdict) continue;
      const link = element("a", "", name);
      link.href = Shown.format({ ...shown, detector: name });
      if (name === shown.detector) link.setAttribute("aria-current", "true");
      const entry = element("li");
      entry.append(link, element("span", "", verdictWords(verdict)));
      list.append(entry);
    }
    return list;
  }

  /** Return the heading of a detector's evidence, with the verdict in words. */
  function evidenceHead(verdict, detector) {
    const head = element("h4", "", "What ");
    head.append(element("code", "", detector.name), " judged by");
    const said = element("p", "verdict");
    if (!verdict) said.textContent = "This detector gave no verdict on the recording.";
    else {
      const parts = [verdictWords(verdict), verdict.details].filter(Boolean).join(": ");
      const needs = verdict.score === null && detector.needs ? ` It needs ${detector.needs}.` : "";
      said.append(element("strong", "", `${parts}.`), ` ${labelOf(verdict)}.${needs}`);
    }
    return [head, said];
  }

  /** Fill the viewer with one recording. Return a function to call when width or theme changes. */
  function show(viewer, evidence, shown, data) {
    const verdict = verdictOf(evidence, shown.detector);
    const detector = data.detectors.find((each) => each.name === shown.detector);
    const listed = verdict ? EvidenceList.chartsOf(evidence, verdict, detector) : [];
    const file = (title) => `${shown.recording} ${title}`;
    const prepare = (chart) => {
      const made = { ...chart, ...chartFigure(chart) };
      const sensors = chart.bySensor ? evidence.peaks.length : 0;
      const title = `${shown.recording}: ${chart.title}${chart.judged ? `, ${shown.detector}` : ""}`;
      Saving.forChart(made.figure, made.canvas, { title, sensors, name: file(`${chart.judged ? `${shown.detector} ` : ""}${chart.title}`) });
      return made;
    };
    const [judged, signals] = [listed.map((chart) => prepare({ ...chart, judged: true })), signalCharts(evidence).map(prepare)];
    const [readings, ...derived] = signals;
    const before = viewer.querySelector("details.fold");
    const fold = element("details", "fold");
    // A fold that the reader opened stays open for the next recording.
    fold.open = before?.open ?? false;
    fold.append(element("summary", "", "Envelope, matrix, every detector’s verdict and the header"));
    const tables = element("div", "tables");
    tables.append(
      Saving.forTable(distances(evidence, data), file("distances")),
      Saving.forTable(peaks(evidence), file("envelopes")),
    );
    const key = element("ul", "key");
    viewer.replaceChildren(
      detectorLinks(evidence, shown, data),
      ...evidenceHead(verdict, detector),
      key,
      ...judged.map(({ figure }) => figure),
      readings.figure,
      fold,
    );
    fold.append(
      ...derived.map(({ figure }) => figure),
      Saving.forTable(verdicts(evidence), file("verdicts")),
      tables,
      facts(evidence),
    );
    let drawn = [];
    const redraw = () => {
      key.replaceChildren(...keyEntries(evidence.peaks.length));
      drawn.forEach((chart) => chart.destroy());
      // Draw no chart in a closed fold, because it has no width there.
      drawn = [...judged, readings, ...(fold.open ? derived : [])].map(({ draw, canvas }) => draw(canvas));
    };
    redraw();
    fold.addEventListener("toggle", redraw);
    return redraw;
  }

  return { show, titleOf };
})(Elements, Palette, Charts, EvidenceList, Saving, Shown);
