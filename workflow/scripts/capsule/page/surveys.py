"""The page's section on surveys: what it says about each, and the data that replays it.

Signals and judgements are thinned and packed (`capsule.page.packing`).
"""

from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from capsule import words
from capsule.detectors.verdicts import OF_SURVEY, VerdictWord
from capsule.kinds import Cells, Row
from capsule.page.packing import deflated, pack, to_json
from capsule.recordings.origin import is_simulated
from capsule.survey.cycle import STATES
from capsule.survey.files import Session, StoredPlace
from capsule.survey.track import AGAIN, BACK, Pin, Track, group_of

# Limit of values per sensor, one byte each; a survey of more than 47 minutes is thinned further.
MOST_SAMPLES = 14_000
MOST_JUDGEMENTS = 6000
# At this interval a wave of 3.2 s still shows.
_LEAST_S = 0.2


def page_values(surveys: Sequence[Row], passed_over: Mapping[str, str]) -> Cells:
    """Return the values of the page's section on surveys.

    Of a survey that cannot be read there are only ``name`` and ``problem``.
    """
    readable = [survey for survey in surveys if "problem" not in survey]
    problems = [(each["name"], each["problem"]) for each in surveys if "problem" in each]
    return {
        "shown": [{**survey, "data": _data(survey)} for survey in readable],
        "problems": [*problems, *passed_over.items()],
    }


def _data(survey: Row) -> str:
    """Return the JSON of a survey for the page's scripts, in which its player is deflated."""
    carried = {name: survey[name] for name in ("title", "places", "frame")}
    return to_json({**carried, "player": deflated(to_json(survey["player"]))})


def title_of(session: Session) -> str:
    """Return a survey's title, which always marks a simulated survey."""
    if is_simulated(session.source):
        return f"{session.name}, simulated"
    return session.name if session.source else f"{session.name}, of unknown origin"


def survey_values(session: Session, track: Track, pins: Sequence[Pin]) -> Cells:
    """Return what the page says about one survey, ready for JSON."""
    known = track.head_mm[track.known]
    way = f"{words.number(float(known.max()), 0)} mm of gut" if known.size else "no known way"
    whole_s = float(session.time_s[-1] - session.time_s[0])
    groups = [group_of(state) for state in track.state]
    share = sum(group in (BACK, AGAIN) for group in groups) / len(groups)
    return {
        "name": session.name,
        "title": title_of(session),
        "simulated": is_simulated(session.source),
        "summary": (
            f"{way} in {words.duration(whole_s)}, of which {words.percent(share)} to go back and "
            f"look again; {_outcome(session)}."
        ),
        "places": [
            _place(place, pin.suspected_s) for place, pin in zip(session.places, pins, strict=False)
        ],
    }


def _place(place: StoredPlace, suspected_s: float) -> Cells:
    """Return what the page says of a suspected place."""
    off_mm, size = place.may_be_off_mm, place.size
    if place.status != "confirmed":
        size = words.NOT_APPLICABLE
    if place.familiar == "no":
        size = f"{VerdictWord.UNLIKE} ({place.unfamiliar_because}); {size}"
    return {
        "number": place.place,
        "status": str(OF_SURVEY[place.status]),
        "where": f"{words.number(place.place_mm, 1)} mm"
        + (f", or off by {words.number(off_mm, 0)} mm" if off_mm else ""),
        "passes": place.passes,
        "size": size,
        "height": words.number(place.height, 2),
        "suspected_s": suspected_s,
    }


def _outcome(session: Session) -> str:
    """Return the survey's targets in words, or its number of suspected places."""
    targets = session.about.get("goto")
    if isinstance(targets, list) and targets:
        told = ", then ".join(f"{words.setting(target)} mm" for target in targets)
        return f"it was told to go to {told}"
    if not session.places:
        return "no suspected place"
    counts = Counter(OF_SURVEY[place.status] for place in session.places)
    said = words.enumerate_words([f"{counts[name]} {name}" for name in VerdictWord if counts[name]])
    return f"{words.plural(len(session.places), 'suspected place')}: {said}"


def player(session: Session, track: Track) -> Cells:
    """Return the data that replays a survey.

    What is known of the judgements lies on an even grid in time, packed: at grid times between two
    of them head and threshold are on a straight line, and a score is that of the one before.
    States are [s, what the capsule does, last event].
    """
    from_s, until_s = float(track.time_s[0]), float(session.time_s[-1])
    step_s = float(np.median(np.diff(track.time_s)))
    every_s = max(step_s, (until_s - from_s) / MOST_JUDGEMENTS)
    grid_s = np.arange(from_s, until_s + every_s / 2, every_s)
    at = np.searchsorted(track.time_s, grid_s + every_s / 2, side="right") - 1
    near = np.abs(track.time_s[at] - grid_s) <= every_s
    head_mm, threshold = (
        np.interp(grid_s, track.time_s, values) for values in (track.head_mm, track.threshold)
    )
    return {
        "from_s": from_s,
        "step_s": round(step_s, 3),
        "until_s": until_s,
        "every_s": every_s,
        "head": pack(head_mm[np.newaxis]),
        "threshold": pack(threshold[np.newaxis]),
        "score": pack(np.where(near, track.score[at], np.nan)[np.newaxis], 8),
        "measured": pack(track.known[at].astype(float)[np.newaxis], 8),
        "states": [
            [round(from_s, 2), STATES["starting"], ""],
            *(
                [
                    round(event.time_s, 2),
                    STATES[event.after],
                    f"{event.event.replace('_', ' ')}, {event.reason}",
                ]
                for event in session.events
            ),
        ],
        "signals": _signals(session),
    }


def _signals(session: Session) -> Cells:
    """Return the readings, thinned to means of neighbouring samples; each sensor has its scale.

    They are drawn at a distance that nine in ten of their ranges in a minute do not exceed.
    """
    step_s = float(np.median(np.diff(session.time_s)))
    from_s, whole_s = float(session.time_s[0]), float(np.ptp(session.time_s))
    every_s = max(_LEAST_S, step_s, whole_s / MOST_SAMPLES)
    # Bin by time, not by sample number: the time of a resumed survey has a jump.
    bins = np.floor((session.time_s - from_s) / every_s + 1e-6).astype(int)
    means = pd.DataFrame(session.values.T).groupby(bins).mean().reindex(range(bins[-1] + 1))
    rows = [pack(row[np.newaxis], 8) for row in means.to_numpy().T]
    of_minute = means.groupby(means.index * every_s // 60)
    ranges = (of_minute.max() - of_minute.min()).to_numpy()
    known = ranges[~np.isnan(ranges)]
    distance = 1.1 * float(np.quantile(known, 0.9)) if known.size else 0.0
    return {"from_s": from_s, "every_s": every_s, "rows": rows, "distance": distance or 1.0}
