// The rows of the table of all recordings. Of a very large archive the table holds some at a time: a browser lays out thousands slowly.

const RecordingRows = ((Elements, Tools) => {
  "use strict";

  const { element } = Elements;

  /** Keep the rows in an order; those that are hidden do not fit what the reader looks for. */
  function setUp(table) {
    const body = table.tBodies[0];
    // As many as the table was written with.
    const step = body.rows.length;
    // Rows in a template are no part of the page until they are put into it.
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

    /** Put rows into the table; columns that are out of sight stay so. */
    const put = (rows) => {
      body.replaceChildren(...rows);
      Tools.toggleColumns(table, [], true);
    };

    const list = () => {
      if (!further) return;
      const rows = fitting();
      put(rows.slice(0, limit));
      more.hidden = rows.length <= limit;
    };

    more.addEventListener("click", () => {
      limit += step;
      list();
    });
    if (further) {
      // A file holds all rows that fit.
      table.addEventListener("beforesave", () => put(fitting()));
      table.addEventListener("aftersave", list);
    }
    return {
      all,
      fitting,
      of: (name) => byName.get(name),
      /** List anew, from the top, what fits now. */
      refresh: () => {
        limit = step;
        list();
      },
      sort: (rows) => {
        ordered = rows;
        if (!further) body.append(...rows);
      },
      /** Say how many of the rows that fit are not in the table. */
      unlisted: () => (further ? Math.max(0, fitting().length - limit) : 0),
    };
  }

  return { setUp };
})(Elements, Tools);
