// Read the colours of the theme, and define the line of each sensor.

const Palette = (() => {
  "use strict";

  // One line per sensor, with its own colour and dash. Further sensors begin again at the first line.
  const LINES = [
    { light: "#08306b", dark: "#7db8f0", dash: [] },
    { light: "#b34500", dark: "#ff9a57", dash: [8, 3] },
    { light: "#1f6b52", dark: "#63d0a8", dash: [2, 2] },
    { light: "#8a4fa3", dark: "#d3a2ea", dash: [9, 3, 2, 3] },
    { light: "#5f5f5f", dark: "#b9b9b9", dash: [5, 2, 1, 2, 1, 2] },
  ];
  // The same condition as in report.css, which defines all other colours.
  const dark = matchMedia("screen and (prefers-color-scheme: dark)");
  // The class of the page while it is printed; then charts are dark on white, and as wide as the paper.
  const PRINTING = "printing";
  const root = document.documentElement;

  /** Return a colour of the page's theme. */
  function themeColour(name) {
    return getComputedStyle(root).getPropertyValue(`--${name}`).trim();
  }

  /** Return colour and dash of a sensor's line; sensors count from 0. */
  function sensorLine(sensor) {
    const line = LINES[sensor % LINES.length];
    return { colour: dark.matches && !root.classList.contains(PRINTING) ? line.dark : line.light, dash: line.dash };
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
