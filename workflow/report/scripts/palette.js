// The colours of the theme, and how the line of each sensor is drawn.

const Palette = (() => {
  "use strict";

  // As many as the style has colours for sensors; further sensors begin again at the first.
  const DASHES = [[], [8, 3], [2, 2], [9, 3, 2, 3], [5, 2, 1, 2, 1, 2]];

  /** Read a colour of the page's theme. */
  function themeColour(name) {
    return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  }

  /** Give colour and dash of a sensor's line, and its class in the style; sensors count from 0. */
  function sensorLine(sensor) {
    const line = sensor % DASHES.length;
    const className = `sensor-${line + 1}`;
    return { colour: themeColour(className), dash: DASHES[line], className };
  }

  return { themeColour, sensorLine };
})();
