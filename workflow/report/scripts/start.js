// Set up the interactive parts of the page, if the page has them.

((RecordingRows, RecordingsTable, Chooser, Shown, Switches, Links, Tools, Folds, Glossary, Surveys, Elements) => {
  "use strict";

  Tools.setUp();
  Folds.setUp();
  Glossary.setUp();
  Surveys.setUp();
  const carried = document.getElementById("page-data");
  const table = document.getElementById("recordings-table");
  if (!carried || !table) return;
  const data = Elements.readData(carried);
  const shown = Shown.setUp(data);
  document.getElementById("filters").hidden = false;
  const list = RecordingRows.setUp(table);
  Links.setUp(new Set(Object.keys(data.checksums)));
  const outcomesChanged = RecordingsTable.setUp(table, list, Chooser.setUp(list, shown, data));
  Switches.setUp(list, shown, data, outcomesChanged);
})(RecordingRows, RecordingsTable, Chooser, Shown, Switches, Links, Tools, Folds, Glossary, Surveys, Elements);
