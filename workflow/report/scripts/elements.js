// The elements that the drawings and tables are put together from.

const Elements = (() => {
  "use strict";

  const UNKNOWN = "not known";

  /** Write a number, with so many decimals if told: a minus is a minus sign, and zero has none. */
  function number(value, decimals = null) {
    const text = decimals === null ? String(value) : value.toFixed(decimals);
    return Number(text) === 0 ? text.replace("-", "") : text.replaceAll("-", "\u2212");
  }

  /** Write a number to three significant digits. */
  function significant(value) {
    return number(Number(value.toPrecision(3)));
  }

  /** Write a size as the page does. */
  function sizeWords(size) {
    if (size === null) return UNKNOWN;
    return size === 0 ? "no nodule" : `${number(size)} mm`;
  }

  /** Read what the page carries as JSON in an element. */
  function readData(node) {
    return JSON.parse(node.textContent);
  }

  /** Make an element with a class and text. */
  function element(tag, className = "", text = "") {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== "") made.textContent = text;
    return made;
  }

  /** Make a button; the label says what it does where its text is too short for that. */
  function button(text, label, onClick) {
    const made = element("button", "", text);
    made.type = "button";
    made.setAttribute("aria-label", label);
    made.addEventListener("click", onClick);
    return made;
  }

  /** Make an element of a drawing with its attributes. */
  function svgElement(tag, attributes) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    return made;
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

  /** Make a figure for a chart; the description says in words what its canvas shows. */
  function chartFigure({ title, caption, description }) {
    const figure = element("figure", "chart");
    figure.append(element("figcaption", "", caption));
    figure.firstChild.prepend(element("strong", "", `${title}. `));
    const canvas = element("div", "canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", description);
    figure.append(canvas);
    return { figure, canvas };
  }

  return { UNKNOWN, number, significant, sizeWords, readData, element, button, svgElement, textTable, chartFigure };
})();
