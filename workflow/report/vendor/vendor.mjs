// Copy what the report and its tests use out of node_modules, with the licences.
import { copyFileSync, mkdirSync } from "node:fs";

const copies = [
  ["uplot/dist/uPlot.iife.min.js", "uplot/uPlot.iife.min.js"],
  ["uplot/dist/uPlot.min.css", "uplot/uPlot.min.css"],
  ["uplot/LICENSE", "uplot/LICENSE"],
  ["axe-core/axe.min.js", "../../../tests/vendor/axe-core/axe.min.js"],
  ["axe-core/LICENSE", "../../../tests/vendor/axe-core/LICENSE"],
];

for (const [source, target] of copies) {
  mkdirSync(new URL(`./${target.slice(0, target.lastIndexOf("/"))}`, import.meta.url), {
    recursive: true,
  });
  copyFileSync(new URL(`./node_modules/${source}`, import.meta.url), new URL(target, import.meta.url));
  console.log(target);
}
