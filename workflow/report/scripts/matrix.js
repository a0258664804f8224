// Draw a matrix as shades over sensor and time, with the contours of a particle over it.

const Matrix = ((Signals, Palette) => {
  "use strict";

  const { atLeastTwoRows, contourSegments, highest } = Signals;
  const { themeColour } = Palette;

  const CONTOURS = [0.25, 0.5, 0.75];

  /** Draw the matrix as shades. `x` and `y` convert a column and a row to canvas coordinates. */
  function shade(context, matrix, x, y) {
    const rows = atLeastTwoRows(matrix);
    const [red, green, blue] = themeColour("shade").split(",").map(Number);
    const between = 24;
    const columns = rows[0].length;
    const lines = (rows.length - 1) * between + 1;
    const most = highest(rows) || 1;
    const image = new ImageData(columns, lines);
    for (let line = 0; line < lines; line += 1) {
      const row = Math.min(Math.floor(line / between), rows.length - 2);
      const part = line / between - row;
      for (let column = 0; column < columns; column += 1) {
        const value = (1 - part) * rows[row][column] + part * rows[row + 1][column];
        image.data.set([red, green, blue, Math.round((235 * value) / most)], 4 * (line * columns + column));
      }
    }
    const canvas = document.createElement("canvas");
    canvas.width = columns;
    canvas.height = lines;
    canvas.getContext("2d").putImageData(image, 0, 0);
    context.drawImage(canvas, x(0), y(0), x(columns - 1) - x(0), y(rows.length - 1) - y(0));
  }

  /** Draw the contours of a particle at fractions of its height. */
  function strokeContours(context, particle, x, y) {
    const rows = atLeastTwoRows(particle);
    const most = highest(rows);
    if (most <= 0) return;
    context.beginPath();
    for (const part of CONTOURS) {
      for (const [x0, y0, x1, y1] of contourSegments(rows, part * most)) {
        context.moveTo(x(x0), y(y0));
        context.lineTo(x(x1), y(y1));
      }
    }
    // A halo of the page's colour keeps the lines visible on every shade.
    context.strokeStyle = themeColour("paper");
    context.lineWidth = 3.5 * devicePixelRatio;
    context.stroke();
    context.strokeStyle = themeColour("contour");
    context.lineWidth = 1.4 * devicePixelRatio;
    context.stroke();
  }

  return { shade, strokeContours };
})(Signals, Palette);
