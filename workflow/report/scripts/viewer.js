"use strict";

// One recording, drawn: readings, envelope, matrix with the fitted particle, distances, verdict.

const DASHES = [[], [8, 3], [2, 2], [9, 3, 2, 3], [5, 2, 1, 2, 1, 2]];
const CONTOURS = [0.25, 0.5, 0.75];
const UNKNOWN = "not known";

/** Make an element with a class and text. */
function element(tag, className = "", text = "") {
  const made = document.createElement(tag);
  if (className) made.className = className;
  if (text !== "") made.textContent = text;
  return made;
}

/** Read a colour of the page's theme. */
function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function sensorColour(sensor) {
  return colour(`--sensor-${(sensor % 5) + 1}`);
}

function sizeWords(size) {
  if (size === null) return UNKNOWN;
  return size === 0 ? "no nodule" : `${size} mm`;
}

/** Axes, cursor and size that all charts share. */
function chartOptions(width, height, yLabel, options) {
  const axis = {
    stroke: colour("--soft"),
    grid: { stroke: colour("--rule"), width: 1 },
    ticks: { stroke: colour("--rule"), width: 1 },
    font: "12px system-ui, sans-serif",
    labelFont: "12px system-ui, sans-serif",
  };
  return {
    width,
    height,
    legend: { show: false },
    cursor: { sync: { key: "recording" }, points: { show: false }, y: false, drag: { x: true, y: false } },
    ...options,
    scales: { x: { time: false }, ...options.scales },
    axes: [
      { ...axis, label: "time (s)", labelSize: 20, size: 34 },
      { ...axis, label: yLabel, labelSize: 20, size: 52, ...options.yAxis },
    ],
  };
}

function sensorSeries(count) {
  return Array.from({ length: count }, (_, sensor) => ({
    label: `sensor ${sensor + 1}`,
    stroke: sensorColour(sensor),
    dash: DASHES[sensor % DASHES.length],
    width: 1.25,
  }));
}

function times(count, step, interval) {
  return Array.from({ length: count }, (_, index) => index * step * interval);
}

/** Draw the readings, one sensor below the other, all to one scale. */
function drawReadings(place, width, evidence) {
  const rows = unpack(evidence.readings);
  const known = rows.map((row) => row.filter((value) => value !== null).sort((a, b) => a - b));
  const middle = known.map((row) => row[Math.floor(row.length / 2)]);
  const span = Math.max(...known.map((row, s) => Math.max(row[row.length - 1] - middle[s], middle[s] - row[0])));
  const distance = 1.4 * span || 1;
  const shifted = rows.map((row, sensor) =>
    row.map((value) => (value === null ? null : value - middle[sensor] - sensor * distance)),
  );
  const options = chartOptions(width, 220, "sensor", {
    scales: { y: { range: () => [-(rows.length - 0.3) * distance, 0.7 * distance] } },
    yAxis: {
      splits: () => rows.map((_, sensor) => -sensor * distance),
      values: (_, splits) => splits.map((__, sensor) => String(sensor + 1)),
    },
    series: [{}, ...sensorSeries(rows.length).map((series) => ({ ...series, dash: [], width: 1 }))],
  });
  const time = times(rows[0].length, evidence.readings.every, evidence.interval_s);
  return new uPlot(options, [time, ...shifted], place);
}

/** Draw the envelopes and the threshold. */
function drawEnvelopes(place, width, evidence) {
  const rows = unpack(evidence.envelope);
  const time = times(rows[0].length, evidence.envelope.every, evidence.interval_s);
  const threshold = time.map(() => evidence.threshold);
  const top = 1.05 * Math.max(highest(rows), evidence.threshold);
  const options = chartOptions(width, 200, "envelope (SD)", {
    scales: { y: { range: () => [0, top] } },
    series: [
      {},
      ...sensorSeries(rows.length),
      { label: "threshold", stroke: colour("--ink"), width: 1, dash: [1, 3] },
    ],
  });
  return new uPlot(options, [time, ...rows, threshold], place);
}

