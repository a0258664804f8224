// Unpack the page's signals, and compute contours. This module draws nothing.

const Signals = (() => {
  "use strict";

  /** Return the rows of values of packed numbers; a missing sample is null. */
  function unpack(packed) {
    return packed.rows.map((row) => {
      let sum = 0;
      return row.map((difference) => {
        if (difference === null) return null;
        sum += difference;
        return packed.low + packed.scale * sum;
      });
    });
  }

  /** Return the recording's matrix: by how much the envelope exceeds the threshold (eq. ReLU). */
  function matrixOf({ envelope, threshold }) {
    return unpack(envelope).map((row) => row.map((value) => Math.max((value ?? 0) - threshold, 0)));
  }

  /** Return a particle's height over a recording (eq. G), in rows. Where surfaces overlap, the higher one counts. */
  function surfaceRows(surface, sensors, columns, every) {
    const { amplitude, vertical, peak, horizontal } = surface;
    const bell = (distance, spread) => Math.exp(-0.5 * (distance / spread) ** 2);
    return Array.from({ length: sensors }, (_, row) => {
      const heights = amplitude.map((height, s) => height * bell(row - s, vertical[s]));
      return Array.from({ length: columns }, (__, column) => {
        const sample = column * every;
        if (sample < surface.from || sample >= surface.to) return 0;
        return Math.max(...heights.map((height, s) => height * bell(sample - peak[s], horizontal[s])));
      });
    });
  }

  /** Return the largest value of some rows, or 0 if there is none. */
  function highest(rows) {
    return rows.reduce((sofar, row) => row.reduce((most, value) => Math.max(most, value), sofar), 0);
  }

  /** Return the rows, a single one twice, because contours need two rows. */
  function atLeastTwoRows(rows) {
    return rows.length > 1 ? rows : [rows[0], rows[0]];
  }

  /**
   * Return the contour of a matrix at one height, computed by marching squares.
   * The segments are [column, row, column, row], in fractions of columns and rows, counted from 0.
   */
  function contourSegments(rows, level) {
    const segments = [];
    for (let row = 0; row + 1 < rows.length; row += 1) {
      for (let column = 0; column + 1 < rows[row].length; column += 1) {
        const corners = [
          [column, row, rows[row][column]],
          [column + 1, row, rows[row][column + 1]],
          [column + 1, row + 1, rows[row + 1][column + 1]],
          [column, row + 1, rows[row + 1][column]],
        ];
        const crossings = [];
        for (let side = 0; side < 4; side += 1) {
          const [x0, y0, a] = corners[side];
          const [x1, y1, b] = corners[(side + 1) % 4];
          if (a >= level !== b >= level) {
            const part = (level - a) / (b - a);
            crossings.push([x0 + part * (x1 - x0), y0 + part * (y1 - y0)]);
          }
        }
        // Two crossings are one segment. Four crossings are a saddle, drawn as two segments.
        for (let first = 0; first + 1 < crossings.length; first += 2) {
          segments.push([...crossings[first], ...crossings[first + 1]]);
        }
      }
    }
    return segments;
  }

  return { unpack, matrixOf, surfaceRows, highest, atLeastTwoRows, contourSegments };
})();
