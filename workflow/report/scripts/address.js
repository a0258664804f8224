// What is shown stands in the page's address, so that a link shows the same: #recording=3mm/r07&detector=diagonal

const Address = (() => {
  "use strict";

  const KEYS = ["recording", "detector", "scheme"];

  /** Undo the escapes of an address; text that is no such escape stays as it is. */
  function decoded(text) {
    try {
      return decodeURIComponent(text);
    } catch {
      return text;
    }
  }

  /** Read an address; null for one that names an ordinary place of the page. */
  function parse(hash) {
    const parts = hash.replace(/^#/, "").split("&").map((part) => part.split("="));
    const known = parts.filter(([key, value]) => KEYS.includes(key) && value);
    return known.length ? Object.fromEntries(known.map(([key, value]) => [key, decoded(value)])) : null;
  }

  /** Write an address; what is not given is left out. */
  function format(shown) {
    const escaped = (text) => encodeURIComponent(text).replaceAll("%2F", "/");
    const parts = KEYS.filter((key) => shown[key]).map((key) => `${key}=${escaped(shown[key])}`);
    return `#${parts.join("&")}`;
  }

  return { parse, format };
})();
