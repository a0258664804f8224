// Let a slider move through each survey: a mark on its picture, the readings, and the moment in words.

const Surveys = ((Signals, Palette, ChartFrame, Elements) => {
  "use strict";

  const { makeChart, drawScaleBar, evenly, roundLength, sensorsBelow, strokeLine } = ChartFrame;
  const { button, element, number, readData, significant, svgElement } = Elements;
  const AROUND_S = 30;

  /** Return the span of values that 90 % of the pieces of one minute do not exceed. */
  function usualSpan(rows, perMinute) {
    const spans = [];
    for (const row of rows) {
      for (let from = 0; from + perMinute <= row.length; from += perMinute) {
        const known = row.slice(from, from + perMinute).filter((value) => value !== null);
        if (known.length) spans.push(Math.max(...known) - Math.min(...known));
      }
    }
    spans.sort((a, b) => a - b);
    return spans[Math.floor(0.9 * spans.length)] || 1;
  }

  /** Set up a chart. Return functions to move it to a time and to draw it again. */
  function setUpSignals(container, signals, startTime) {
    const rows = signals.rows.map((packed) => Signals.unpack(packed)[0]);
    const distance = 1.1 * usualSpan(rows, Math.max(Math.round((2 * AROUND_S) / signals.every_s), 1));
    let now = startTime;

    const about = (time) => {
      const first = Math.max(Math.floor((time - AROUND_S - signals.from_s) / signals.every_s), 0);
      const after = Math.max(Math.ceil((time + AROUND_S - signals.from_s) / signals.every_s) + 1, first + 2);
      const times = evenly(after - first, signals.from_s + first * signals.every_s, signals.every_s);
      const shifted = rows.map((row, sensor) => {
        const piece = Array.from({ length: after - first }, (_, at) => row[first + at] ?? null);
        const known = piece.filter((value) => value !== null);
        const mean = known.reduce((sum, value) => sum + value, 0) / Math.max(known.length, 1);
        return piece.map((value) => (value === null ? null : value - mean - sensor * distance));
      });
      return [times, ...shifted];
    };

    const make = () => {
      const lowest = -(rows.length - 0.4) * distance;
      const options = {
        cursor: { show: false },
        scales: {
          x: { time: false, range: () => [now - AROUND_S, now + AROUND_S] },
          y: { range: () => [lowest, 0.6 * distance] },
        },
        ...sensorsBelow(rows.length, distance),
        draw: (chart) => {
          drawScaleBar(chart, roundLength(0.7 * distance), "counts", -(rows.length - 1) * distance);
          strokeLine(chart, [now, lowest], [now, 0.6 * distance], { colour: "ink", dash: [2, 2] });
        },
      };
      return makeChart(container, 200, "sensor", options, about(now));
    };

    let chart = make();
    return {
      moveTo(time) {
        now = time;
        chart.setData(about(time));
      },
      redraw() {
        chart.destroy();
        chart = make();
      },
    };
  }

  /** Return the index of the last entry that begins at or before a time; -1 before the first. */
  function lastAt(entries, time) {
    return entries.findLastIndex(([from]) => from <= time);
  }

  /** Return the value of a line of points [s, value] at a time; null without a point. Beyond its ends, the line is constant. */
  function valueAt(points, time) {
    if (!points.length) return null;
    const before = lastAt(points, time);
    if (before < 0) return points[0][1];
    const [[from, value], next] = [points[before], points[before + 1]];
    if (!next) return value;
    return value + ((time - from) / (next[0] - from)) * (next[1] - value);
  }

  /** Return all values at a time. */
  function momentOf(player, time) {
    const [, state, reason] = player.states[Math.max(lastAt(player.states, time + 1e-3), 0)];
    return {
      time,
      state,
      reason,
      head: valueAt(player.head, time),
      measured: !player.unknown.some(([from, until]) => from - 1e-6 <= time && time <= until + 1e-6),
      score: player.scores[Math.round((time - player.from_s) / player.judged_s)] ?? null,
      threshold: valueAt(player.threshold, time),
    };
  }

  function clock(time) {
    return `${Math.floor(time / 60)} min ${String(Math.floor(time % 60)).padStart(2, "0")} s`;
  }

  /** Return a moment in words. */
  function wordsOf(player, moment) {
    const where = moment.head === null ? "head anywhere" : `${moment.measured ? "head at" : "head near"} ${number(moment.head, 1)} mm`;
    const unknown = moment.measured ? "" : ", position not measured";
    const judged = moment.score === null ? "no score" : `score ${significant(moment.score)}`;
    const held = moment.threshold === null ? "" : `, threshold ${significant(moment.threshold)}`;
    return { when: clock(moment.time), does: player.words[moment.state], rest: `${where}${unknown}; ${judged}${held}.`, reason: moment.reason };
  }

  /** Put a line at a time and a mark at the head over a survey's picture. Return a function that moves them to a moment. */
  function markPicture(stage, { size, map, evidence }, onTime) {
    const overlay = svgElement("svg", { class: "overlay", "aria-hidden": "true", viewBox: `0 0 ${size.join(" ")}` });
    stage.append(overlay);
    if (!map) return () => {};
    stage.addEventListener("click", (event) => {
      const box = overlay.getBoundingClientRect();
      const at = ((event.clientY - box.top) / box.height) * size[1];
      const share = (at - map.box[1]) / map.box[3];
      if (share >= 0 && share <= 1) onTime(60 * (map.y[1] + share * (map.y[0] - map.y[1])));
    });
    const within = ([low, high], value) => (value - low) / (high - low);
    return ({ time, head }) => {
      const x = map.box[0] + within(map.x, head) * map.box[2];
      const y = map.box[1] + within([map.y[1], map.y[0]], time / 60) * map.box[3];
      const line = ([left, , width]) => svgElement("line", { x1: left, x2: left + width, y1: y, y2: y, class: "now" });
      overlay.replaceChildren(
        line(map.box),
        ...(evidence ? [line(evidence.box)] : []),
        svgElement("circle", { cx: x, cy: y, r: 4, class: "head" }),
      );
    };
  }

  /** Set up one survey. */
  async function setUpOne(node) {
    const { player: packed, title, places, frame } = readData(node);
    const player = await Elements.inflated(packed);
    player.scores = Signals.unpack(player.score)[0] ?? [];
    const box = element("div", "player");
    const label = element("label", "", `Moment of the survey ${title}`);
    const slider = element("input");
    const name = node.dataset.survey;
    Object.assign(slider, { type: "range", min: player.from_s, max: player.until_s, step: player.step_s, id: `moment-${name}` });
    label.htmlFor = slider.id;
    const steps = element("div", "steps");
    const now = element("output", "moment");
    now.setAttribute("for", slider.id);
    now.setAttribute("aria-live", "off");
    const { figure, canvas } = Elements.chartFigure({
      title: "Readings",
      caption:
        "Half a minute before and after, in counts relative to the mean of that minute, one sensor below the other. All " +
        "sensors have the scale of the bar.",
      description: "",
    });
    box.append(label, slider, steps, now, figure);
    node.before(box);

    const goTo = (time) => {
      slider.value = time;
      show();
    };
    const moveMarks = markPicture(node.closest("article").querySelector(".stage"), frame, goTo);
    const signals = setUpSignals(canvas, player.signals, player.from_s);
    const show = () => {
      const moment = momentOf(player, Number(slider.value));
      const { when, does, rest, reason } = wordsOf(player, moment);
      slider.setAttribute("aria-valuetext", `${when}: the capsule ${does}; ${rest}`);
      now.replaceChildren(element("strong", "", `${when}: ${does}.`), ` ${rest[0].toUpperCase()}${rest.slice(1)}`, ...(reason ? [element("span", "reason", `Last event: ${reason}.`)] : []));
      canvas.setAttribute("aria-label", `Readings of ${player.signals.rows.length} sensors about ${when}.`);
      signals.moveTo(moment.time);
      moveMarks(moment);
    };
    const toEvent = (which) => {
      const time = Number(slider.value);
      const times = player.states.map(([at]) => at);
      const wanted = which > 0 ? times.find((at) => at > time + 1e-3) : times.findLast((at) => at < time - 1e-3);
      if (wanted !== undefined) goTo(wanted);
    };
    steps.append(
      button("Previous event", `Previous event of the survey ${title}`, () => toEvent(-1)),
      button("Next event", `Next event of the survey ${title}`, () => toEvent(1)),
      ...places.map((place) =>
        button(`Place ${place.number}`, `Go to the time at which the survey ${title} suspected place ${place.number}`, () => goTo(place.suspected_s)),
      ),
    );
    slider.addEventListener("input", show);
    Palette.onChange(box, signals.redraw);
    // Begin at a nodule, which shows more than the start.
    const first = places.find(({ status }) => status === "nodule") ?? places[0];
    goTo(first ? first.suspected_s : player.from_s);
  }

  function setUp() {
    for (const node of document.querySelectorAll("script[data-survey]")) {
      const article = node.closest("article");
      article.setAttribute("aria-busy", "true");
      const done = () => article.removeAttribute("aria-busy");
      // A browser that is too old to unpack a survey shows its picture without the slider.
      setUpOne(node).then(done, done);
    }
  }

  return { setUp };
})(Signals, Palette, ChartFrame, Elements);
