// Choosing one recording to look at: by its link, its address, or the next and the previous.

const Chooser = ((Palette, Viewer, Elements) => {
  "use strict";

  const { readData } = Elements;

  /** Let a reader choose from the table; `onChosen` hears of it. Gives what is to be called when its rows change. */
  function setUp(table, shown, data, onChosen) {
    const viewer = document.getElementById("viewer");
    if (!viewer) return () => {};
    const title = document.getElementById("viewer-title");
    const previous = document.getElementById("previous");
    const next = document.getElementById("next");
    const carried = new Map(
      [...document.querySelectorAll("script[data-evidence]")].map((node) => [node.dataset.evidence, node]),
    );
    let chosen = null;
    let redraw = () => {};

    const neighbours = () => {
      const visible = [...table.tBodies[0].rows].filter((row) => !row.hidden && carried.has(row.dataset.recording));
      const current = visible.findIndex((row) => row.dataset.recording === chosen);
      return [visible[current - 1], current < 0 ? visible[0] : visible[current + 1]];
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

    const draw = () => {
      const current = shown.current();
      const wanted = current.recording ?? viewer.dataset.first;
      if (!carried.has(wanted)) return;
      if (wanted !== chosen) onChosen(wanted);
      chosen = wanted;
      const evidence = readData(carried.get(chosen));
      title.textContent = `${chosen}: ${Viewer.titleOf(evidence, current, data)}`;
      redraw = Viewer.show(viewer, evidence, { ...current, recording: chosen }, data);
      update();
    };

    const bringIntoView = () => {
      title.scrollIntoView({ block: "start" });
      title.focus({ preventScroll: true });
    };

    const step = (which) => {
      const row = neighbours()[which];
      // The button keeps the focus.
      if (row) shown.show({ recording: row.dataset.recording });
    };

    shown.onChange((_, change) => {
      draw();
      if (change.byAddress) bringIntoView();
    });
    previous.addEventListener("click", () => step(0));
    next.addEventListener("click", () => step(1));
    Palette.onThemeChange(() => redraw());
    let width = viewer.clientWidth;
    new ResizeObserver(() => {
      if (viewer.clientWidth !== width) {
        width = viewer.clientWidth;
        redraw();
      }
    }).observe(viewer);
    draw();
    if (shown.named) bringIntoView();
    return update;
  }

  return { setUp };
})(Palette, Viewer, Elements);
