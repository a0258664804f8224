// Save tables as CSV, charts as PNG, figures as SVG and PNG.

function textOf(node) {
  return (node?.textContent ?? "").replace(/\s+/g, " ").trim();
}

/** Return the titles of the columns; of a detector only its name. */
function columnTitles(table) {
  return [...table.tHead.rows[0].cells].map((cell) => textOf(cell.querySelector("code") ?? cell));
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

/** Return the rows of a table, of that of all recordings those that fit its filters. A rate becomes three columns. */
function tableRows(table) {
  const body = table.fitting?.() ?? [...table.querySelectorAll("tbody tr")];
  const rate = (cell) => [cell?.dataset.value, textOf(cell?.querySelector(".bounds")), textOf(cell?.querySelector(".count"))];
  const columns = columnTitles(table).map((title, column) => {
    const cells = body.map((row) => row.cells[column]);
    if (cells.some((cell) => cell?.querySelector(".value"))) return [[title, `${title}: interval`, `${title}: count`], ...cells.map(rate)];
    return [[title], ...cells.map((cell) => [cell?.dataset.value ?? textOf(cell)])];
  });
  return [null, ...body].map((_, row) => columns.flatMap((column) => column[row]));
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

/** Save a chart's canvas with a title, on the page's background. */
function saveChart(canvas, title, name) {
  const unit = devicePixelRatio;
  savePng(canvas.width + 24 * unit, canvas.height + 44 * unit, themeColour("paper"), name, (context) => {
    context.drawImage(canvas, 12 * unit, 32 * unit);
    context.scale(unit, unit);
    context.fillStyle = themeColour("ink");
    context.textBaseline = "top";
    context.font = "600 13px system-ui, sans-serif";
    context.fillText(title, 12, 12);
  });
}

/** Add tools to the caption of a figure or a table; each has a text, a label for screen readers and an action. */
function addTools(part, ...tools) {
  part.querySelector("figcaption, caption span").prepend(element("div", { class: "tools" }, ...tools.map((tool) => button(...tool))));
}

/** Add the tool to a table, and the head of its column to each cell, for narrow screens, where a row is a card. */
function addTableTools(table, name) {
  const title = table.parentElement.getAttribute("aria-label").replace(/^Table: /, "");
  const heads = columnTitles(table);
  for (const cell of table.querySelectorAll("tbody td")) cell.dataset.label = heads[cell.cellIndex];
  table.classList.add("stacked");
  const csv = () => save([toCsv(tableRows(table))], "text/csv;charset=utf-8", `${name}.csv`);
  addTools(table, ["CSV", `Save the table as CSV: ${title}`, csv]);
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
  addTools(figure, ["SVG", `Save the figure as SVG: ${name}`, svg], ["PNG", `Save the figure as PNG: ${name}`, png]);
}
