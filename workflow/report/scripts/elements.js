// Make the HTML and SVG elements of drawings and tables.

const Elements = (() => {
  "use strict";

  const UNKNOWN = "not known";

  /** Return a number as text, with a number of decimals if given, a true minus sign, and no sign for zero. */
  function number(value, decimals = null) {
    const text = decimals === null ? String(value) : value.toFixed(decimals);
    return Number(text) === 0 ? text.replace("-", "") : text.replaceAll("-", "\u2212");
  }

  /** Return a number as text with three significant digits. */
  function significant(value) {
    return number(Number(value.toPrecision(3)));
  }

  /** Return a size in the words of the page. */
  function sizeWords(size) {
    if (size === null) return UNKNOWN;
    return size === 0 ? "no nodule" : `${number(size)} mm`;
  }

  /** Return the JSON content of an element. */
  function readData(node) {
    return JSON.parse(node.textContent);
  }

  /** Return, later, JSON content that was deflated. */
  async function inflated(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Response(stream).json();
  }

  /** Return an element with a class and a text. */
  function element(tag, className = "", text = "") {
    const made = document.createElement(tag);
    if (className) made.className = className;
    if (text !== "") made.textContent = text;
    return made;
  }

  /** Return a button. The label explains its action to screen readers. */
  function button(text, label, onClick) {
    const made = element("button", "", text);
    made.type = "button";
    made.setAttribute("aria-label", label);
    made.addEventListener("click", onClick);
    return made;
  }

  /** Return an SVG element with attributes. */
  function svgElement(tag, attributes) {
    const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    return made;
  }

  /** Return a table in a scroll box. The first cell of each row is its header. */
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

  /** Return a figure for a chart. The description tells screen readers what the canvas shows. */
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

  return { UNKNOWN, number, significant, sizeWords, readData, inflated, element, button, svgElement, textTable, chartFigure };
})();
