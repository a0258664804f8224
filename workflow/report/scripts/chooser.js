// Choosing one recording to look at: by its link, its address, or the next and the previous.

const Chooser = ((Palette, Viewer) => {
  "use strict";

  /** Read what the page carries as JSON in an element. */
  function readData(node) {
    return JSON.parse(node.textContent);
  }

  /** Let a reader choose from the table; gives what is to be called when its rows change. */
  function setUp(table) {
    const viewer = document.getElementById("viewer");
    const title = document.getElementById("viewer-title");
    const previous = document.getElementById("previous");
    const next = document.getElementById("next");
    const { sizes } = readData(document.getElementById("page-data"));
    const carried = new Map(
      [...document.querySelectorAll("script[data-evidence]")].map((node) => [node.dataset.evidence, node]),
    );
    let chosen = null;
    let redraw = () => {};

    const neighbours = () => {
      const shown = [...table.tBodies[0].rows].filter((row) => !row.hidden && carried.has(row.dataset.recording));
      const current = shown.findIndex((row) => row.dataset.recording === chosen);
      return [shown[current - 1], current < 0 ? shown[0] : shown[current + 1]];
    };

    const update = () => {
      const [before, after] = neighbours();
      previous.disabled = !before;
      next.disabled = !after;
      for (const row of table.tBodies[0].rows) {
        if (row.dataset.recording === chosen) row.setAttribute("aria-current", "true");
        else row.removeAttribute("aria-current");
      }
    };

    const choose = (recording) => {
      if (!carried.has(recording) || recording === chosen) return;
      chosen = recording;
      const evidence = readData(carried.get(recording));
      title.textContent = `${recording}: ${evidence.title}`;
      redraw = Viewer.show(viewer, evidence, sizes);
      update();
    };

    const chooseByAddress = () => {
      const match = /^#recording=(.+)$/.exec(decodeURIComponent(location.hash));
      if (!match) return false;
      choose(match[1]);
      title.scrollIntoView({ block: "start" });
      title.focus({ preventScroll: true });
      return true;
    };

    const step = (which) => {
      const row = neighbours()[which];
      if (!row) return;
      // Not by the address: the button keeps the focus, and the history stays short.
      choose(row.dataset.recording);
      history.replaceState(null, "", `#recording=${encodeURIComponent(row.dataset.recording)}`);
    };

    previous.addEventListener("click", () => step(0));
    next.addEventListener("click", () => step(1));
    window.addEventListener("hashchange", chooseByAddress);
    Palette.onThemeChange(() => redraw());
    let width = viewer.clientWidth;
    new ResizeObserver(() => {
      if (viewer.clientWidth !== width) {
        width = viewer.clientWidth;
        redraw();
      }
    }).observe(viewer);
    if (!chooseByAddress() && carried.size) choose(viewer.dataset.first);
    return update;
  }

  return { setUp };
})(Palette, Viewer);
