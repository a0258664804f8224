// Treat tables as grids, also with cells that span rows and columns, and hide columns.

const Grid = (() => {
  "use strict";

  function textOf(cell) {
    return cell.textContent.replace(/\s+/g, " ").trim();
  }

  /** Return, for each row, the cell that covers each column. */
  function lay(rows) {
    const laid = rows.map(() => []);
    rows.forEach((row, at) => {
      let column = 0;
      for (const cell of row.cells) {
        while (laid[at][column]) column += 1;
        const wide = Number(cell.dataset.span ?? cell.colSpan);
        for (let down = 0; down < cell.rowSpan && at + down < rows.length; down += 1) {
          for (let across = 0; across < wide; across += 1) laid[at + down][column + across] = cell;
        }
        column += wide;
      }
    });
    return laid;
  }

  /** Return the titles of the columns, joined from their head cells, upper cells first. */
  function columnTitles(table) {
    const heads = lay([...(table.tHead?.rows ?? [])]);
    const count = Math.max(0, ...heads.map((row) => row.length));
    return Array.from({ length: count }, (_, column) => {
      const cells = [...new Set(heads.map((row) => row[column]).filter(Boolean))];
      return { title: cells.map(textOf).join(", "), leaf: cells.length ? textOf(cells[cells.length - 1]) : "" };
    });
  }

  /** Hide some columns of a table, and show all others. A cell over several columns shrinks. */
  function hideColumns(table, hidden) {
    const parts = [table.tHead, ...table.tBodies].filter(Boolean);
    for (const part of parts) {
      const covered = new Map();
      for (const row of lay([...part.rows])) {
        row.forEach((cell, column) => covered.set(cell, (covered.get(cell) ?? new Set()).add(column)));
      }
      for (const [cell, columns] of covered) {
        const left = [...columns].filter((column) => !hidden.has(column)).length;
        cell.hidden = left === 0;
        if (columns.size > 1) {
          cell.dataset.span = columns.size;
          cell.colSpan = Math.max(left, 1);
        }
      }
    }
  }

  return { lay, textOf, columnTitles, hideColumns };
})();
