// Add tools to tables and figures: save files.

const Tools = ((Elements, Saving) => {
  "use strict";

  const { button, element } = Elements;

  /** Return all rows of a table for a file. Events tell a table with further rows to list them before, and to remove them after. */
  function wholeTable(table) {
    table.dispatchEvent(new Event("beforesave"));
    const rows = Saving.tableRows(table);
    table.dispatchEvent(new Event("aftersave"));
    return rows;
  }

  /** Write the head of its column into each cell, for narrow screens, where a row is a card. */
  function label(table) {
    const groups = [...table.querySelectorAll('thead th[scope="colgroup"]')].flatMap((head) => Array(head.colSpan).fill(`${head.textContent}, `));
    const leaves = [...(table.tHead?.rows[table.tHead.rows.length - 1].cells ?? [])].map((head) => (head.querySelector("code") ?? head).textContent.trim());
    const heads = groups.length ? ["", ...leaves.map((text, place) => `${groups[place]}${text}`)] : leaves;
    for (const row of [...table.tBodies].flatMap((body) => [...body.rows])) {
      // A cell that spans rows is missing in the rows below it.
      const missing = heads.length - row.cells.length;
      [...row.cells].forEach((cell, place) => {
        if (cell.tagName === "TD") cell.dataset.label = heads[place + Math.max(missing, 0)] ?? "";
      });
    }
    table.classList.add("stacked");
  }

  /** Add the tools to a table in its scroll box. Return the new block; `name` is the file's name. */
  function forTable(scroll, name) {
    const table = scroll.querySelector("table");
    const title = scroll.getAttribute("aria-label").replace(/^Table: /, "");
    label(table);
    const block = element("div", "block");
    if (scroll.parentNode) scroll.replaceWith(block);
    const tools = element("div", "tools");
    tools.append(button("CSV", `Save the table as CSV: ${title}`, () => Saving.saveCsv(wholeTable(table), `${name}.csv`)));
    block.append(tools, scroll);
    return block;
  }

  /** Add the tool to a recording's chart. */
  function forChart(figure, canvas, { title, sensors, name }) {
    const tools = element("div", "tools");
    const save = () => Saving.saveChart(canvas.querySelector("canvas"), title, sensors, `${name}.png`);
    tools.append(button("PNG", `Save the chart as PNG: ${title}`, save));
    figure.prepend(tools);
  }

  /** Add the tools to a figure of the page. */
  function forFigure(figure) {
    const name = figure.id.replace(/^figure-/, "");
    const image = () => figure.querySelector("img");
    const tools = element("div", "tools");
    tools.append(
      button("SVG", `Save the figure as SVG: ${name}`, () => Saving.saveSvg(image(), name)),
      button("PNG", `Save the figure as PNG: ${name}`, () => Saving.saveFigure(image(), name)),
    );
    figure.append(tools);
  }

  /** Add the tools to all tables and figures of the page. */
  function setUp() {
    for (const scroll of document.querySelectorAll("main .scroll")) {
      forTable(scroll, scroll.querySelector("table").id || "table");
    }
    for (const figure of document.querySelectorAll("main figure[id]")) forFigure(figure);
  }

  return { setUp, forTable, forChart };
})(Elements, Saving);
