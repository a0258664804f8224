// Link the first occurrence of each term to the glossary.

const Glossary = (() => {
  "use strict";

  const TEXT = "p, li, figcaption, caption, td, th, h4";
  // Other scripts write into these. A link inside would be lost, or would divide a text that they replace.
  const OWNED = "#viewer, #recordings-table, output";
  const APART = `${OWNED}, a, button, code, pre, blockquote, .terms, #configuration`;

  /** Yield the page's text nodes in order. */
  function* pieces() {
    const { SHOW_ELEMENT, SHOW_TEXT, FILTER_ACCEPT, FILTER_REJECT } = NodeFilter;
    const apart = (node) => (node.nodeType === Node.ELEMENT_NODE && node.matches(APART) ? FILTER_REJECT : FILTER_ACCEPT);
    const walker = document.createTreeWalker(document.querySelector("main"), SHOW_ELEMENT | SHOW_TEXT, apart);
    while (walker.nextNode()) {
      const { currentNode } = walker;
      if (currentNode.nodeType === Node.TEXT_NODE && currentNode.parentElement.closest(TEXT)) yield currentNode;
    }
  }

  /** Link each term once. */
  function setUp() {
    const wanted = [...document.querySelectorAll(".terms dt[data-words]")].map((term) => ({
      term,
      pattern: new RegExp(`(?<![\\w-])(?:${term.dataset.words})(?![\\w-])`, "i"),
    }));
    const texts = [...pieces()];
    for (const { term, pattern } of wanted) {
      const at = texts.findIndex((text) => pattern.test(text.data));
      if (at < 0) continue;
      const found = pattern.exec(texts[at].data);
      const word = texts[at].splitText(found.index);
      const rest = word.splitText(found[0].length);
      const link = document.createElement("a");
      link.className = "term";
      link.href = `#${term.id}`;
      link.title = term.nextElementSibling.textContent;
      word.replaceWith(link);
      link.append(word);
      texts.splice(at + 1, 0, rest);
    }
  }

  return { setUp };
})();
