// Save tables as CSV, also with cells that span rows and columns, and charts and figures as pictures.

const Saving = ((Palette) => {
  "use strict";

  const { sensorLine, themeColour } = Palette;

  function textOf(cell) {
    return cell.textContent.replace(/\s+/g, " ").trim();
  }

  /** Return, for each row, the cell that covers each column. */
  function lay(rows) {
    const laid = rows.map(() => []);
    rows.forEach((row, at) => {
      let column = 0;
      for (const cell of row.cells) {
        while (laid[at][column]) column += 1;
        for (let down = 0; down < cell.rowSpan && at + down < rows.length; down += 1) {
          for (let across = 0; across < cell.colSpan; across += 1) laid[at + down][column + across] = cell;
        }
        column += cell.colSpan;
      }
    });
    return laid;
  }

  /** Return the titles of the columns, joined from their head cells, upper cells first. */
  function columnTitles(table) {
    const heads = lay([...(table.tHead?.rows ?? [])]);
    const count = Math.max(0, ...heads.map((row) => row.length));
    return Array.from({ length: count }, (_, column) => {
      const cells = [...new Set(heads.map((row) => row[column]).filter(Boolean))];
      return cells.map(textOf).join(", ");
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

  /** Return the visible rows of a table. A rate becomes three columns. */
  function tableRows(table) {
    const titles = columnTitles(table);
    const bodies = [...table.tBodies].map((body) => lay([...body.rows]).filter((_, at) => !body.rows[at].hidden));
    const body = bodies.flat();
    const isRate = (column) => body.some((row) => row[column]?.querySelector(".value"));
    const heads = titles.flatMap((title, column) => (isRate(column) ? [title, `${title}: interval`, `${title}: count`] : [title]));
    const part = (cell, name) => textOf(cell.querySelector(name) ?? document.createElement("i"));
    const written = body.map((row) =>
      titles.flatMap((_, column) => {
        const cell = row[column];
        // A cell that covers several columns is written once.
        const again = column > 0 && row[column - 1] === cell;
        if (!cell || again) return isRate(column) ? ["", "", ""] : [""];
        if (!isRate(column)) return [cell.dataset.value ?? textOf(cell)];
        return [cell.dataset.value ?? "", part(cell, ".bounds"), part(cell, ".count")];
      }),
    );
    return [heads, ...written];
  }

  function save(blob, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name.replace(/[^A-Za-z0-9_.+-]+/g, "_");
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  }

  function saveCsv(rows, name) {
    save(new Blob([toCsv(rows)], { type: "text/csv;charset=utf-8" }), name);
  }

  /** Save a chart's canvas with a title and a key of the sensors' lines, on the page's background. */
  function saveChart(canvas, title, sensors, name) {
    const unit = devicePixelRatio;
    const [edge, line] = [12 * unit, 20 * unit];
    const picture = document.createElement("canvas");
    picture.width = canvas.width + 2 * edge;
    picture.height = canvas.height + 2 * edge + (sensors ? 2 : 1) * line;
    const context = picture.getContext("2d");
    context.fillStyle = themeColour("paper");
    context.fillRect(0, 0, picture.width, picture.height);
    context.fillStyle = themeColour("ink");
    context.textBaseline = "top";
    context.font = `600 ${13 * unit}px system-ui, sans-serif`;
    context.fillText(title, edge, edge);
    context.font = `${12 * unit}px system-ui, sans-serif`;
    for (let sensor = 0, left = edge; sensor < sensors; sensor += 1) {
      const { colour, dash } = sensorLine(sensor);
      const middle = edge + line + 7 * unit;
      context.strokeStyle = colour;
      context.lineWidth = 2 * unit;
      context.setLineDash(dash.map((length) => length * unit));
      context.beginPath();
      context.moveTo(left, middle);
      context.lineTo(left + 28 * unit, middle);
      context.stroke();
      context.fillText(`sensor ${sensor + 1}`, left + 34 * unit, edge + line);
      left += 100 * unit;
    }
    context.drawImage(canvas, edge, edge + (sensors ? 2 : 1) * line);
    picture.toBlob((blob) => save(blob, name), "image/png");
  }

  /** Save a figure as the SVG file that it is. */
  function saveSvg(image, name) {
    save(new Blob([decodeURIComponent(image.src.replace(/^[^,]*,/, ""))], { type: "image/svg+xml" }), `${name}.svg`);
  }

  /** Save a figure as PNG at twice its size, on white. */
  function saveFigure(image, name) {
    const picture = document.createElement("canvas");
    picture.width = 2 * image.naturalWidth;
    picture.height = 2 * image.naturalHeight;
    const context = picture.getContext("2d");
    context.fillStyle = "#ffffff";
    context.fillRect(0, 0, picture.width, picture.height);
    context.drawImage(image, 0, 0, picture.width, picture.height);
    picture.toBlob((blob) => save(blob, `${name}.png`), "image/png");
  }

  return { withoutFormula, toCsv, tableRows, saveCsv, saveChart, saveSvg, saveFigure };
})(Palette);
