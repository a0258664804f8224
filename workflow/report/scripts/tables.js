// The tables of one recording: verdicts, distances, envelopes, facts.

const Tables = ((Elements) => {
  "use strict";

  const { UNKNOWN, element, number, sizeWords, textTable } = Elements;

  /** Name the detector of a verdict, and what taught it. */
  function labelOf(verdict, data) {
    const scheme = data.schemes.find((each) => each.name === verdict.scheme);
    return `${verdict.detector}, ${scheme ? scheme.words : "all labelled"}`;
  }

  /** Give the verdicts under a scheme; an unlabelled recording has one for all. */
  function ofScheme(evidence, scheme) {
    return evidence.verdicts.filter((verdict) => [scheme, "all"].includes(verdict.scheme));
  }

  /** A distance as a number with a bar, so that the eye finds the shortest. */
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

  /** Make the table of the distances to every template, by each detector that judges by them. */
  function distances(evidence, data, scheme) {
    const shown = ofScheme(evidence, scheme).filter((verdict) => verdict.distances.length);
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

  /** Make the table of every detector's verdict. */
  function verdicts(evidence, data, scheme) {
    const rows = ofScheme(evidence, scheme).map((verdict) => [
      labelOf(verdict, data),
      element("strong", "", sizeWords(verdict.predicted_mm)),
      verdict.details,
    ]);
    const taught = scheme === "resubstitution" ? "by what all recordings teach, this one too" : "by what other recordings teach";
    const caption = `Every detector’s verdict, ${taught}.`;
    return textTable("verdicts", "verdicts", caption, ["Detector", "Verdict", "Details"], rows);
  }

  /** Make the table of the envelopes in numbers. */
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

  /** Make the list of what the recording's header and fit say. */
  function facts(evidence) {
    const list = element("dl", "facts");
    for (const [name, text] of Object.entries(evidence.facts)) {
      list.append(element("dt", "", name), element("dd", "", text || UNKNOWN));
    }
    return list;
  }

  return { labelOf, verdicts, distances, peaks, facts };
})(Elements);
