// Compute a survey's position, wave and state at one moment. This module draws nothing.

const SurveyTime = (() => {
  "use strict";

  /** Return the index of the last entry that begins at or before a time; -1 before the first. */
  function lastAt(entries, time) {
    let [low, high] = [0, entries.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (entries[middle][0] <= time) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** Return the value of a line of points [s, value] at a time; null in a gap. Beyond its ends, the line is constant. */
  function valueAt(points, time) {
    if (!points.length) return null;
    const before = lastAt(points, time);
    if (before < 0) return points[0][1];
    const [[from, value], next] = [points[before], points[before + 1]];
    if (!next) return value;
    if (value === null || next[1] === null) return next[1] === null && time === from ? value : null;
    return value + ((time - from) / (next[0] - from)) * (next[1] - value);
  }

  /** Return whether a time is in one of the intervals [s, s]. */
  function isWithin(stretches, time) {
    const at = lastAt(stretches, time + 1e-6);
    return at >= 0 && time <= stretches[at][1] + 1e-6;
  }

  /** Return the state at a time, and the reason for it. */
  function stateAt(player, time) {
    const [, state, reason] = player.states[Math.max(lastAt(player.states, time + 1e-3), 0)];
    return { state, reason };
  }

  /** Return all values at a time. */
  function momentOf(player, time) {
    const { state, reason } = stateAt(player, time);
    const judged = player.scores[Math.round((time - player.from_s) / player.judged_s)] ?? null;
    return {
      time,
      state,
      reason,
      head: valueAt(player.head, time),
      measured: !isWithin(player.unknown, time),
      folded: valueAt(player.folded, time),
      wave: valueAt(player.wave, time),
      score: judged,
      threshold: valueAt(player.threshold, time),
    };
  }

  /** Return half the width of the gut at a place, in mm, for a position of the wave. */
  function halfLumen({ wall }, wave, place) {
    const baseline = wall.lumen_mm / 2;
    if (wave === null || wall.crest_mm === null) return baseline;
    const angle = (2 * Math.PI * (place - wave - wall.crest_mm)) / wall.wavelength_mm;
    return baseline - wall.amplitude_mm * Math.cos(angle);
  }

  /** Return evenly spaced times of a window. */
  function moments(from, until, count) {
    return Array.from({ length: count + 1 }, (_, at) => from + ((until - from) * at) / count);
  }

  /** Return the paths of crests through a window of time and place, as lines of points [place, s]. */
  function crests({ wave, wall }, [from, until], [low, high]) {
    if (wall.crest_mm === null) return [];
    const known = moments(from, until, 120)
      .map((time) => [time, valueAt(wave, time)])
      .filter(([, at]) => at !== null)
      .map(([time, at]) => [time, at + wall.crest_mm]);
    if (!known.length) return [];
    const all = known.map(([, at]) => at);
    const first = Math.ceil((low - Math.max(...all)) / wall.wavelength_mm);
    const last = Math.floor((high - Math.min(...all)) / wall.wavelength_mm);
    return Array.from({ length: Math.max(last - first + 1, 0) }, (_, at) =>
      known.map(([time, stands]) => [stands + (first + at) * wall.wavelength_mm, time]),
    );
  }

  return { lastAt, valueAt, isWithin, stateAt, momentOf, halfLumen, moments, crests };
})();
