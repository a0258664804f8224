// Turn the names of recordings on the page into links to their drawings.

const Links = ((Address, Elements) => {
  "use strict";

  const { element } = Elements;

  /** Turn each name that is the whole text of its element into a link. */
  function setUp(names) {
    for (const node of document.querySelectorAll("main code, main th, main td, main dd, main li")) {
      if (node.children.length) continue;
      const text = node.textContent.trim();
      const name = text.replace(/^raw\/(.+)\.csv$/, "$1");
      // Look into the set first: it is fast, and excludes nearly all elements.
      if (!names.has(name) || node.closest("a, #viewer, #recordings-table")) continue;
      const link = element("a", "", text);
      link.href = Address.format({ recording: name });
      node.replaceChildren(link);
    }
  }

  return { setUp };
})(Address, Elements);
