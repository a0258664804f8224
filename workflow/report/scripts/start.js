// Set up the interactive parts of the page, if the page has them.

((RecordingRows, RecordingsTable, Chooser, Shown, Switches, Notes, Links, Tools, Folds, Glossary, Surveys, Elements) => {
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
  // A report that is made again at the same path keeps the notes on unchanged recordings.
  const list = RecordingRows.setUp(table);
  const noteOn = Notes.setUp(list, { report: location.pathname, checksums: data.checksums });
  Links.setUp(new Set(Object.keys(data.checksums)));
  const outcomesChanged = RecordingsTable.setUp(table, list, Chooser.setUp(list, shown, data, noteOn));
  Switches.setUp(list, shown, data, outcomesChanged);
})(RecordingRows, RecordingsTable, Chooser, Shown, Switches, Notes, Links, Tools, Folds, Glossary, Surveys, Elements);
