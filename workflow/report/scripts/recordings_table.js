// Sort, filter and search the table of all recordings. For a very large archive the table lists a part of them, because browsers are slow with thousands of rows.

const RecordingsTable = ((Elements) => {
  "use strict";

  const { element } = Elements;

  /** Set up the rows and their order. A hidden row does not fit the reader's filters. */
  function rowsOf(table) {
    const body = table.tBodies[0];
    // The number of rows that the page contains in its table.
    const step = body.rows.length;
    // Rows in a template are not part of the page until they are moved into the table.
    const further = document.getElementById("further-rows");
    const all = [...body.rows, ...(further ? further.content.children : [])];
    const byName = new Map(all.map((row) => [row.dataset.recording, row]));
    let ordered = all;
    let limit = step;
    const fitting = () => ordered.filter((row) => !row.hidden);
    const more = element("button", "", `List ${step} more`);
    more.type = "button";
    more.id = "list-more";
    more.hidden = true;
    if (further) document.getElementById("none-shown").before(more);

    const status = document.getElementById("shown");
    const list = () => {
      const rows = fitting();
      const left = further ? Math.max(0, rows.length - limit) : 0;
      if (further) body.replaceChildren(...rows.slice(0, limit));
      more.hidden = left === 0;
      status.textContent = `${rows.length} of ${all.length} ${left ? `fit, the first ${limit} are listed` : "shown"}`;
      document.getElementById("none-shown").hidden = rows.length > 0;
    };

    more.addEventListener("click", () => {
      limit += step;
      list();
    });
    if (further) {
      // A saved file holds all rows that fit.
      table.addEventListener("beforesave", () => body.replaceChildren(...fitting()));
      table.addEventListener("aftersave", list);
    }
    return {
      all,
      fitting,
      of: (name) => byName.get(name),
      /** List the rows that fit now, from the top. */
      refresh: () => {
        limit = step;
        list();
      },
      /** Scroll the box of the table to a row, which is listed if it fits. */
      bringIntoView: (row) => {
        limit = Math.max(limit, fitting().indexOf(row) + 1);
        list();
        row.scrollIntoView({ block: "center" });
      },
      sort: (rows) => {
        ordered = rows;
        if (!further) body.append(...rows);
      },
    };
  }

  /** Let a reader sort, filter and search the rows of `list`. `onChange` is called after each change. */
  function setUp(table, list, onChange) {
    const rows = list.all;
    const search = document.getElementById("search");
    const size = document.getElementById("filter-size");
    const outcome = document.getElementById("filter-outcome");

    const filter = () => {
      const wanted = search.value.trim().toLowerCase();
      for (const row of rows) {
        row.hidden = !(
          (!size.value || row.dataset.size === size.value) &&
          (!outcome.value || row.dataset.outcome === outcome.value) &&
          (!wanted || `${row.dataset.text} ${row.dataset.outcome}`.includes(wanted))
        );
      }
      list.refresh();
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
      const keyed = rows.map((row, rank) => ({ row, rank, value: key(row) }));
      keyed.sort((a, b) => {
        // Unknown values come last in both directions. Equal values keep the order of the archive.
        if (a.value === null || b.value === null) return (a.value === null) - (b.value === null) || a.rank - b.rank;
        return (ascending ? 1 : -1) * compare(a.value, b.value) || a.rank - b.rank;
      });
      list.sort(keyed.map((entry) => entry.row));
      list.refresh();
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

  return { rowsOf, setUp };
})(Elements);
