// Show what the address names, such as #recording=3mm/r07&detector=diagonal; links, buttons and the choice of the scheme change it.

const TOO_OLD = "This browser is too old to unpack the signals; use a newer one. All else on this page is complete.";
const carried = new Map([...document.querySelectorAll("script[data-evidence]")].map((node) => [node.dataset.evidence, node]));

/** Return the data of a recording; it is deflated in the page. */
async function readEvidence(name) {
  const { drawn, judged } = JSON.parse(carried.get(name).textContent);
  return { ...(await inflated(drawn)), ...(await inflated(judged)) };
}

/** Return the address that names values, each by its key. */
function addressOf(shown) {
  return `#${Object.entries(shown).map(([key, value]) => `${key}=${encodeURIComponent(value).replaceAll("%2F", "/")}`).join("&")}`;
}

/** Open the folds around an element that the address names. */
function openFolds() {
  const target = byId(location.hash.slice(1));
  if (!target?.closest("details")) return;
  for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  target.scrollIntoView();
}

/** Set up what is shown. `data` is the page's data on all recordings, `list` their table. */
function setUpShown(data, list) {
  const [viewer, title, schemes] = [byId("viewer"), byId("viewer-title"), byId("schemes")];
  const buttons = [byId("previous"), byId("next")];
  const choices = { recording: [...carried.keys()], detector: data.detectors.map(({ name }) => name), scheme: data.schemes };
  const plain = { recording: viewer.dataset.first, detector: choices.detector[0], scheme: choices.scheme[0] };
  let redraw = () => {};

  /** Return the valid parts of an address. */
  const parse = (address) => {
    const named = [...new URLSearchParams(address.slice(1))];
    return Object.fromEntries(named.filter(([key, value]) => Object.hasOwn(choices, key) && choices[key].includes(value)));
  };

  const named = parse(location.hash);
  let shown = { ...plain, ...named };

  const neighbours = () => {
    const rows = list.fitting().filter((row) => carried.has(row.dataset.recording));
    const current = rows.indexOf(list.of(shown.recording));
    return [rows[current - 1], rows[current + 1]];
  };

  const updateButtons = () => {
    const rows = neighbours();
    buttons.forEach((button, which) => (button.disabled = !rows[which]));
  };

  const draw = async () => {
    const turn = shown;
    if (schemes) schemes.elements.scheme.value = shown.scheme;
    for (const part of document.querySelectorAll(".of-scheme")) part.hidden = part.dataset.scheme !== shown.scheme;
    updateButtons();
    document.querySelector("#recordings-table [aria-current]")?.removeAttribute("aria-current");
    list.of(shown.recording).setAttribute("aria-current", "true");
    viewer.setAttribute("aria-busy", "true");
    const evidence = await readEvidence(shown.recording).catch(() => null);
    // If several choices were made quickly, only the last one counts.
    if (turn !== shown) return;
    viewer.removeAttribute("aria-busy");
    if (evidence) redraw = showRecording(viewer, evidence, shown, data);
    else viewer.replaceChildren(element("p", { class: "note" }, TOO_OLD));
  };

  const bringIntoView = () => {
    // The row stands in the box of the table, right above.
    list.bringIntoView(list.of(shown.recording));
    title.scrollIntoView({ block: "center" });
    title.focus({ preventScroll: true });
  };

  /** Show something else. The address names it, where default values go without saying; the state in the history names all. */
  const show = (wanted, change) => {
    shown = { ...shown, ...wanted };
    const said = Object.entries(shown).filter(([key, value]) => value !== plain[key]);
    history[change](addressOf(shown), "", addressOf(Object.fromEntries(said)));
    draw();
  };

  // The browser went to a former state; or it followed a link, which names the recording or the detector: all else stays.
  addEventListener("popstate", ({ state }) => {
    const wanted = parse(state ?? location.hash);
    // A link to an element of the page changes nothing.
    if (!Object.keys(wanted).length) history.replaceState(addressOf(shown), "");
    else show(wanted, "replaceState");
    if (!state && wanted.recording) bringIntoView();
  });
  // A button keeps the focus, so nothing scrolls.
  buttons.forEach((button, which) =>
    button.addEventListener("click", () => show({ recording: neighbours()[which].dataset.recording }, "pushState")),
  );
  if (schemes) {
    schemes.hidden = false;
    schemes.addEventListener("change", () => show({ scheme: schemes.elements.scheme.value }, "pushState"));
  }
  onLook(viewer, () => redraw());
  viewer.querySelector("details").addEventListener("toggle", () => redraw());
  list.onChange = updateButtons;
  byId("chosen").hidden = false;
  history.replaceState(addressOf(shown), "");
  draw();
  if (named.recording) bringIntoView();
}
