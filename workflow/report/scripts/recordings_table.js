// Sort, filter and search the table of all recordings. Of a large archive it lists a part, because browsers are slow with thousands of rows.

/** Set up the table and its filters. `onChange` of what is returned is called after each change of the rows. */
function setUpTable(table) {
  const body = table.tBodies[0];
  const all = [...body.rows];
  // The number of rows that the page lists before this script runs.
  const step = all.filter((row) => !row.hidden).length;
  const byName = new Map(all.map((row) => [row.dataset.recording, row]));
  const order = new Intl.Collator("en", { numeric: true });
  const [form, search, size, outcome, more] = ["filters", "search", "filter-size", "filter-outcome", "list-more"].map(byId);
  let ordered = all;
  // The rows that fit the search and the filters, in order.
  let fitting = all;
  let limit = step;

  /** List the rows that fit, up to a number of them. */
  const show = (most) => {
    limit = most;
    const listed = new Set(fitting.slice(0, limit));
    for (const row of all) row.hidden = !listed.has(row);
    // To move a row takes long, so only those that are listed stand in their order.
    if (ordered !== all) body.prepend(...listed);
    more.hidden = listed.size === fitting.length;
    byId("shown").textContent = `${fitting.length} of ${all.length} ${more.hidden ? "shown" : `fit, the first ${limit} are listed`}`;
    byId("none-shown").hidden = fitting.length > 0;
    list.onChange();
  };

  const filter = () => {
    const wanted = search.value.trim().toLowerCase();
    const isWanted = (row) => {
      // Collected once: every key that is typed asks for the texts of all rows.
      const [name, itsSize, , itsOutcome, ...others] = (row.texts ??= [...row.cells].map((cell) => cell.textContent));
      return (
        (!size.value || itsSize === size.value) &&
        (!outcome.value || itsOutcome === outcome.value) &&
        [name, itsSize, itsOutcome, others.at(-1)].join(" ").toLowerCase().includes(wanted)
      );
    };
    fitting = ordered.filter(isWanted);
    show(step);
  };

  const sortBy = (head, column) => {
    const direction = head.ariaSort === "ascending" ? "descending" : "ascending";
    for (const other of table.tHead.rows[0].cells) other.ariaSort = other === head ? direction : "none";
    const sign = direction === "ascending" ? 1 : -1;
    const keyed = all.map((row) => ({ row, value: row.cells[column].dataset.value }));
    const isNumber = keyed.every(({ value }) => !isNaN(value));
    // Unknown numbers come last in both directions. Equal values keep the order of the archive.
    const isUnknown = ({ value }) => isNumber && value === "";
    const compare = isNumber ? (a, b) => a - b : order.compare;
    keyed.sort((a, b) => isUnknown(a) - isUnknown(b) || sign * compare(a.value, b.value));
    ordered = keyed.map(({ row }) => row);
    filter();
  };

  more.textContent = `List ${step} more`;
  more.addEventListener("click", () => show(limit + step));
  form.hidden = false;
  form.addEventListener("input", filter);
  form.addEventListener("submit", (event) => event.preventDefault());
  form.addEventListener("reset", () => setTimeout(filter));
  [...table.tHead.rows[0].cells].forEach((head, column) => head.querySelector("button").addEventListener("click", () => sortBy(head, column)));
  table.fitting = () => fitting;
  const list = {
    fitting: table.fitting,
    of: (name) => byName.get(name),
    onChange: () => {},
    /** Scroll the box of the table to a row, which is listed if it fits. */
    bringIntoView: (row) => {
      show(Math.max(limit, fitting.indexOf(row) + 1));
      row.scrollIntoView({ block: "center" });
    },
  };
  show(step);
  return list;
}
