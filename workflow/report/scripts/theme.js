// Colours of the theme.

const probe = document.body.appendChild(element("i", { hidden: "" }));

/** Return a colour of the page's theme. */
function themeColour(name) {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

/** Return the colour of a sensor's line; sensors count from 0. Further ones begin again at the first of the five in report.css. */
function sensorColour(sensor) {
  return themeColour(`s${sensor % 5}`);
}

/** Call a function whenever the theme, also for printing, or the width of a part of the page changes. */
function onLook(part, call) {
  let width = part.clientWidth;
  new ResizeObserver(() => {
    if (part.clientWidth === width) return;
    width = part.clientWidth;
    call();
  }).observe(part);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", call);
  // While the page is printed, charts are dark on white, and as wide as the paper.
  for (const [event, printing] of [["beforeprint", true], ["afterprint", false]]) {
    addEventListener(event, () => {
      document.documentElement.classList.toggle("printing", printing);
      call();
    });
  }
}
