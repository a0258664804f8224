"use strict"; // The page's script begins with this file, so this holds for all files.

// Numbers in words, elements of HTML and SVG, and tables.

const UNKNOWN = "not known";

function byId(id) {
  return document.getElementById(id);
}

/** Return a number as text, with a number of decimals if given, a true minus sign, and no sign for zero. */
function number(value, decimals = null) {
  const text = decimals === null ? String(value) : value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text.replaceAll("-", "\u2212");
}

/** Return a number as text with three significant digits. */
function significant(value) {
  return number(Number(value.toPrecision(3)));
}

/** Return, later, JSON content that was deflated. */
async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).json();
}

function filled(made, attributes, content) {
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...content);
  return made;
}

/** Return an element of HTML with attributes, and with texts and elements in it. */
function element(tag, attributes = {}, ...content) {
  return filled(document.createElement(tag), attributes, content);
}

/** Return an element of SVG with attributes, and with texts and elements in it. */
function svgElement(tag, attributes, ...content) {
  return filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, content);
}

/** Return a button. The label explains its action to screen readers. */
function button(text, label, onClick) {
  const made = element("button", { type: "button", "aria-label": label }, text);
  made.addEventListener("click", onClick);
  return made;
}

/** Return a table in a scroll box. The name is its class, and tells screen readers what it holds. The first cell of a row is its header. */
function textTable(name, caption, heads, rows) {
  const titles = heads.map((text) => element("th", { scope: "col" }, text));
  const body = rows.map(([first, ...others]) =>
    element("tr", {}, element("th", { scope: "row" }, first), ...others.map((content) => element("td", {}, content))),
  );
  const table = element(
    "table",
    { class: name },
    element("caption", {}, element("span", {}, caption)),
    element("thead", {}, element("tr", {}, ...titles)),
    element("tbody", {}, ...body),
  );
  return element("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": `Table: ${name}` }, table);
}

/** Return a figure for a chart. To screen readers, the caption tells what the canvas shows. */
function chartFigure({ title, caption }) {
  const canvas = element("div", { class: "canvas", role: "img", "aria-label": caption });
  const words = element("figcaption", {}, element("strong", {}, `${title}. `), caption);
  return { figure: element("figure", { class: "chart" }, words, canvas), canvas };
}
