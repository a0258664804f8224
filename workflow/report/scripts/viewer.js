// One recording: the key of its lines, its charts, its tables.

const Viewer = ((Elements, Palette, Charts, Tables) => {
  "use strict";

  const { chartFigure, element, svgElement } = Elements;
  const { sensorLine } = Palette;

  /** Name the lines: a sample of each sensor's line with its number. */
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

  /** Give the charts in their order: title, caption, what they show in words, and how to draw them. */
  function chartsOf(evidence) {
    const { every, rows: sensors } = evidence.readings;
    const thinned = every > 1 ? ` One reading in ${every} is shown.` : "";
    const strongest = evidence.peaks
      .map(([value, at], sensor) => `sensor ${sensor + 1} ${value.toFixed(2)} SD at ${at.toFixed(1)} s`)
      .join(", ");
    const fitted = evidence.fitted
      ? {
          caption: "; lines are the fitted particle at a quarter, half and three quarters of its height.",
          description: " The fitted particle's contours lie over it.",
        }
      : { caption: ". No particle is fitted to it.", description: "" };
    return [
      {
        title: "Readings",
        caption: `As recorded, one sensor below the other, all to one scale.${thinned}`,
        description: `Readings of ${sensors} sensors over time.`,
        draw: Charts.drawReadings,
      },
      {
        title: "Envelope",
        caption: `RMS envelope of the normalized readings; the dotted line is the threshold of ${evidence.threshold} SD.`,
        description: `RMS envelopes. Highest values: ${strongest}. The table below lists them.`,
        draw: Charts.drawEnvelopes,
      },
      {
        title: "Matrix",
        caption: `What exceeds the threshold, as shades over sensor and time${fitted.caption}`,
        description: `Matrix of what exceeds the threshold, sensor 1 on top.${fitted.description}`,
        draw: Charts.drawMatrix,
      },
    ];
  }

  /** Fill the viewer with one recording; gives what is to be called when width or theme changes. */
  function show(viewer, evidence, sizes) {
    const charts = chartsOf(evidence).map((chart) => ({ ...chart, ...chartFigure(chart) }));
    const tables = element("div", "tables");
    tables.append(Tables.distances(evidence, sizes), Tables.peaks(evidence));
    const key = element("ul", "key");
    viewer.replaceChildren(
      key,
      ...charts.map(({ figure }) => figure),
      Tables.verdicts(evidence),
      tables,
      Tables.facts(evidence),
    );
    let drawn = [];
    const redraw = () => {
      key.replaceChildren(...keyEntries(evidence.readings.rows));
      drawn.forEach((chart) => chart.destroy());
      drawn = charts.map(({ draw, canvas }) => draw(canvas, evidence));
    };
    redraw();
    return redraw;
  }

  return { show };
})(Elements, Palette, Charts, Tables);
