// What the page shows: recording, detector and scheme; the address says it, and whoever draws it is told.

const Shown = ((Address) => {
  "use strict";

  /** Begin with the address; `data` is what the page carries of all recordings. */
  function setUp(data) {
    const listeners = [];
    const plain = { recording: null, detector: data.detectors[0]?.name ?? null, scheme: data.main_scheme };
    const known = {
      recording: (name) => Object.hasOwn(data.checksums, name),
      detector: (name) => data.detectors.some((each) => each.name === name),
      scheme: (name) => data.schemes.some((each) => each.name === name),
    };
    let shown = { ...plain };

    /** Take over what an address names and the page has; what it does not name is as at first. */
    const take = (address) => {
      const named = Object.entries(address).filter(([key, value]) => known[key](value));
      shown = { ...plain, recording: shown.recording, ...Object.fromEntries(named) };
    };

    const tell = (change) => listeners.forEach((listener) => listener(shown, change));

    /** Write the address of something to show; what is as at first stays out of it. */
    const addressOf = (wanted) => {
      const named = Object.entries({ ...shown, ...wanted }).filter(([key, value]) => value !== plain[key]);
      return Address.format(Object.fromEntries(named));
    };

    /** Show something else, and let the reader come back to this by the browser's Back. */
    const show = (wanted, change = {}) => {
      const before = shown;
      shown = { ...shown, ...wanted };
      if (Object.keys(shown).every((key) => shown[key] === before[key])) return;
      history.pushState({ shown }, "", addressOf({}));
      tell(change);
    };

    // Back and Forward return to what was shown there; a link to a place of the page changes nothing of it.
    window.addEventListener("hashchange", () => {
      const address = Address.parse(location.hash);
      if (history.state?.shown) shown = history.state.shown;
      else if (address) take(address);
      history.replaceState({ shown }, "");
      tell({ byAddress: Boolean(address?.recording) });
    });
    // A link names the recording; the detector stays the one that was chosen.
    document.addEventListener("click", (event) => {
      const link = event.target.closest?.('a[href^="#recording="]');
      if (!link || event.ctrlKey || event.metaKey || event.shiftKey || event.button) return;
      event.preventDefault();
      const wanted = Address.parse(link.getAttribute("href"));
      const target = addressOf(Object.fromEntries(Object.entries(wanted).filter(([key, value]) => known[key](value))));
      if (target === location.hash) window.dispatchEvent(new HashChangeEvent("hashchange"));
      else location.hash = target;
    });

    const first = Address.parse(location.hash);
    if (first) take(first);
    history.replaceState({ shown }, "");
    return {
      current: () => shown,
      named: Boolean(first?.recording),
      show,
      onChange: (listener) => listeners.push(listener),
    };
  }

  return { setUp };
})(Address);
