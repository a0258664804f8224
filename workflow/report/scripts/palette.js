// Read the colours of the theme, and define the line of each sensor.

const Palette = (() => {
  "use strict";

  // One dash per sensor, with the colours s0 to s4 of report.css. Further sensors begin again at the first line.
  const DASHES = [[], [8, 3], [2, 2], [9, 3, 2, 3], [5, 2, 1, 2, 1, 2]];
  const dark = matchMedia("(prefers-color-scheme: dark)");
  // The class of the page while it is printed; then charts are dark on white, and as wide as the paper.
  const PRINTING = "printing";
  const root = document.documentElement;
  const probe = document.body.appendChild(document.createElement("i"));
  probe.hidden = true;

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

  /** Call a function whenever the theme, also for printing, or the width of an element changes. */
  function onChange(element, call) {
    let width = element.clientWidth;
    new ResizeObserver(() => {
      if (element.clientWidth === width) return;
      width = element.clientWidth;
      call();
    }).observe(element);
    dark.addEventListener("change", call);
    for (const [event, printing] of [["beforeprint", true], ["afterprint", false]]) {
      addEventListener(event, () => {
        root.classList.toggle(PRINTING, printing);
        call();
      });
    }
  }

  return { themeColour, sensorLine, onChange };
})();
