// Keep what the page shows in its address, such as #recording=3mm/r07&detector=diagonal, and call the listeners.

const Shown = (() => {
  "use strict";

  /** Return the address of what is shown. */
  function format(shown) {
    const parts = Object.entries(shown).filter(([, value]) => value);
    return `#${parts.map(([key, value]) => `${key}=${encodeURIComponent(value).replaceAll("%2F", "/")}`).join("&")}`;
  }

  /** Set up the state, beginning with the address. `data` is the page's data on all recordings. */
  function setUp(data) {
    const choices = { recording: data.recordings, detector: data.detectors.map(({ name }) => name), scheme: data.schemes };
    const plain = { recording: null, detector: choices.detector[0] ?? null, scheme: choices.scheme[0] ?? null };
    const listeners = [];
    let shown = plain;

    /** Return the valid parts of an address. */
    const parse = (hash) => {
      const named = new URLSearchParams(hash.slice(1));
      return Object.fromEntries([...named].filter(([key, value]) => Object.hasOwn(choices, key) && choices[key].includes(value)));
    };

    const tell = (change) => listeners.forEach((listener) => listener(shown, change));

    /** Show something else. The browser's Back button returns to the former state. */
    const show = (wanted, change = {}) => {
      if (Object.keys(wanted).some((key) => shown[key] !== wanted[key])) {
        shown = { ...shown, ...wanted };
        // Default values go without saying.
        const named = Object.entries(shown).filter(([key, value]) => value !== plain[key]);
        history.pushState({ shown }, "", format(Object.fromEntries(named)));
      } else if (!change.byAddress) return;
      tell(change);
    };

    // Back and Forward return to what was shown. What a typed address does not name returns to the defaults, except the
    // recording; a link to an element of the page changes nothing.
    addEventListener("hashchange", () => {
      const named = parse(location.hash);
      const isState = /^#(recording|detector|scheme)=/.test(location.hash);
      shown = history.state?.shown ?? (isState ? { ...plain, recording: shown.recording, ...named } : shown);
      history.replaceState({ shown }, "");
      tell({ byAddress: Boolean(named.recording) });
    });
    // A link names the recording or the detector; all else stays.
    document.addEventListener("click", (event) => {
      const link = event.target.closest?.('a[href^="#recording="]');
      if (!link || event.ctrlKey || event.metaKey || event.shiftKey || event.button) return;
      event.preventDefault();
      show(parse(link.getAttribute("href")), { byAddress: true });
    });

    const first = parse(location.hash);
    shown = { ...plain, ...first };
    history.replaceState({ shown }, "");
    return { current: () => shown, named: Boolean(first.recording), show, onChange: (listener) => listeners.push(listener) };
  }

  return { setUp, format };
})();
