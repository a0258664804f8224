// Set up what a reader can work with, where the page has it.

((RecordingsTable, Chooser, Shown, Elements) => {
  "use strict";

  const carried = document.getElementById("page-data");
  const table = document.getElementById("recordings-table");
  if (!carried || !table) return;
  const data = Elements.readData(carried);
  const shown = Shown.setUp(data);
  document.getElementById("filters").hidden = false;
  RecordingsTable.setUp(table, Chooser.setUp(table, shown, data));
})(RecordingsTable, Chooser, Shown, Elements);
