// Set up the interactive parts of the page, if the page has them.

((RecordingsTable, Chooser, Shown, Schemes, Tools, Folds, Glossary, Surveys, Meaning, Elements) => {
  "use strict";

  Tools.setUp();
  Folds.setUp();
  Glossary.setUp();
  Surveys.setUp();
  Meaning.setUp();
  const carried = document.getElementById("page-data");
  const table = document.getElementById("recordings-table");
  if (!carried || !table) return;
  const data = Elements.readData(carried);
  const shown = Shown.setUp(data);
  document.getElementById("filters").hidden = false;
  const list = RecordingsTable.rowsOf(table);
  // The chooser lists the row of the address, so the table is set up before it.
  let rowsChanged = () => {};
  RecordingsTable.setUp(table, list, () => rowsChanged());
  rowsChanged = Chooser.setUp(list, shown, data);
  Schemes.setUp(shown);
})(RecordingsTable, Chooser, Shown, Schemes, Tools, Folds, Glossary, Surveys, Meaning, Elements);
