// Read and write what the page shows in its address, so that a link shows the same: #recording=3mm/r07&detector=diagonal

const Address = (() => {
  "use strict";

  const KEYS = ["recording", "detector", "scheme"];

  /** Return a text with percent escapes decoded; return it unchanged if they are invalid. */
  function decoded(text) {
    try {
      return decodeURIComponent(text);
    } catch {
      return text;
    }
  }

  /** Return the keys and values of an address; null if it names an element of the page. */
  function parse(hash) {
    const parts = hash.replace(/^#/, "").split("&").map((part) => part.split("="));
    const known = parts.filter(([key, value]) => KEYS.includes(key) && value);
    return known.length ? Object.fromEntries(known.map(([key, value]) => [key, decoded(value)])) : null;
  }

  /** Return the address of what is shown; keys without a value are left out. */
  function format(shown) {
    const escaped = (text) => encodeURIComponent(text).replaceAll("%2F", "/");
    const parts = KEYS.filter((key) => shown[key]).map((key) => `${key}=${escaped(shown[key])}`);
    return `#${parts.join("&")}`;
  }

  return { parse, format };
})();
