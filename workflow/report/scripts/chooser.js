// Choose the recording to show, by a link, by the address, or with the buttons Previous and Next, and read its data.

const Chooser = ((Elements, Palette, Viewer) => {
  "use strict";

  const { element } = Elements;
  const nodes = [...document.querySelectorAll("script[data-evidence]")];
  const carried = new Map(nodes.map((node) => [node.dataset.evidence, node]));

  /** Return the data of a recording; it is deflated in the page. */
  async function read(name) {
    const { drawn, judged } = Elements.readData(carried.get(name));
    return { ...(await Elements.inflated(drawn)), ...(await Elements.inflated(judged)) };
  }

  const TOO_OLD = "This browser is too old to unpack the signals; use a newer one. All else on this page is complete.";

  /** Let a reader choose from the rows of the table. Return a function to call when the rows change. */
  function setUp(list, shown, data) {
    const viewer = document.getElementById("viewer");
    if (!viewer) return () => {};
    const title = document.getElementById("viewer-title");
    const previous = document.getElementById("previous");
    const next = document.getElementById("next");
    let chosen = null;
    let asked = 0;
    let marked = null;
    let redraw = () => {};

    const neighbours = () => {
      const visible = list.fitting().filter((row) => carried.has(row.dataset.recording));
      const current = visible.findIndex((row) => row.dataset.recording === chosen);
      return [visible[current - 1], current < 0 ? visible[0] : visible[current + 1]];
    };

    const update = () => {
      const [before, after] = neighbours();
      previous.disabled = !before;
      next.disabled = !after;
      marked?.removeAttribute("aria-current");
      marked = list.of(chosen);
      marked?.setAttribute("aria-current", "true");
    };

    const draw = () => {
      const current = shown.current();
      const wanted = current.recording ?? viewer.dataset.first;
      if (!carried.has(wanted)) return;
      chosen = wanted;
      update();
      asked += 1;
      const turn = asked;
      const drawn = (change) => (content) => {
        // If several recordings were requested quickly, only the last request counts.
        if (turn !== asked) return;
        viewer.removeAttribute("aria-busy");
        change(content);
      };
      const show = (evidence) => {
        title.textContent = `${wanted}: ${Viewer.titleOf(evidence, current.detector)}`;
        redraw = Viewer.show(viewer, evidence, { ...current, recording: wanted }, data);
      };
      const explain = () => {
        title.textContent = `${wanted}: no signals`;
        viewer.replaceChildren(element("p", "note", TOO_OLD));
        redraw = () => {};
      };
      viewer.setAttribute("aria-busy", "true");
      read(wanted).then(drawn(show), drawn(explain));
    };

    const bringIntoView = () => {
      // The row stands in the box of the table, right above.
      list.bringIntoView(list.of(chosen));
      title.scrollIntoView({ block: "center" });
      title.focus({ preventScroll: true });
    };

    const step = (which) => {
      const row = neighbours()[which];
      // Do not scroll: the button keeps the focus.
      if (row) shown.show({ recording: row.dataset.recording });
    };

    shown.onChange((_, change) => {
      draw();
      if (change.byAddress) bringIntoView();
    });
    previous.addEventListener("click", () => step(0));
    next.addEventListener("click", () => step(1));
    Palette.onChange(viewer, () => redraw());
    draw();
    if (shown.named) bringIntoView();
    return update;
  }

  return { setUp, read };
})(Elements, Palette, Viewer);
