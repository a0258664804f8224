// Make the tables of one recording: verdicts, distances, envelopes, facts.

const Tables = ((Elements) => {
  "use strict";

  const { UNKNOWN, element, number, sizeWords, textTable } = Elements;

  /** Return a verdict's detector and scheme in words. */
  function labelOf(verdict, data) {
    const scheme = data.schemes.find((each) => each.name === verdict.scheme);
    return `${verdict.detector}, ${scheme ? scheme.words : "all labelled"}`;
  }

  /** Return the verdicts of a scheme, or of the first one that stands in for it, as for an unlabelled or a held-out recording. */
  function ofScheme(evidence, scheme, data) {
    const candidates = data.schemes.find((each) => each.name === scheme).stand_in;
    const judged = candidates.find((name) => evidence.verdicts.some((verdict) => verdict.scheme === name));
    return evidence.verdicts.filter((verdict) => verdict.scheme === judged);
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
  function distances(evidence, data, scheme) {
    const shown = ofScheme(evidence, scheme, data).filter((verdict) => verdict.distances.length);
    const heads = ["Template", ...shown.map((verdict) => labelOf(verdict, data))];
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
  function verdicts(evidence, data, scheme) {
    const listed = ofScheme(evidence, scheme, data);
    const rows = listed.map((verdict) => [
      labelOf(verdict, data),
      element("strong", "", verdictWords(verdict)),
      verdict.details,
    ]);
    const taught = listed.some((verdict) => verdict.scheme === "resubstitution") ? "All recordings teach, including this one" : "Only recordings of other places teach";
    const caption = `Every detector’s verdict. ${taught}.`;
    return textTable("verdicts", "verdicts", caption, ["Detector", "Verdict", "Details"], rows);
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

  return { labelOf, verdicts, distances, peaks, facts, ofScheme, verdictWords };
})(Elements);
