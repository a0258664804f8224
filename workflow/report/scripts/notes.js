// Keep the reader's notes on recordings in this browser, and save them as CSV.

const Notes = ((Elements, Saving) => {
  "use strict";

  const { element } = Elements;
  const PREFIX = "capsule-note:";

  /** Return a store of texts in the browser. If the browser refuses, the texts last until the page is closed. */
  function openStore() {
    try {
      const probe = `${PREFIX}probe`;
      localStorage.setItem(probe, "1");
      localStorage.removeItem(probe);
      return { lasting: true, get: (key) => localStorage.getItem(key), set: keep };
    } catch {
      const held = new Map();
      return { lasting: false, get: (key) => held.get(key) ?? null, set: (key, text) => held.set(key, text) };
    }
  }

  function keep(key, text) {
    if (text) localStorage.setItem(key, text);
    else localStorage.removeItem(key);
  }

  /** Set up the notes on this report's recordings. Return a function that shows the note on one recording. */
  function setUp(list, { report, checksums }) {
    const store = openStore();
    const keyOf = (name) => `${PREFIX}${report}:${name}:${checksums[name]}`;
    const read = (name) => {
      try {
        const kept = JSON.parse(store.get(keyOf(name)) ?? "null");
        return typeof kept?.note === "string" ? kept : { note: "", written: "" };
      } catch {
        return { note: "", written: "" };
      }
    };
    const names = Object.keys(checksums);
    const box = element("div", "notes");
    const label = element("label", "", "Note");
    const field = element("textarea");
    field.rows = 2;
    field.id = "note";
    label.htmlFor = field.id;
    const save = element("button");
    save.type = "button";
    const state = element("output");
    state.setAttribute("role", "status");
    const row = element("p");
    row.append(save, " ", state);
    box.append(label, field, row);
    document.querySelector(".chosen-head").after(box);
    let shown = null;
    const noted = new Set(names.filter((name) => read(name).note));
    const home = store.lasting
      ? "Kept in this browser only."
      : "This browser keeps no notes for this page. Save them before you close it.";

    const mark = (line, name) => {
      const cell = line.cells[0];
      cell.querySelector(".noted")?.remove();
      if (noted.has(name)) cell.append(element("span", "noted", " note"));
    };
    const count = () => {
      save.textContent = `Save notes as CSV (${noted.size})`;
      save.disabled = noted.size === 0;
    };

    const keepNote = () => {
      const note = field.value.trim();
      try {
        store.set(keyOf(shown), note && JSON.stringify({ note, written: new Date().toISOString() }));
        state.textContent = home;
      } catch {
        state.textContent = "This note could not be kept: the browser’s storage is full.";
        return;
      }
      if (note) noted.add(shown);
      else noted.delete(shown);
      mark(list.of(shown), shown);
      count();
    };
    field.addEventListener("input", keepNote);
    field.addEventListener("change", keepNote);
    save.addEventListener("click", () => {
      const rows = names.filter((name) => noted.has(name)).map((name) => [name, read(name).note, read(name).written]);
      Saving.saveCsv([["recording", "note", "written"], ...rows], "notes.csv");
    });
    for (const name of noted) mark(list.of(name), name);
    count();
    return (name) => {
      shown = name;
      label.textContent = `Your note on ${name}`;
      field.value = read(name).note;
      state.textContent = home;
    };
  }

  return { setUp };
})(Elements, Saving);
