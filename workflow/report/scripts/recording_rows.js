// Manage the rows of the table of all recordings. For a very large archive the table lists a part of them, because browsers are slow with thousands of rows.

const RecordingRows = ((Elements, Tools) => {
  "use strict";

  const { element } = Elements;

  /** Set up the rows and their order. A hidden row does not fit the reader's filters. */
  function setUp(table) {
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

    /** Put rows into the table; hidden columns stay hidden. */
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
      // A saved file holds all rows that fit.
      table.addEventListener("beforesave", () => put(fitting()));
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
      sort: (rows) => {
        ordered = rows;
        if (!further) body.append(...rows);
      },
      /** Return the number of rows that fit but are not in the table. */
      unlisted: () => (further ? Math.max(0, fitting().length - limit) : 0),
    };
  }

  return { setUp };
})(Elements, Tools);
