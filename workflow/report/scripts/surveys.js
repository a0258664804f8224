// Let a slider move through each survey: a mark on its picture, the readings, and the moment in words.

const AROUND_S = 30;

/** Return a function that draws the readings about a time, each sensor about its mean. */
function signalsDrawer(canvas, { rows: packed, from_s: from, every_s: every, distance }) {
  const rows = packed.map((each) => unpack(each)[0]);
  let chart = null;
  return (now) => {
    const first = Math.max(Math.floor((now - AROUND_S - from) / every), 0);
    const after = Math.max(Math.ceil((now + AROUND_S - from) / every) + 1, first + 2);
    chart?.destroy();
    chart = drawStacked(canvas, {
      time: evenly(after - first, from + first * every, every),
      rows: rows.map((row) => Array.from({ length: after - first }, (_, at) => row[first + at] ?? null)),
      distance,
      unit: "counts",
      height: 200,
      cursor: { show: false },
      scales: { x: { range: [now - AROUND_S, now + AROUND_S] } },
      marks: [{ x: now, colour: "ink", width: 1, dash: [2, 2] }],
    });
  };
}

/** Return a time in words: when, what the capsule does, all else, and the last event; and where the head is, null if anywhere. */
function momentOf(player, time) {
  const at = Math.round((time - player.from_s) / player.every_s);
  const [head, threshold, score, measured] = player.known.map((values) => values[at] ?? null);
  const where = head === null ? "Head anywhere" : `Head ${measured ? "at" : "near"} ${number(head, 1)} mm`;
  const judged = score === null ? "no score" : `score ${significant(score)}`;
  const held = threshold === null ? "" : `, threshold ${significant(threshold)}`;
  const [, does, reason] = player.states.findLast(([from]) => from <= time + 1e-3) ?? player.states[0];
  return {
    when: `${Math.floor(time / 60)} min ${String(Math.floor(time % 60)).padStart(2, "0")} s`,
    does,
    rest: `${where}${measured ? "" : ", position not measured"}; ${judged}${held}.`,
    reason,
    head,
  };
}

/** Put a line at a time and a mark at the head over a survey's picture. Return a function that moves them to a time and a head. */
function markPicture(stage, { size, map }, onTime) {
  const overlay = svgElement("svg", { class: "overlay", "aria-hidden": "true", viewBox: `0 0 ${size.join(" ")}` });
  stage.append(overlay);
  if (!map) return () => {};
  const [left, top, width, height] = map.box;
  const [[low, high], [last, first]] = [map.x, map.y];
  stage.addEventListener("click", (event) => {
    const box = overlay.getBoundingClientRect();
    const share = (((event.clientY - box.top) / box.height) * size[1] - top) / height;
    if (share >= 0 && share <= 1) onTime(60 * (first + share * (last - first)));
  });
  return (time, head) => {
    const x = left + ((head - low) / (high - low)) * width;
    const y = top + ((time / 60 - first) / (last - first)) * height;
    const now = svgElement("line", { x1: left, x2: size[0], y1: y, y2: y, class: "now" });
    overlay.replaceChildren(now, svgElement("circle", { cx: x, cy: y, r: 4, class: "head" }));
  };
}

/** Set up one survey. */
async function setUpSurvey(node) {
  const { player: packed, title, places, frame } = JSON.parse(node.textContent);
  const player = await inflated(packed);
  player.known = ["head", "threshold", "score", "measured"].map((name) => unpack(player[name])[0]);
  const id = `moment-${node.dataset.survey}`;
  const slider = element("input", { type: "range", min: player.from_s, max: player.until_s, step: player.step_s, id });
  const now = element("output", { class: "moment", for: id, "aria-live": "off" });
  const steps = element("div", { class: "steps" });
  const { figure, canvas } = chartFigure({
    title: "Readings",
    caption: "Half a minute before and after, about the mean of that minute, one sensor below the other. All sensors have one scale.",
  });
  const box = element("div", { class: "player" }, element("label", { for: id }, `Moment of the survey ${title}`), slider, steps, now, figure);
  node.before(box);

  const show = () => {
    const time = Number(slider.value);
    const { when, does, rest, reason, head } = momentOf(player, time);
    slider.setAttribute("aria-valuetext", `${when}: the capsule ${does}. ${rest}`);
    now.replaceChildren(element("strong", {}, `${when}: ${does}.`), ` ${rest}`);
    if (reason) now.append(element("span", { class: "reason" }, `Last event: ${reason}.`));
    canvas.setAttribute("aria-label", `Readings of ${player.signals.rows.length} sensors about ${when}.`);
    drawSignals(time);
    moveMarks(time, head);
  };
  const goTo = (time) => {
    if (time === undefined) return;
    slider.value = time;
    show();
  };
  const drawSignals = signalsDrawer(canvas, player.signals);
  const moveMarks = markPicture(node.closest("article").querySelector(".stage"), frame, goTo);
  const events = player.states.map(([at]) => at);
  steps.append(
    button("Previous event", `Previous event of the survey ${title}`, () => goTo(events.findLast((at) => at < slider.value - 1e-3))),
    button("Next event", `Next event of the survey ${title}`, () => goTo(events.find((at) => at > Number(slider.value) + 1e-3))),
    ...places.map((place) =>
      button(`Place ${place.number}`, `Go to the time at which the survey ${title} suspected place ${place.number}`, () => goTo(place.suspected_s)),
    ),
  );
  slider.addEventListener("input", show);
  onLook(box, show);
  // Begin at a nodule, which shows more than the start.
  goTo((places.find(({ status }) => status === "nodule") ?? places[0])?.suspected_s ?? player.from_s);
}

function setUpSurveys() {
  for (const node of document.querySelectorAll("script[data-survey]")) {
    const article = node.closest("article");
    article.setAttribute("aria-busy", "true");
    const done = () => article.removeAttribute("aria-busy");
    // A browser that is too old to unpack a survey shows its picture without the slider.
    setUpSurvey(node).then(done, done);
  }
}
