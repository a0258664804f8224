// Set up the table of recordings, where the page has one.

((RecordingsTable, Chooser) => {
  "use strict";

  const table = document.getElementById("recordings-table");
  if (!table) return;
  document.getElementById("filters").hidden = false;
  RecordingsTable.setUp(table, Chooser.setUp(table));
})(RecordingsTable, Chooser);
