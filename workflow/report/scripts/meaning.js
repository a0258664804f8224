// Let a reader move the prevalence: odds after a verdict are odds before it times a ratio that does not change.

const Meaning = (() => {
  "use strict";

  /** Return a share at another prevalence; `odds` is the factor of the odds before the verdict. */
  function moved(share, odds) {
    return share === 1 ? 1 : (odds * share) / (1 - share + odds * share);
  }

  /** Return a share in 100, with a decimal near 0 and 100, which it never reaches by rounding. */
  function inHundred(share) {
    const count = 100 * share;
    if ((count >= 1.5 && count < 98.5) || count === 0 || count === 100) return count.toFixed(0);
    const text = count.toFixed(1).replace(/\.0$/, "");
    if (text === "0" || text === "100") return share < 0.5 ? "< 0.1" : "> 99.9";
    return text;
  }

  /** Set up the slider. */
  function setUp() {
    const place = document.getElementById("meaning");
    if (!place) return;
    const { prevalence, ppv, npv } = JSON.parse(place.dataset.values);
    const slider = document.getElementById("prevalence");
    slider.hidden = false;
    const write = (id, shares) => {
      const line = document.getElementById(id);
      const [value, low, high] = shares.map(inHundred);
      line.querySelector("strong").textContent = `${value} of 100`;
      line.querySelector("span").textContent = `(${low} to ${high})`;
    };
    slider.addEventListener("input", () => {
      const wanted = Number(slider.value) / 100;
      const odds = (wanted / (1 - wanted)) * ((1 - prevalence) / prevalence);
      document.getElementById("prevalence-shown").textContent = slider.value;
      if (ppv) write("ppv", ppv.map((share) => moved(share, odds)));
      if (npv) {
        const [value, low, high] = npv.map((share) => 1 - moved(share, 1 / odds));
        write("npv", [value, high, low]);
      }
    });
  }

  return { setUp };
})();