/** Draw the matrix as shades, and the fitted particle's contours over it. */
function drawMatrix(place, width, evidence) {
  const rows = unpack(evidence.matrix);
  const fitted = evidence.fitted ? unpack(evidence.fitted) : null;
  const time = times(rows[0].length, evidence.matrix.every, evidence.interval_s);
  const sensors = rows.length;
  const [first, last] = sensors > 1 ? [1, sensors] : [0.5, 1.5];
  const options = chartOptions(width, 190, "sensor", {
    scales: { y: { dir: -1, range: () => [first, last] } },
    yAxis: {
      splits: () => rows.map((_, sensor) => sensor + 1),
      values: (_, splits) => splits.map(String),
      grid: { show: false },
    },
    series: [{}, { label: "matrix", show: true, stroke: "transparent", points: { show: false } }],
    hooks: {
      draw: [
        (chart) => {
          const step = time.length > 1 ? time[1] - time[0] : 1;
          const x = (column) => chart.valToPos(time[0] + column * step, "x", true);
          const y = (row) => chart.valToPos(first + row, "y", true);
          const { left, top, width: wide, height: high } = chart.bbox;
          chart.ctx.save();
          chart.ctx.beginPath();
          chart.ctx.rect(left, top, wide, high);
          chart.ctx.clip();
          shadeMatrix(chart.ctx, atLeastTwoRows(rows), x, y);
          if (fitted) strokeContours(chart.ctx, atLeastTwoRows(fitted), x, y);
          chart.ctx.restore();
        },
      ],
    },
  });
  return new uPlot(options, [time, time.map(() => first)], place);
}

function shadeMatrix(context, rows, x, y) {
  const [red, green, blue] = colour("--shade").split(",").map(Number);
  const between = 24;
  const columns = rows[0].length;
  const lines = (rows.length - 1) * between + 1;
  const most = highest(rows) || 1;
  const image = new ImageData(columns, lines);
  for (let line = 0; line < lines; line += 1) {
    const row = Math.min(Math.floor(line / between), rows.length - 2);
    const part = line / between - row;
    for (let column = 0; column < columns; column += 1) {
      const value = (1 - part) * rows[row][column] + part * rows[row + 1][column];
      image.data.set([red, green, blue, Math.round((235 * value) / most)], 4 * (line * columns + column));
    }
  }
  const canvas = document.createElement("canvas");
  canvas.width = columns;
  canvas.height = lines;
  canvas.getContext("2d").putImageData(image, 0, 0);
  context.drawImage(canvas, x(0), y(0), x(columns - 1) - x(0), y(rows.length - 1) - y(0));
}

function strokeContours(context, rows, x, y) {
  const most = highest(rows);
  if (most <= 0) return;
  context.beginPath();
  for (const part of CONTOURS) {
    for (const [x0, y0, x1, y1] of contourSegments(rows, part * most)) {
      context.moveTo(x(x0), y(y0));
      context.lineTo(x(x1), y(y1));
    }
  }
  // A halo of the page's colour keeps the lines visible on every shade.
  context.strokeStyle = colour("--paper");
  context.lineWidth = 3.5 * devicePixelRatio;
  context.stroke();
  context.strokeStyle = colour("--contour");
  context.lineWidth = 1.4 * devicePixelRatio;
  context.stroke();
}

/** Name the lines: a sample of each sensor's line with its number. */
function lineKey(count) {
  const list = element("ul", "key");
  for (let sensor = 0; sensor < count; sensor += 1) {
    const item = element("li", "", `sensor ${sensor + 1}`);
    const sample = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    sample.setAttribute("viewBox", "0 0 32 6");
    sample.setAttribute("aria-hidden", "true");
    sample.setAttribute("class", `sensor-${(sensor % 5) + 1}`);
    const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    for (const [name, value] of [["x1", 0], ["y1", 3], ["x2", 32], ["y2", 3]]) line.setAttribute(name, value);
    line.setAttribute("stroke-dasharray", DASHES[sensor % DASHES.length].join(" "));
    sample.append(line);
    item.prepend(sample);
    list.append(item);
  }
  return list;
}

/** Make a table out of rows; the first cell of a row is its header. It scrolls where it must. */
function textTable(className, label, caption, heads, rows) {
  const scroll = element("div", "scroll");
  scroll.tabIndex = 0;
  scroll.setAttribute("role", "region");
  scroll.setAttribute("aria-label", `Table: ${label}`);
  const table = element("table", className);
  scroll.append(table);
  const title = element("caption");
  title.append(element("span", "", caption));
  table.append(title);
  const head = table.createTHead().insertRow();
  for (const text of heads) {
    const cell = element("th", "", text);
    cell.scope = "col";
    head.append(cell);
  }
  const body = table.createTBody();
  for (const [first, ...others] of rows) {
    const row = body.insertRow();
    const cell = element("th", "", first);
    cell.scope = "row";
    row.append(cell);
    for (const content of others) {
      const data = row.insertCell();
      data.append(content);
    }
  }
  return scroll;
}

