// Colours of the theme, and the line of each sensor.

// One dash per sensor, with the colours s0 to s4 of report.css. Further sensors begin again at the first line.
const DASHES = [[], [8, 3], [2, 2], [9, 3, 2, 3], [5, 2, 1, 2, 1, 2]];
const probe = document.body.appendChild(element("i", { hidden: "" }));

/** Return a colour of the page's theme. */
function themeColour(name) {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

/** Return colour and dash of a sensor's line; sensors count from 0. */
function sensorLine(sensor) {
  const line = sensor % DASHES.length;
  return { colour: themeColour(`s${line}`), dash: DASHES[line] };
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
