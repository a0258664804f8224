// Set up the interactive parts of the page, if the page has them.

((RecordingsTable, Chooser, Shown, Saving, Glossary, Surveys, Meaning, Elements) => {
  "use strict";

  /** Open the folds around an element that the address names, now and after each change. */
  function openFolds() {
    const target = document.getElementById(location.hash.slice(1));
    if (!target?.closest("details")) return;
    for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
    target.scrollIntoView();
  }

  /** Let a reader choose the scheme by which the detectors are compared, if there is more than one. */
  function setUpSchemes(shown) {
    const form = document.getElementById("schemes");
    if (!form) return;
    const { scheme } = form.elements;
    form.hidden = false;
    form.addEventListener("change", () => shown.show({ scheme: scheme.value }));
    const update = (current) => {
      scheme.value = current.scheme;
      for (const part of document.querySelectorAll(".of-scheme")) part.hidden = part.dataset.scheme !== current.scheme;
    };
    shown.onChange(update);
    update(shown.current());
  }

  Saving.setUp();
  addEventListener("hashchange", openFolds);
  openFolds();
  Glossary.setUp();
  Surveys.setUp();
  Meaning.setUp();
  const carried = document.getElementById("page-data");
  if (!carried) return;
  const data = Elements.readData(carried);
  const shown = Shown.setUp(data);
  let rowsChanged = () => {};
  const list = RecordingsTable.setUp(document.getElementById("recordings-table"), () => rowsChanged());
  rowsChanged = Chooser.setUp(list, shown, data);
  setUpSchemes(shown);
})(RecordingsTable, Chooser, Shown, Saving, Glossary, Surveys, Meaning, Elements);
