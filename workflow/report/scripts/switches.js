// Switch detector and scheme in all sections that show the verdicts of one detector.

const Switches = ((Elements, Grid, Tools) => {
  "use strict";

  const { element, sizeWords } = Elements;

  /** Return a selection of detectors or schemes. */
  function choice(title, options, onChange) {
    const label = element("label", "", `${title} `);
    const select = element("select");
    for (const { name, text } of options) {
      const option = element("option", "", text);
      option.value = name;
      select.append(option);
    }
    select.addEventListener("change", () => onChange(select.value));
    label.append(select);
    return { label, select };
  }

  /** Return a name that tables share if they differ only in detector or scheme. */
  function kind(block) {
    return block.querySelector("table").id.replace(/-\d+$/, "");
  }

  /** Move the tables of the other detectors next to the table of the first. */
  function gather() {
    const last = new Map();
    for (const block of document.querySelectorAll("main .block:has(> .scroll[data-detector])")) {
      const before = last.get(kind(block));
      if (before) before.after(block);
      last.set(kind(block), block);
    }
    for (const emptied of document.querySelectorAll("details.other-rates")) emptied.remove();
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
      const table = scroll.querySelector("table");
      const leaves = Grid.columnTitles(table).map(({ leaf }) => leaf);
      const of = (test) => leaves.flatMap((leaf, column) => (test(leaf) ? [column] : []));
      const [out, back] = [of((leaf) => others.includes(leaf)), of((leaf) => leaf === chosen)];
      if (out.length + back.length) {
        Tools.toggleColumns(table, back, true);
        Tools.toggleColumns(table, out, false);
      }
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
    gather();
    const form = element("form", "switches");
    form.setAttribute("aria-label", "Detector and scheme of the verdicts shown");
    const detector = choice(
      "Detector",
      data.detectors.map(({ name }) => ({ name, text: name })),
      (name) => shown.show({ detector: name }),
    );
    const scheme = choice(
      "Scheme",
      data.schemes.map(({ name, words }) => ({ name, text: words })),
      (name) => shown.show({ scheme: name }),
    );
    form.append(detector.label, scheme.label);
    form.addEventListener("submit", (event) => event.preventDefault());
    document.querySelector("nav").append(form);
    let before = null;
    const update = (current) => {
      detector.select.value = current.detector;
      scheme.select.value = current.scheme;
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
})(Elements, Grid, Tools);
