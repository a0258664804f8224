// Choose the scheme by which the detectors are compared.

const Schemes = (() => {
  "use strict";

  /** Set up the choice, if the detectors are compared by more than one scheme. */
  function setUp(shown) {
    const form = document.getElementById("schemes");
    if (!form) return;
    const { scheme } = form.elements;
    form.hidden = false;
    form.addEventListener("change", () => shown.show({ scheme: scheme.value }));
    const update = (current) => {
      scheme.value = current.scheme;
      for (const part of document.querySelectorAll(".of-scheme")) part.hidden = part.dataset.scheme !== current.scheme;
    };
    shown.onChange(update);
    update(shown.current());
  }

  return { setUp };
})();