/** A distance as a number with a bar, so that the eye finds the shortest. */
function distanceCell(value, nearest, longest) {
  if (value === null) return document.createTextNode(UNKNOWN);
  const cell = element("span", value === nearest ? "distance nearest" : "distance");
  cell.append(element("span", "number", value.toFixed(4)));
  const bar = element("span", "bar");
  bar.style.width = `${(6 * value) / (longest || 1)}rem`;
  bar.setAttribute("aria-hidden", "true");
  cell.append(bar);
  return cell;
}

function distanceTable(evidence, sizes) {
  const shown = evidence.verdicts.filter((verdict) => verdict.distances.length);
  const heads = ["Template", ...shown.map((verdict) => verdict.label)];
  const known = shown.map((verdict) => verdict.distances.filter((value) => value !== null));
  const longest = Math.max(0, ...known.flat());
  const rows = sizes.map((size, index) => [
    sizeWords(size),
    ...shown.map((verdict, which) => distanceCell(verdict.distances[index], Math.min(...known[which]), longest)),
  ]);
  const caption = "RMSE to every template; the shortest distance is the verdict of the paper’s detector, template.";
  return textTable("distances", "distances", caption, heads, rows);
}

function verdictTable(evidence) {
  const rows = evidence.verdicts.map((verdict) => [
    verdict.label,
    element("strong", "", sizeWords(verdict.predicted_mm)),
    verdict.details,
  ]);
  const caption = "Every detector’s verdict, by what other recordings teach; with resubstitution this one teaches too.";
  return textTable("verdicts", "verdicts", caption, ["Detector", "Verdict", "Details"], rows);
}

function peakTable(evidence) {
  const rows = evidence.peaks.map(([value, at, above], sensor) => [
    `Sensor ${sensor + 1}`,
    value.toFixed(2),
    at.toFixed(1),
    above.toFixed(1),
  ]);
  const heads = ["Sensor", "Highest (SD)", "At (s)", `Above ${evidence.threshold} SD for (s)`];
  return textTable("peaks", "envelopes", "The envelopes in numbers.", heads, rows);
}

/** A chart with its caption; `describe` says in words what the canvas shows. */
function chartFigure(parent, title, caption, describe) {
  const figure = element("figure", "chart");
  figure.append(element("figcaption", "", caption));
  figure.firstChild.prepend(element("strong", "", `${title}. `));
  const place = element("div", "canvas");
  place.setAttribute("role", "img");
  place.setAttribute("aria-label", describe);
  figure.append(place);
  parent.append(figure);
  return place;
}

/** Fill the viewer with one recording; gives what is to be called when the width changes. */
function showRecording(viewer, evidence, sizes) {
  viewer.replaceChildren();
  const sensors = evidence.readings.rows;
  const strongest = evidence.peaks
    .map(([value, at], sensor) => `sensor ${sensor + 1} ${value.toFixed(2)} SD at ${at.toFixed(1)} s`)
    .join(", ");
  viewer.append(lineKey(sensors));
  const thinned = evidence.readings.every > 1 ? ` One reading in ${evidence.readings.every} is shown.` : "";
  const places = [
    chartFigure(
      viewer,
      "Readings",
      `As recorded, one sensor below the other, all to one scale.${thinned}`,
      `Readings of ${sensors} sensors over time.`,
    ),
    chartFigure(
      viewer,
      "Envelope",
      `RMS envelope of the normalized readings; the dotted line is the threshold of ${evidence.threshold} SD.`,
      `RMS envelopes. Highest values: ${strongest}. The table below lists them.`,
    ),
    chartFigure(
      viewer,
      "Matrix",
      "What exceeds the threshold, as shades over sensor and time" +
        (evidence.fitted ? "; lines are the fitted particle at a quarter, half and three quarters of its height." : ". No particle is fitted to it."),
      "Matrix of what exceeds the threshold, sensor 1 on top." + (evidence.fitted ? " The fitted particle's contours lie over it." : ""),
    ),
  ];
  const draw = [drawReadings, drawEnvelopes, drawMatrix];
  let charts = [];
  const redraw = () => {
    charts.forEach((chart) => chart.destroy());
    charts = draw.map((make, index) => make(places[index], places[index].clientWidth, evidence));
  };
  const tables = element("div", "tables");
  tables.append(distanceTable(evidence, sizes), peakTable(evidence));
  viewer.append(verdictTable(evidence), tables);
  const facts = element("dl", "facts");
  for (const [name, text] of Object.entries(evidence.facts)) {
    facts.append(element("dt", "", name), element("dd", "", text || UNKNOWN));
  }
  viewer.append(facts);
  redraw();
  return redraw;
}
