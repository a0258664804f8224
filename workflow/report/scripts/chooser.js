// Choose the recording to show, by a link, by the address, or with the buttons Previous and Next, and read its data.

const Chooser = ((Elements, Palette, Viewer) => {
  "use strict";

  const nodes = [...document.querySelectorAll("script[data-evidence]")];
  const carried = new Map(nodes.map((node) => [node.dataset.evidence, node]));
  const TOO_OLD = "This browser is too old to unpack the signals; use a newer one. All else on this page is complete.";

  /** Return the data of a recording; it is deflated in the page. */
  async function read(name) {
    const { drawn, judged } = Elements.readData(carried.get(name));
    return { ...(await Elements.inflated(drawn)), ...(await Elements.inflated(judged)) };
  }

  /** Let a reader choose from the rows of the table. Return a function to call when the rows change. */
  function setUp(list, shown, data) {
    const viewer = document.getElementById("viewer");
    if (!viewer) return () => {};
    const title = document.getElementById("viewer-title");
    const buttons = [document.getElementById("previous"), document.getElementById("next")];
    let chosen = null;
    let asked = 0;
    let redraw = () => {};

    const neighbours = () => {
      const visible = list.fitting().filter((row) => carried.has(row.dataset.recording));
      const current = visible.findIndex((row) => row.dataset.recording === chosen);
      return [visible[current - 1], current < 0 ? visible[0] : visible[current + 1]];
    };

    const update = () => {
      const rows = neighbours();
      buttons.forEach((button, which) => (button.disabled = !rows[which]));
      document.querySelector("#recordings-table [aria-current]")?.removeAttribute("aria-current");
      list.of(chosen)?.setAttribute("aria-current", "true");
    };

    const draw = async () => {
      const current = shown.current();
      chosen = current.recording ?? viewer.dataset.first;
      const wanted = { ...current, recording: chosen };
      update();
      viewer.setAttribute("aria-busy", "true");
      asked += 1;
      const turn = asked;
      const evidence = await read(chosen).catch(() => null);
      // If several choices were made quickly, only the last one counts.
      if (turn !== asked) return;
      viewer.removeAttribute("aria-busy");
      title.textContent = `${chosen}: ${evidence ? Viewer.titleOf(evidence, current.detector) : "no signals"}`;
      if (evidence) redraw = Viewer.show(viewer, evidence, wanted, data);
      else viewer.replaceChildren(Elements.element("p", "note", TOO_OLD));
    };

    const bringIntoView = () => {
      // The row stands in the box of the table, right above.
      list.bringIntoView(list.of(chosen));
      title.scrollIntoView({ block: "center" });
      title.focus({ preventScroll: true });
    };

    shown.onChange((_, change) => {
      draw();
      if (change.byAddress) bringIntoView();
    });
    // A button keeps the focus, so nothing scrolls.
    buttons.forEach((button, which) => button.addEventListener("click", () => shown.show({ recording: neighbours()[which].dataset.recording })));
    Palette.onChange(viewer, () => redraw());
    draw();
    if (shown.named) bringIntoView();
    return update;
  }

  return { setUp, read };
})(Elements, Palette, Viewer);
