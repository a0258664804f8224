// Draw the capsule to scale: its hexagons with awns, open or folded.

const SurveyCapsule = ((Elements, Palette) => {
  "use strict";

  const { svgElement } = Elements;

  function pathOf(points, close) {
    return points.map(([x, y], at) => `${at ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`).join("") + (close ? "Z" : "");
  }

  /**
   * Return a drawing of the capsule at a moment.
   * `scale` converts a position in mm to x, `unit` is the length of 1 mm, and `middle` is the y of the axis.
   */
  function draw(capsule, { head, folded, measured }, { scale, unit, middle, width = 1.5 }) {
    const group = svgElement("g", { class: measured ? "capsule" : "capsule guessed" });
    // Folding makes the capsule narrower. The true shape of folded hexagons was not measured.
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
