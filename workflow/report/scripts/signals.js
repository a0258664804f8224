// Unpack the page's signals. This module draws nothing.

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

  /** Return the largest value of some rows, or 0 if there is none. */
  function highest(rows) {
    return rows.reduce((sofar, row) => row.reduce((most, value) => Math.max(most, value), sofar), 0);
  }

  return { unpack, matrixOf, highest };
})();
