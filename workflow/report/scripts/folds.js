// Open a fold if the address names an element in it.

const Folds = (() => {
  "use strict";

  /** Open all folds around an element, including itself. */
  function reveal(element) {
    for (let fold = element?.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  }

  /** Open the folds that the address names, now and after each change. */
  function setUp() {
    const named = () => {
      const target = document.getElementById(location.hash.slice(1));
      if (!target?.closest("details")) return;
      reveal(target);
      target.scrollIntoView();
    };
    addEventListener("hashchange", named);
    named();
  }

  return { setUp };
})();
