// Folds open where an address leads into one, and all of them on paper.

const Folds = (() => {
  "use strict";

  /** Open a fold, or all that an element lies in. */
  function reveal(element) {
    for (let fold = element?.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  }

  /** Open what the address names, now and whenever it changes; open all while the page is printed. */
  function setUp() {
    const named = () => {
      const target = document.getElementById(location.hash.slice(1));
      if (!target?.closest("details")) return;
      reveal(target);
      target.scrollIntoView();
    };
    addEventListener("hashchange", named);
    named();
    let closed = [];
    addEventListener("beforeprint", () => {
      closed = [...document.querySelectorAll("main details:not([open], .columns)")];
      closed.forEach((fold) => fold.setAttribute("open", ""));
    });
    addEventListener("afterprint", () => closed.forEach((fold) => fold.removeAttribute("open")));
  }

  return { setUp };
})();
