// Sort, filter and search the table of all recordings. Of a large archive it lists a part, because browsers are slow with thousands of rows.

const RecordingsTable = (() => {
  "use strict";

  /** Set up the table and its filters. `onChange` is called after each change of the rows. */
  function setUp(table, onChange) {
    const body = table.tBodies[0];
    const all = [...body.rows];
    // The number of rows that the page lists before this script runs.
    const step = all.filter((row) => !row.hidden).length;
    const byName = new Map(all.map((row) => [row.dataset.recording, row]));
    const [form, status, more, none, search, size, outcome] = ["filters", "shown", "list-more", "none-shown", "search", "filter-size", "filter-outcome"].map(
      (id) => document.getElementById(id),
    );
    let ordered = all;
    let limit = step;
    const fitting = () => ordered.filter((row) => !row.classList.contains("misfit"));

    const list = () => {
      const rows = fitting();
      const listed = new Set(rows.slice(0, limit));
      for (const row of all) row.hidden = !listed.has(row);
      more.hidden = listed.size === rows.length;
      status.textContent = `${rows.length} of ${all.length} ${more.hidden ? "shown" : `fit, the first ${limit} are listed`}`;
      none.hidden = rows.length > 0;
    };

    /** List the rows that fit now, from the top. */
    const refresh = () => {
      limit = step;
      list();
      onChange();
    };

    const filter = () => {
      const wanted = search.value.trim().toLowerCase();
      for (const row of all) {
        const fits =
          (!size.value || row.dataset.size === size.value) &&
          (!outcome.value || row.dataset.outcome === outcome.value) &&
          `${row.dataset.text} ${row.dataset.outcome}`.includes(wanted);
        row.classList.toggle("misfit", !fits);
      }
      refresh();
    };

    const sortBy = (head, column) => {
      const direction = head.getAttribute("aria-sort") === "ascending" ? "descending" : "ascending";
      for (const other of table.tHead.querySelectorAll("th")) other.setAttribute("aria-sort", other === head ? direction : "none");
      const order = new Intl.Collator("en", { numeric: true });
      const compare = head.dataset.kind === "number" ? (a, b) => a - b : order.compare;
      const keyed = all.map((row) => ({ row, value: row.cells[column].dataset.value }));
      // Unknown numbers come last in both directions. Equal values keep the order of the archive.
      const isUnknown = ({ value }) => head.dataset.kind === "number" && value === "";
      const sign = direction === "ascending" ? 1 : -1;
      keyed.sort((a, b) => isUnknown(a) - isUnknown(b) || sign * compare(a.value, b.value));
      ordered = keyed.map(({ row }) => row);
      // Rows move much faster in a body that is not on the page.
      body.remove();
      body.append(...ordered);
      table.append(body);
      refresh();
    };

    more.textContent = `List ${step} more`;
    more.addEventListener("click", () => {
      limit += step;
      list();
    });
    form.hidden = false;
    form.addEventListener("input", filter);
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("reset", () => setTimeout(filter));
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      head.querySelector("button").addEventListener("click", () => sortBy(head, column));
    });
    list();
    return {
      fitting,
      of: (name) => byName.get(name),
      /** Scroll the box of the table to a row, which is listed if it fits. */
      bringIntoView: (row) => {
        limit = Math.max(limit, fitting().indexOf(row) + 1);
        list();
        row.scrollIntoView({ block: "center" });
      },
    };
  }

  return { setUp };
})();
