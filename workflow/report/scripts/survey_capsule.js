// The capsule as it is built: four hexagons with their awns, open or folded, to scale.

const SurveyCapsule = ((Elements, Palette) => {
  "use strict";

  const { svgElement } = Elements;

  function pathOf(points, close) {
    return points.map(([x, y], at) => `${at ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("") + (close ? "Z" : "");
  }

  /**
   * Draw the capsule with its head at a place.
   * `scale` turns a place in mm into x, `unit` is the length of a mm, `middle` the y of its axis.
   */
  function draw(capsule, { head, folded, measured }, { scale, unit, middle, width = 1.5 }) {
    const group = svgElement("g", { class: measured ? "capsule" : "capsule guessed" });
    // Folding draws the awns in; how its hexagons then lie nobody has measured.
    const part = folded ?? 0;
    const narrow = 1 - part * (1 - capsule.folded_half_mm / capsule.half_width_mm);
    for (let sensor = capsule.sensors - 1; sensor >= 0; sensor -= 1) {
      const at = ([x, y]) => [scale(head - sensor * capsule.pitch_mm + x), middle - unit * narrow * y];
      const { colour } = Palette.sensorLine(sensor);
      const look = { stroke: colour, "stroke-width": width, "data-sensor": sensor + 1 };
      group.append(
        svgElement("path", { d: pathOf(capsule.hexagon.map(at), true), class: "hexagon", fill: colour, ...look }),
        ...capsule.awns.map((awn) => svgElement("path", { d: pathOf(awn.map(at), false), class: "awn", ...look })),
      );
    }
    return group;
  }

  return { draw, pathOf };
})(Elements, Palette);
