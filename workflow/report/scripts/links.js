// Wherever the page names a recording that it draws, the name leads to the drawing.

const Links = ((Address, Elements) => {
  "use strict";

  const { element } = Elements;

  /** Turn a name that stands alone in its element into a link. */
  function setUp(names) {
    for (const node of document.querySelectorAll("main code, main th, main td, main dd, main li")) {
      if (node.children.length) continue;
      const text = node.textContent.trim();
      const name = text.replace(/^raw\/(.+)\.csv$/, "$1");
      // The look into the set is quick, and rules out nearly all.
      if (!names.has(name) || node.closest("a, #viewer, #recordings-table")) continue;
      const link = element("a", "", text);
      link.href = Address.format({ recording: name });
      node.replaceChildren(link);
    }
  }

  return { setUp };
})(Address, Elements);
