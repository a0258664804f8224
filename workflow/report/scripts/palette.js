// The colours of the theme, and how the line of each sensor is drawn.

const Palette = (() => {
  "use strict";

  // A line a sensor, told apart by colour and by dash; further sensors begin again at the first.
  const LINES = [
    { light: "#08306b", dark: "#7db8f0", dash: [] },
    { light: "#b34500", dark: "#ff9a57", dash: [8, 3] },
    { light: "#1f6b52", dark: "#63d0a8", dash: [2, 2] },
    { light: "#8a4fa3", dark: "#d3a2ea", dash: [9, 3, 2, 3] },
    { light: "#5f5f5f", dark: "#b9b9b9", dash: [5, 2, 1, 2, 1, 2] },
  ];
  // The same condition as in the style, where all other colours of the theme stand.
  const dark = matchMedia("screen and (prefers-color-scheme: dark)");
  // While the page is being printed: its charts are dark on white, and as wide as paper.
  const PRINTING = "printing";
  const root = document.documentElement;

  /** Read a colour of the page's theme. */
  function themeColour(name) {
    return getComputedStyle(root).getPropertyValue(`--${name}`).trim();
  }

  /** Give colour and dash of a sensor's line; sensors count from 0. */
  function sensorLine(sensor) {
    const line = LINES[sensor % LINES.length];
    return { colour: dark.matches && !root.classList.contains(PRINTING) ? line.dark : line.light, dash: line.dash };
  }

  /** Call a function whenever the theme changes, on paper too. */
  function onThemeChange(call) {
    dark.addEventListener("change", call);
    for (const [event, printing] of [["beforeprint", true], ["afterprint", false]]) {
      addEventListener(event, () => {
        root.classList.toggle(PRINTING, printing);
        call();
      });
    }
  }

  return { themeColour, sensorLine, onThemeChange };
})();
