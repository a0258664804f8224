// Draw the gut around the capsule to scale, and below it space and time around the moment.

const SurveyCloseup = ((Elements, SurveyTime, SurveyCapsule) => {
  "use strict";

  const { number, svgElement } = Elements;
  const { crests, halfLumen, momentOf } = SurveyTime;
  const { draw, pathOf } = SurveyCapsule;
  const [LEFT, RIGHT, AXIS] = [52, 12, 40];
  const ROOM_MM = 33;
  const AROUND_S = 20;
  // Room above the gut for the numbers of the places.
  const ABOVE = 28;
  const TIME_HEIGHT = 190;

  function text(x, y, words, attributes = {}) {
    const made = svgElement("text", { x, y, ...attributes });
    made.textContent = words;
    return made;
  }

  /** Return the path in a window of time as lines, each with one look. */
  function pathsIn(player, [from, until]) {
    const times = player.head.map(([time]) => time).filter((time) => time > from && time < until);
    const changes = [...player.states.map(([time]) => time), ...player.unknown.flat()];
    const all = [from, ...times, ...changes.filter((time) => time > from && time < until), until];
    const moments = [...new Set(all)].sort((a, b) => a - b);
    const lines = [];
    for (let at = 0; at + 1 < moments.length; at += 1) {
      const [here, there] = [moments[at], moments[at + 1]];
      if (there <= player.from_s || here >= player.until_s) continue;
      const { state, measured } = momentOf(player, (here + there) / 2);
      const look = `${player.groups[state]}${measured ? "" : " guessed"}`;
      const points = [here, there].map((time) => [momentOf(player, time).head, time]);
      if (lines.at(-1)?.look === look) lines.at(-1).points.push(points[1]);
      else lines.push({ look, points });
    }
    return lines;
  }

  function placeMark(place, x, y) {
    const shapes = {
      confirmed: () => svgElement("circle", { cx: x, cy: y, r: 5, class: "pin filled" }),
      dismissed: () => svgElement("circle", { cx: x, cy: y, r: 5, class: "pin" }),
      undecided: () => svgElement("path", { d: `M${x} ${y - 6}L${x + 6} ${y}L${x} ${y + 6}L${x - 6} ${y}Z`, class: "pin" }),
    };
    return shapes[place.status]();
  }

  /** Return the drawing of one moment of a survey, with a width in pixels. */
  function drawMoment(survey, time, width, words) {
    const { player, places } = survey;
    const now = momentOf(player, time);
    const inner = width - LEFT - RIGHT;
    const span = inner > 480 ? 120 : 64;
    const unit = inner / span;
    // The capsule, which is 25 mm long, is in the middle.
    const low = now.head - 0.5 * span - 9;
    const scale = (mm) => LEFT + (mm - low) * unit;
    const strip = ROOM_MM * unit;
    const top = ABOVE + strip + 20;
    const height = top + TIME_HEIGHT + AXIS;
    const y = (s) => top + ((s - time + AROUND_S) / (2 * AROUND_S)) * TIME_HEIGHT;
    const picture = svgElement("svg", { class: "closeup", viewBox: `0 0 ${width} ${height}`, width, height, role: "img", "aria-label": words });
    const clip = `clip-${survey.name}`;
    const edge = svgElement("clipPath", { id: clip });
    edge.append(svgElement("rect", { x: LEFT, y: 0, width: inner, height: top + TIME_HEIGHT }));
    const inside = svgElement("g", { "clip-path": `url(#${clip})` });
    const window = [time - AROUND_S, time + AROUND_S];

    // The gut's walls, as the drive positions them.
    const columns = Array.from({ length: 97 }, (_, at) => low + (span * at) / 96);
    const middle = ABOVE + strip / 2;
    for (const side of [-1, 1]) {
      const outer = middle + side * (strip / 2);
      const wall = columns.map((mm) => [scale(mm), middle + side * unit * halfLumen(player, now.wave, mm)]);
      inside.append(svgElement("path", { d: pathOf([[LEFT, outer], ...wall, [width - RIGHT, outer]], true), class: "wall" }));
    }
    // Space and time around the moment.
    inside.append(svgElement("rect", { x: LEFT, y: top, width: inner, height: TIME_HEIGHT, class: "field" }));
    for (const line of crests(player, window, [low, low + span])) {
      inside.append(svgElement("path", { d: pathOf(line.map(([mm, s]) => [scale(mm), y(s)]), false), class: "crest" }));
    }
    const shown = places.filter(({ place_mm: at }) => at > low && at < low + span);
    for (const place of shown) {
      const x = scale(place.place_mm);
      inside.append(svgElement("line", { x1: x, x2: x, y1: ABOVE / 2, y2: top + TIME_HEIGHT, class: "place" }));
    }
    inside.append(svgElement("line", { x1: LEFT, x2: width - RIGHT, y1: y(time), y2: y(time), class: "now" }));
    for (const { look, points } of pathsIn(player, window)) {
      inside.append(svgElement("path", { d: pathOf(points.map(([mm, s]) => [scale(mm), y(s)]), false), class: `way ${look}` }));
    }
    const x = scale(now.head);
    inside.append(
      svgElement("line", { x1: x, x2: x, y1: middle, y2: y(time), class: "drop" }),
      draw(player.capsule, now, { scale, unit, middle }),
      svgElement("circle", { cx: x, cy: y(time), r: 4, class: "head" }),
    );
    picture.append(edge, inside);
    for (const place of shown) {
      const at = scale(place.place_mm);
      const near = at > width - 90;
      picture.append(
        placeMark(place, at, ABOVE / 2 - 2),
        text(near ? at - 10 : at + 10, ABOVE / 2 + 2, `place ${place.number}`, { "text-anchor": near ? "end" : "start" }),
      );
    }
    drawAxes(picture, { low, span, scale, width, y, time, top });
    return picture;
  }

  function drawAxes(picture, { low, span, scale, width, y, time, top }) {
    const bottom = top + TIME_HEIGHT;
    for (let mm = Math.ceil(low / 20) * 20; mm <= low + span; mm += 20) {
      picture.append(
        svgElement("line", { x1: scale(mm), x2: scale(mm), y1: bottom, y2: bottom + 4, class: "tick" }),
        text(scale(mm), bottom + 17, number(mm), { "text-anchor": "middle" }),
      );
    }
    for (let s = Math.ceil((time - AROUND_S) / 10) * 10; s <= time + AROUND_S; s += 10) {
      if (s < 0) continue;
      picture.append(
        svgElement("line", { x1: LEFT - 4, x2: LEFT, y1: y(s), y2: y(s), class: "tick" }),
        text(LEFT - 7, y(s) + 4, number(s), { "text-anchor": "end" }),
      );
    }
    picture.append(
      text((LEFT + width - RIGHT) / 2, bottom + 34, "distance along the gut (mm)", { "text-anchor": "middle" }),
      text(0, 0, "time (s)", { transform: `translate(11 ${top + TIME_HEIGHT / 2}) rotate(-90)`, "text-anchor": "middle" }),
    );
  }

  return { drawMoment };
})(Elements, SurveyTime, SurveyCapsule);
