"use strict";

// The table of all recordings (sort, filter, search), and choosing one to look at.

/** Read what the page carries as JSON in an element. */
function readData(node) {
  return JSON.parse(node.textContent);
}

function setUpTable(table, onChange) {
  const body = table.tBodies[0];
  const rows = [...body.rows];
  const search = document.getElementById("search");
  const size = document.getElementById("filter-size");
  const outcome = document.getElementById("filter-outcome");
  const status = document.getElementById("shown");

  const filter = () => {
    const wanted = search.value.trim().toLowerCase();
    let shown = 0;
    for (const row of rows) {
      row.hidden = !(
        (!size.value || row.dataset.size === size.value) &&
        (!outcome.value || row.dataset.outcome === outcome.value) &&
        (!wanted || row.dataset.text.includes(wanted))
      );
      if (!row.hidden) shown += 1;
    }
    status.textContent = `${shown} of ${rows.length} shown`;
    document.getElementById("none-shown").hidden = shown > 0;
    onChange();
  };

  const sortBy = (head, column) => {
    const ascending = head.getAttribute("aria-sort") !== "ascending";
    for (const other of table.tHead.querySelectorAll("th")) {
      other.setAttribute("aria-sort", other === head ? (ascending ? "ascending" : "descending") : "none");
    }
    const numeric = head.dataset.kind === "number";
    const key = (row) => {
      const text = row.cells[column].dataset.value;
      return numeric ? (text === "" ? null : Number(text)) : text;
    };
    const order = new Intl.Collator("en", { numeric: true });
    const compare = (a, b) => (numeric ? a - b : order.compare(a, b));
    const keyed = rows.map((row, place) => ({ row, place, value: key(row) }));
    keyed.sort((a, b) => {
      // What is unknown comes last in both directions; equals keep the order of the archive.
      if (a.value === null || b.value === null) return (a.value === null) - (b.value === null) || a.place - b.place;
      return (ascending ? 1 : -1) * compare(a.value, b.value) || a.place - b.place;
    });
    body.append(...keyed.map((entry) => entry.row));
    onChange();
  };

  search.addEventListener("input", filter);
  size.addEventListener("change", filter);
  outcome.addEventListener("change", filter);
  const form = document.getElementById("filters");
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(filter));
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    head.querySelector("button").addEventListener("click", () => sortBy(head, column));
  });
  filter();
}

function setUpViewer(table) {
  const viewer = document.getElementById("viewer");
  const title = document.getElementById("viewer-title");
  const previous = document.getElementById("previous");
  const next = document.getElementById("next");
  const { sizes } = readData(document.getElementById("page-data"));
  const carried = new Map(
    [...document.querySelectorAll("script[data-evidence]")].map((node) => [node.dataset.evidence, node]),
  );
  let chosen = null;
  let redraw = () => {};

  const neighbours = () => {
    const shown = [...table.tBodies[0].rows].filter((row) => !row.hidden && carried.has(row.dataset.recording));
    const place = shown.findIndex((row) => row.dataset.recording === chosen);
    return [shown[place - 1], place < 0 ? shown[0] : shown[place + 1]];
  };

  const update = () => {
    const [before, after] = neighbours();
    previous.disabled = !before;
    next.disabled = !after;
    for (const row of table.tBodies[0].rows) {
      if (row.dataset.recording === chosen) row.setAttribute("aria-current", "true");
      else row.removeAttribute("aria-current");
    }
  };

  const choose = (recording) => {
    if (!carried.has(recording) || recording === chosen) return;
    chosen = recording;
    const evidence = readData(carried.get(recording));
    title.textContent = `${recording}: ${evidence.title}`;
    redraw = showRecording(viewer, evidence, sizes);
    update();
  };

  const chooseByAddress = () => {
    const match = /^#recording=(.+)$/.exec(decodeURIComponent(location.hash));
    if (!match) return false;
    choose(match[1]);
    title.scrollIntoView({ block: "start" });
    title.focus({ preventScroll: true });
    return true;
  };

  const step = (which) => {
    const row = neighbours()[which];
    if (!row) return;
    // Not by the address: the button keeps the focus, and the history stays short.
    choose(row.dataset.recording);
    history.replaceState(null, "", `#recording=${encodeURIComponent(row.dataset.recording)}`);
  };

  previous.addEventListener("click", () => step(0));
  next.addEventListener("click", () => step(1));
  window.addEventListener("hashchange", chooseByAddress);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => redraw());
  let width = viewer.clientWidth;
  new ResizeObserver(() => {
    if (viewer.clientWidth !== width) {
      width = viewer.clientWidth;
      redraw();
    }
  }).observe(viewer);
  if (!chooseByAddress() && carried.size) choose(viewer.dataset.first);
  return update;
}

const recordingsTable = document.getElementById("recordings-table");
if (recordingsTable) {
  document.getElementById("filters").hidden = false;
  setUpTable(recordingsTable, setUpViewer(recordingsTable));
}
