// Set up the interactive parts of the page, if the page has them.

((RecordingsTable, Chooser, Shown, Switches, Tools, Folds, Glossary, Surveys, Meaning, Elements) => {
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
  const outcomesChanged = RecordingsTable.setUp(table, list, Chooser.setUp(list, shown, data));
  Switches.setUp(list, shown, data, outcomesChanged);
})(RecordingsTable, Chooser, Shown, Switches, Tools, Folds, Glossary, Surveys, Meaning, Elements);
