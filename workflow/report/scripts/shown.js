// Show what the address names, such as #recording=3mm/r07&detector=diagonal; links, buttons and the choice of the scheme change it.

const TOO_OLD = "This browser is too old to unpack the signals; use a newer one. All else on this page is complete.";
const carried = new Map([...document.querySelectorAll("script[data-evidence]")].map((node) => [node.dataset.evidence, node]));

/** Return the data of a recording; it is deflated in the page. */
async function readEvidence(name) {
  const { drawn, judged } = JSON.parse(carried.get(name).textContent);
  return { ...(await inflated(drawn)), ...(await inflated(judged)) };
}

/** Return the address of what is shown. */
function addressOf(shown) {
  const parts = Object.entries(shown).filter(([, value]) => value);
  return `#${parts.map(([key, value]) => `${key}=${encodeURIComponent(value).replaceAll("%2F", "/")}`).join("&")}`;
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
  const choices = { recording: data.recordings, detector: data.detectors.map(({ name }) => name), scheme: data.schemes };
  const plain = { recording: null, detector: choices.detector[0], scheme: choices.scheme[0] };
  let redraw = () => {};
  let chosen = null;

  /** Return the valid parts of an address. */
  const parse = (hash) => {
    const named = [...new URLSearchParams(hash.slice(1))];
    return Object.fromEntries(named.filter(([key, value]) => Object.hasOwn(choices, key) && choices[key].includes(value)));
  };

  let shown = { ...plain, ...parse(location.hash) };

  const neighbours = () => {
    const rows = list.fitting().filter((row) => carried.has(row.dataset.recording));
    const current = rows.findIndex((row) => row.dataset.recording === chosen);
    return [rows[current - 1], rows[current + 1]];
  };

  const updateButtons = () => {
    const rows = neighbours();
    buttons.forEach((button, which) => (button.disabled = !rows[which]));
  };

  const draw = async () => {
    const turn = shown;
    chosen = shown.recording ?? viewer.dataset.first;
    updateButtons();
    document.querySelector("#recordings-table [aria-current]")?.removeAttribute("aria-current");
    list.of(chosen).setAttribute("aria-current", "true");
    viewer.setAttribute("aria-busy", "true");
    const evidence = await readEvidence(chosen).catch(() => null);
    // If several choices were made quickly, only the last one counts.
    if (turn !== shown) return;
    viewer.removeAttribute("aria-busy");
    if (evidence) redraw = showRecording(viewer, evidence, { ...shown, recording: chosen }, data);
    else viewer.replaceChildren(element("p", { class: "note" }, TOO_OLD));
  };

  const update = (wanted) => {
    shown = wanted;
    if (schemes) schemes.elements.scheme.value = shown.scheme;
    for (const part of document.querySelectorAll(".of-scheme")) part.hidden = part.dataset.scheme !== shown.scheme;
    draw();
  };

  /** Show something else. The browser's Back button returns to the former state. Default values go without saying. */
  const show = (wanted) => {
    const next = { ...shown, ...wanted };
    const named = Object.entries(next).filter(([key, value]) => value !== plain[key]);
    if (addressOf(next) !== addressOf(shown)) history.pushState(null, "", addressOf(Object.fromEntries(named)));
    update(next);
  };

  const bringIntoView = () => {
    // The row stands in the box of the table, right above.
    list.bringIntoView(list.of(chosen));
    title.scrollIntoView({ block: "center" });
    title.focus({ preventScroll: true });
  };

  addEventListener("hashchange", () => {
    const wanted = { ...plain, ...parse(location.hash) };
    // A link to an element of the page changes nothing.
    const isElement = location.hash && !/^#(recording|detector|scheme)=/.test(location.hash);
    if (isElement || addressOf(wanted) === addressOf(shown)) return;
    update(wanted);
    if (wanted.recording) bringIntoView();
  });
  // A link names the recording or the detector; all else stays.
  document.addEventListener("click", (event) => {
    const link = event.target.closest?.('a[href^="#recording="]');
    if (!link || event.ctrlKey || event.metaKey || event.shiftKey || event.button) return;
    event.preventDefault();
    show(parse(link.getAttribute("href")));
    bringIntoView();
  });
  // A button keeps the focus, so nothing scrolls.
  buttons.forEach((button, which) => button.addEventListener("click", () => show({ recording: neighbours()[which].dataset.recording })));
  if (schemes) {
    schemes.hidden = false;
    schemes.addEventListener("change", () => show({ scheme: schemes.elements.scheme.value }));
  }
  onLook(viewer, () => redraw());
  viewer.querySelector("details").addEventListener("toggle", () => redraw());
  list.onChange = updateButtons;
  byId("chosen").hidden = false;
  update(shown);
  if (shown.recording) bringIntoView();
}
