// Draw over a survey's picture: a line at the current time, and the capsule to scale.

const SurveyOverlay = ((Elements, SurveyCapsule) => {
  "use strict";

  const { svgElement } = Elements;

  /** Put a drawing over a survey's picture. Return a function that moves it to a moment. */
  function setUp(stage, survey, onTime) {
    const image = stage.querySelector("img");
    const overlay = svgElement("svg", { class: "overlay", "aria-hidden": "true" });
    stage.append(overlay);

    // The browser chooses between the wide and the narrow picture.
    const frameOf = () => {
      const narrow = image.currentSrc === stage.querySelector("source").srcset;
      return survey.frames[narrow ? "narrow" : "wide"];
    };

    const moveTo = (moment) => {
      const { size, map, evidence } = frameOf();
      overlay.setAttribute("viewBox", `0 0 ${size.join(" ")}`);
      if (!map) return;
      const within = ([low, high], value) => (value - low) / (high - low);
      const y = map.box[1] + within([map.y[1], map.y[0]], moment.time / 60) * map.box[3];
      const unit = map.box[2] / (map.x[1] - map.x[0]);
      const scale = (mm) => map.box[0] + (mm - map.x[0]) * unit;
      const line = (box) => svgElement("line", { x1: box[0], x2: box[0] + box[2], y1: y, y2: y, class: "now" });
      overlay.replaceChildren(
        line(map.box),
        ...(evidence ? [line(evidence.box)] : []),
        svgElement("circle", { cx: scale(moment.head - 9), cy: y, r: 9, class: "ring" }),
        SurveyCapsule.draw(survey.player.capsule, moment, { scale, unit, middle: y, width: 0.4 }),
      );
    };

    stage.addEventListener("click", (event) => {
      const { map, size } = frameOf();
      if (!map) return;
      const box = overlay.getBoundingClientRect();
      const at = ((event.clientY - box.top) / box.height) * size[1];
      const share = (at - map.box[1]) / map.box[3];
      if (share >= 0 && share <= 1) onTime(60 * (map.y[1] + share * (map.y[0] - map.y[1])));
    });
    return moveTo;
  }

  return { setUp };
})(Elements, SurveyCapsule);
