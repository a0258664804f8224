"""Write in words what the page says about one survey."""

from collections import Counter
from collections.abc import Sequence

from capsule import words
from capsule.kinds import Cells
from capsule.page.provenance import is_simulated
from capsule.survey.files import Session, StoredPlace
from capsule.survey.suspects import STATUSES
from capsule.survey.track import AGAIN, BACK, Pin, Track, group_of


def title_of(session: Session) -> str:
    """Return a survey's title, which always marks a simulated survey."""
    if is_simulated(session.source):
        return f"{session.name}, simulated"
    return session.name if session.source else f"{session.name}, of unknown origin"


def survey_values(session: Session, track: Track, pins: Sequence[Pin]) -> Cells:
    """Return what the page says about one survey, ready for JSON.

    Returns
    -------
    dict
        ``name``, ``title``, ``simulated``, ``summary`` (a sentence), and ``places`` with
        ``number``, ``status``, ``where``, ``passes``, ``size``, ``height``, ``place_mm``,
        ``suspected_s`` and ``decided_s``.
    """
    return {
        "name": session.name,
        "title": title_of(session),
        "simulated": is_simulated(session.source),
        "summary": _summary(session, track),
        "places": [_place(place, pin) for place, pin in zip(session.places, pins, strict=False)],
    }


def _summary(session: Session, track: Track) -> str:
    known = track.head_mm[track.known]
    way = f"{words.number(float(known.max()), 0)} mm of gut" if known.size else "no known way"
    whole_s = float(session.time_s[-1] - session.time_s[0])
    groups = [group_of(state) for state in track.state]
    share = sum(group in (BACK, AGAIN) for group in groups) / len(groups)
    return (
        f"{way} in {words.duration(whole_s)}, of which {words.percent(share)} to go back and look "
        f"again; {_outcome(session)}."
    )


def _outcome(session: Session) -> str:
    """Return the survey's targets in words, or its number of suspected places."""
    targets = session.about.get("goto")
    if isinstance(targets, list) and targets:
        told = ", then ".join(f"{words.setting(target)} mm" for target in targets)
        return f"it was told to go to {told}"
    if not session.places:
        return "no suspected place"
    counts = Counter(place.status for place in session.places)
    said = words.enumerate_words([f"{counts[name]} {name}" for name in STATUSES if counts[name]])
    return f"{words.plural(len(session.places), 'suspected place')}: {said}"


def _place(place: StoredPlace, pin: Pin) -> Cells:
    names = ("size_mm", "size_low_mm", "size_high_mm")
    size = {f"estimate_{name.removeprefix('size_')}": getattr(place, name) for name in names}
    confirmed = place.status == "confirmed"
    said = words.estimated_size(size) if confirmed else words.NOT_APPLICABLE
    if place.unfamiliar_because:
        said = f"{words.UNLIKE} ({place.unfamiliar_because}); {said}"
    return {
        "number": place.number,
        "status": place.status,
        "place_mm": place.place_mm,
        "where": f"{words.number(place.place_mm, 1)} mm",
        "passes": place.passes,
        "size": said,
        "height": words.number(place.height, 2),
        "suspected_s": pin.suspected_s,
        "decided_s": pin.decided_s,
    }
