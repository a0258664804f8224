// Let a slider move the capsule through each survey.

const Surveys = ((Elements, Palette, Signals, SurveyTime, SurveyCloseup, SurveySignals, SurveyOverlay) => {
  "use strict";

  const { button, element, number, readData, significant } = Elements;
  const { momentOf } = SurveyTime;

  function clock(time) {
    return `${Math.floor(time / 60)} min ${String(Math.floor(time % 60)).padStart(2, "0")} s`;
  }

  /** Return a moment in words. */
  function wordsOf(player, moment) {
    const where = `${moment.measured ? "head at" : "head near"} ${number(moment.head, 1)} mm`;
    const unknown = moment.measured ? "" : ", position not measured";
    const judged = moment.score === null ? "no score" : `score ${significant(moment.score)}`;
    const held = moment.threshold === null ? "" : `, threshold ${significant(moment.threshold)}`;
    return { when: clock(moment.time), does: player.words[moment.state], rest: `${where}${unknown}; ${judged}${held}.`, reason: moment.reason };
  }

  /** Set up one survey. */
  function setUpOne(node) {
    const survey = readData(node);
    const { player, title, places } = survey;
    player.scores = Signals.unpack(player.score)[0] ?? [];
    survey.name = node.dataset.survey;
    const box = element("div", "player");
    const label = element("label", "", `Moment of the survey ${title}`);
    const slider = element("input");
    Object.assign(slider, { type: "range", min: player.from_s, max: player.until_s, step: player.step_s, id: `moment-${survey.name}` });
    label.htmlFor = slider.id;
    const steps = element("div", "steps");
    const now = element("output", "moment");
    now.setAttribute("for", slider.id);
    now.setAttribute("aria-live", "off");
    const closeup = element("div", "space");
    const chart = element("figure", "chart");
    const caption = element("figcaption", "", "Half a minute before and after, in counts relative to the mean of that minute, one sensor below the other. All sensors have the scale of the bar.");
    caption.prepend(element("strong", "", "Readings. "));
    const canvas = element("div", "canvas");
    canvas.setAttribute("role", "img");
    chart.append(caption, canvas);
    box.append(label, slider, steps, now, closeup, chart);
    node.before(box);

    const goTo = (time) => {
      slider.value = time;
      show();
    };
    const moveOverlay = SurveyOverlay.setUp(node.closest("article").querySelector(".stage"), survey, goTo);
    const signals = SurveySignals.setUp(canvas, player.signals, player.from_s);
    const show = () => {
      const moment = momentOf(player, Number(slider.value));
      const { when, does, rest, reason } = wordsOf(player, moment);
      slider.setAttribute("aria-valuetext", `${when}: the capsule ${does}; ${rest}`);
      now.replaceChildren(element("strong", "", `${when}: ${does}.`), ` ${rest[0].toUpperCase()}${rest.slice(1)}`, ...(reason ? [element("span", "reason", `Last event: ${reason}.`)] : []));
      closeup.replaceChildren(SurveyCloseup.drawMoment(survey, moment.time, closeup.clientWidth, `The capsule in the gut, and space and time about it. ${when}: ${does}; ${rest}`));
      canvas.setAttribute("aria-label", `Readings of ${player.signals.rows.length} sensors about ${when}.`);
      signals.moveTo(moment.time);
      moveOverlay(moment);
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
    const redraw = () => {
      signals.redraw();
      show();
    };
    Palette.onThemeChange(redraw);
    let width = box.clientWidth;
    new ResizeObserver(() => {
      if (box.clientWidth === width) return;
      width = box.clientWidth;
      redraw();
    }).observe(box);
    // Begin at a nodule, which shows more than the start.
    const first = places.find(({ status }) => status === "confirmed") ?? places[0];
    goTo(first ? first.suspected_s : player.from_s);
  }

  function setUp() {
    document.querySelectorAll("script[data-survey]").forEach(setUpOne);
  }

  return { setUp };
})(Elements, Palette, Signals, SurveyTime, SurveyCloseup, SurveySignals, SurveyOverlay);
