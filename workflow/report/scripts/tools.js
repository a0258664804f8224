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

  /** Add the tools to a table in its scroll box. Return the new block; `name` is the file's name. */
  function forTable(scroll, name) {
    const table = scroll.querySelector("table");
    const label = scroll.getAttribute("aria-label").replace(/^Table: /, "");
    const block = element("div", "block");
    if (scroll.parentNode) scroll.replaceWith(block);
    const tools = element("div", "tools");
    tools.append(button("CSV", `Save the table as CSV: ${label}`, () => Saving.saveCsv(wholeTable(table), `${name}.csv`)));
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
