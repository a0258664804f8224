// Save tables as CSV, charts as PNG, figures as SVG and PNG. Tables may have cells that span rows and columns.

function textOf(node) {
  return (node?.textContent ?? "").replace(/\s+/g, " ").trim();
}

/** Return, for each row, the cell that covers each column. */
function lay(rows) {
  const laid = rows.map(() => []);
  rows.forEach((row, at) => {
    let column = 0;
    for (const cell of row.cells) {
      while (laid[at][column]) column += 1;
      for (const below of laid.slice(at, at + cell.rowSpan)) {
        for (let across = 0; across < cell.colSpan; across += 1) below[column + across] = cell;
      }
    }
  });
  return laid;
}

/** Return the titles of the columns, joined from their head cells, upper cells first; of a detector only its name. */
function columnTitles(table) {
  const heads = lay([...table.tHead.rows]);
  return heads.at(-1).map((_, column) => {
    const cells = [...new Set(heads.map((row) => row[column]))];
    return cells.map((cell) => textOf(cell.querySelector("code") ?? cell)).join(", ");
  });
}

// The same rules as for the files of results: no cell is a formula for a spreadsheet, and numbers stay as they are.
const FORMULA = /(^|[;,|\t])(?=["']*[=+\-@\uff1d\uff0b\uff0d\uff20])/g;
const NUMBER = /^([+-]?[0-9]+(\.[0-9]+)?([eE][+-]?[0-9]+)?|[+-]?inf)$/;

function withoutFormula(text) {
  return NUMBER.test(text) ? text : text.replace(FORMULA, "$1 ");
}

function csvCell(text) {
  const harmless = withoutFormula(String(text ?? ""));
  return /[",\n\r]/.test(harmless) ? `"${harmless.replaceAll('"', '""')}"` : harmless;
}

function toCsv(rows) {
  return rows.map((row) => `${row.map(csvCell).join(",")}\n`).join("");
}

/** Return the rows of a table, of that of all recordings those that fit its filters. A rate becomes three columns; a cell that covers several is written once. */
function tableRows(table) {
  const titles = columnTitles(table);
  const body = table.fitting ? lay(table.fitting()) : [...table.tBodies].flatMap((part) => lay([...part.rows]));
  const isRate = titles.map((_, column) => body.some((row) => row[column]?.querySelector(".value")));
  const rate = (cell) => [cell?.dataset.value, textOf(cell?.querySelector(".bounds")), textOf(cell?.querySelector(".count"))];
  const written = body.map((row) =>
    titles.flatMap((_, column) => {
      const cell = row[column] === row[column - 1] ? null : row[column];
      return isRate[column] ? rate(cell) : [cell?.dataset.value ?? textOf(cell)];
    }),
  );
  const heads = titles.flatMap((title, column) => (isRate[column] ? [title, `${title}: interval`, `${title}: count`] : [title]));
  return [heads, ...written];
}

function save(parts, type, name) {
  const href = URL.createObjectURL(new Blob(parts, { type }));
  element("a", { href, download: name.replace(/[^A-Za-z0-9_.+-]+/g, "_") }).click();
  setTimeout(() => URL.revokeObjectURL(href), 60000);
}

/** Save a drawing of a size as PNG on a ground. */
function savePng(width, height, ground, name, draw) {
  const picture = element("canvas", { width, height });
  const context = picture.getContext("2d");
  context.fillStyle = ground;
  context.fillRect(0, 0, width, height);
  draw(context);
  picture.toBlob((blob) => save([blob], "image/png", `${name}.png`), "image/png");
}

/** Save a chart's canvas with a title and a key of the sensors' lines, on the page's background. */
function saveChart(canvas, title, sensors, name) {
  const unit = devicePixelRatio;
  const top = sensors ? 52 : 32;
  savePng(canvas.width + 24 * unit, canvas.height + (top + 12) * unit, themeColour("paper"), name, (context) => {
    context.drawImage(canvas, 12 * unit, top * unit);
    context.scale(unit, unit);
    context.fillStyle = themeColour("ink");
    context.textBaseline = "top";
    context.font = "600 13px system-ui, sans-serif";
    context.fillText(title, 12, 12);
    context.font = FONT;
    context.lineWidth = 2;
    for (let sensor = 0; sensor < sensors; sensor += 1) {
      const { colour, dash } = sensorLine(sensor);
      const left = 12 + 100 * sensor;
      context.strokeStyle = colour;
      context.setLineDash(dash);
      context.stroke(new Path2D(`M${left} 39h28`));
      context.fillText(`sensor ${sensor + 1}`, left + 34, 32);
    }
  });
}

/** Return the bar of tools; each has a text, a label for screen readers and an action. */
function toolBar(...tools) {
  return element("div", { class: "tools" }, ...tools.map((tool) => button(...tool)));
}

/** Add the tool to a table in its scroll box, and the head of its column to each cell, for narrow screens, where a row is a card. */
function tableWithTools(scroll, name) {
  const table = scroll.querySelector("table");
  const title = scroll.getAttribute("aria-label").replace(/^Table: /, "");
  const heads = columnTitles(table);
  for (const row of [...table.tBodies].flatMap((body) => lay([...body.rows]))) {
    row.forEach((cell, column) => {
      if (cell.tagName === "TD") cell.dataset.label = heads[column];
    });
  }
  table.classList.add("stacked");
  const csv = () => save([toCsv(tableRows(table))], "text/csv;charset=utf-8", `${name}.csv`);
  const block = element("div", { class: "block" }, toolBar(["CSV", `Save the table as CSV: ${title}`, csv]));
  scroll.replaceWith(block);
  block.append(scroll);
  return block;
}

/** Add the tools to a figure of the page, which is an SVG file; as PNG it is twice as large, on white. */
function addFigureTools(figure) {
  const name = figure.id.replace(/^figure-/, "");
  const image = figure.querySelector("img");
  const svg = () => save([decodeURIComponent(image.src.replace(/^[^,]*,/, ""))], "image/svg+xml", `${name}.svg`);
  const png = () => {
    const [width, height] = [2 * image.naturalWidth, 2 * image.naturalHeight];
    savePng(width, height, "#ffffff", name, (context) => context.drawImage(image, 0, 0, width, height));
  };
  figure.append(toolBar(["SVG", `Save the figure as SVG: ${name}`, svg], ["PNG", `Save the figure as PNG: ${name}`, png]));
}
