// Switch detector and scheme in all sections that show the verdicts of one detector.

const Switches = ((Elements) => {
  "use strict";

  const { sizeWords } = Elements;

  /** Return a name that tables share if they differ only in detector or scheme. */
  function kind(block) {
    return block.querySelector("table").id.replace(/-\d+$/, "");
  }

  /** Hide the columns of other schemes. The heads above them shrink. */
  function showColumns(table, isOther) {
    for (const cell of table.querySelectorAll("[data-scheme]")) cell.hidden = isOther(cell.dataset.scheme);
    const leaves = [...table.querySelectorAll("thead tr:last-child th")];
    let first = 0;
    for (const group of table.querySelectorAll("th[data-span]")) {
      const after = first + Number(group.dataset.span);
      group.colSpan = leaves.slice(first, after).filter((leaf) => !leaf.hidden).length;
      first = after;
    }
  }

  /** Show the tables of the chosen detector and scheme. Mark the chosen detector in tables with all detectors. */
  function showTables(shown, data) {
    const wordsOf = Object.fromEntries(data.schemes.map(({ name, words }) => [name, words]));
    const chosen = wordsOf[shown.scheme];
    const others = Object.values(wordsOf).filter((words) => words !== chosen);
    const scrolls = [...document.querySelectorAll("main .scroll")].filter((each) => !each.closest("#viewer"));
    // A table that exists for one scheme only stays visible.
    const ofChosen = new Set(scrolls.filter((each) => each.dataset.scheme === chosen).map(kind));
    for (const scroll of scrolls) {
      const { detector, scheme } = scroll.dataset;
      const another = others.includes(scheme) && ofChosen.has(kind(scroll));
      scroll.closest(".block").hidden = another || Boolean(detector && detector !== shown.detector);
      showColumns(scroll.querySelector("table"), (words) => others.includes(words));
    }
    const { words } = data.detectors.find((each) => each.name === shown.detector);
    const texts = { detector: shown.detector, words: `${words}; ${chosen}`, judge: `${shown.detector}, ${chosen}` };
    for (const owned of document.querySelectorAll("main [data-shown]")) owned.textContent = texts[owned.dataset.shown];
    for (const row of document.querySelectorAll("main tr[data-of]")) {
      row.classList.toggle("chosen", row.dataset.of === shown.detector);
    }
    for (const head of document.querySelectorAll("main th[data-of]")) {
      const table = head.closest("table");
      const isChosen = head.dataset.of === shown.detector;
      const cells = [...table.tBodies].flatMap((body) => [...body.rows]).map((row) => row.cells[head.cellIndex]);
      [head, ...cells].forEach((cell) => cell?.classList.toggle("chosen", isChosen));
    }
  }

  /** Write the chosen detector's verdicts into the table of all recordings. */
  function showVerdicts(list, shown, data) {
    const { predicted_mm: predicted, outcome } = data.verdicts[`${shown.detector}|${shown.scheme}`];
    list.all.forEach((row) => {
      const place = Number(row.dataset.place);
      const [, , verdict, judged] = row.cells;
      const size = predicted[place];
      verdict.dataset.value = size ?? "";
      verdict.textContent = size === null ? "" : sizeWords(size);
      const words = data.outcomes[outcome[place]];
      row.dataset.outcome = judged.dataset.value = judged.textContent = words;
      judged.className = `outcome ${words.replaceAll(" ", "-")}`;
    });
  }

  /** Set up the switch. `onVerdicts` is called after the verdicts in the table of recordings change. */
  function setUp(list, shown, data, onVerdicts) {
    const form = document.getElementById("switches");
    const { detector, scheme } = form.elements;
    form.hidden = false;
    form.addEventListener("change", ({ target }) => shown.show({ [target.name]: target.value }));
    form.addEventListener("submit", (event) => event.preventDefault());
    let before = null;
    const update = (current) => {
      detector.value = current.detector;
      scheme.value = current.scheme;
      const key = `${current.detector}|${current.scheme}`;
      if (key === before) return;
      showTables(current, data);
      // The page already contains the verdicts of the first detector and the main scheme.
      if (before !== null || key !== `${data.detectors[0].name}|${data.main_scheme}`) {
        showVerdicts(list, current, data);
        onVerdicts();
      }
      before = key;
    };
    shown.onChange(update);
    update(shown.current());
  }

  return { setUp };
})(Elements);
