// Keep what the page shows, write it into the address, such as #recording=3mm/r07&detector=diagonal, and call the listeners.

const Shown = (() => {
  "use strict";

  const KEYS = ["recording", "detector", "scheme"];

  /** Return the keys and values of an address; null if it names an element of the page. */
  function parse(hash) {
    const named = new URLSearchParams(hash.slice(1));
    const known = KEYS.filter((key) => named.get(key)).map((key) => [key, named.get(key)]);
    return known.length ? Object.fromEntries(known) : null;
  }

  /** Return the address of what is shown; keys without a value are left out. */
  function format(shown) {
    const escaped = (text) => encodeURIComponent(text).replaceAll("%2F", "/");
    const parts = KEYS.filter((key) => shown[key]).map((key) => `${key}=${escaped(shown[key])}`);
    return `#${parts.join("&")}`;
  }

  /** Set up the state, beginning with the address. `data` is the page's data on all recordings. */
  function setUp(data) {
    const listeners = [];
    const plain = { recording: null, detector: data.detectors[0]?.name ?? null, scheme: data.schemes[0] ?? null };
    const known = {
      recording: (name) => data.recordings.includes(name),
      detector: (name) => data.detectors.some((each) => each.name === name),
      scheme: (name) => data.schemes.includes(name),
    };
    let shown = { ...plain };

    /** Apply the valid parts of an address. What it does not name returns to the defaults, except the recording. */
    const take = (address) => {
      const named = Object.entries(address).filter(([key, value]) => known[key](value));
      shown = { ...plain, recording: shown.recording, ...Object.fromEntries(named) };
    };

    const tell = (change) => listeners.forEach((listener) => listener(shown, change));

    /** Return the address of something to show, without default values. */
    const addressOf = (wanted) => {
      const named = Object.entries({ ...shown, ...wanted }).filter(([key, value]) => value !== plain[key]);
      return format(Object.fromEntries(named));
    };

    /** Show something else. The browser's Back button returns to the former state. */
    const show = (wanted, change = {}) => {
      const before = shown;
      shown = { ...shown, ...wanted };
      if (Object.keys(shown).every((key) => shown[key] === before[key])) return;
      history.pushState({ shown }, "", addressOf({}));
      tell(change);
    };

    // Back and Forward return to what was shown. A link to an element of the page does not change what is shown.
    window.addEventListener("hashchange", () => {
      const address = parse(location.hash);
      if (history.state?.shown) shown = history.state.shown;
      else if (address) take(address);
      history.replaceState({ shown }, "");
      tell({ byAddress: Boolean(address?.recording) });
    });
    // A link names the recording; the chosen detector stays.
    document.addEventListener("click", (event) => {
      const link = event.target.closest?.('a[href^="#recording="]');
      if (!link || event.ctrlKey || event.metaKey || event.shiftKey || event.button) return;
      event.preventDefault();
      const wanted = parse(link.getAttribute("href"));
      const target = addressOf(Object.fromEntries(Object.entries(wanted).filter(([key, value]) => known[key](value))));
      if (target === location.hash) window.dispatchEvent(new HashChangeEvent("hashchange"));
      else location.hash = target;
    });

    const first = parse(location.hash);
    if (first) take(first);
    history.replaceState({ shown }, "");
    return {
      current: () => shown,
      named: Boolean(first?.recording),
      show,
      onChange: (listener) => listeners.push(listener),
    };
  }

  return { setUp, format };
})();
