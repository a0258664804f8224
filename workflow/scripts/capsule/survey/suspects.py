"""The suspected places of a survey, and the updates of their threshold as new gut is judged."""

import numpy as np

from capsule.survey.decision import decide
from capsule.survey.gut_evidence import GutEvidence
from capsule.survey.survey_settings import SurveySettings
from capsule.survey.suspected_place import Place
from capsule.survey.suspicion import AdaptiveThreshold

_UNKNOWN = float("nan")


class Suspects:
    """The places suspected so far.

    Parameters
    ----------
    settings : SurveySettings
        Settings of the survey.
    length_mm : float
        Distance from the first sensor to the last.

    Attributes
    ----------
    places : list of Place
        The places in the order of suspicion; the last one is the present place.
    threshold : AdaptiveThreshold
        Threshold above which evidence is suspicious.
    judged_mm : float
        Length of gut that all sensors have passed and the survey has judged.
    newest_score : float
        The largest evidence of the newest judgement; NaN if it had none.
    """

    def __init__(self, settings: SurveySettings, length_mm: float) -> None:
        self.places: list[Place] = []
        self.judged_mm = 0.0
        self.newest_score = _UNKNOWN
        self.threshold = AdaptiveThreshold(
            budget=settings.budget,
            block_mm=settings.block_mm,
            prior=settings.prior,
            prior_blocks=settings.prior_blocks,
            memory=settings.memory,
            gain=settings.gain,
        )
        self._settings, self._length_mm = settings, length_mm
        self._front_mm: float | None = None
        self._open_from_mm = -np.inf
        self._block: tuple[int, float] | None = None
        self._best = (_UNKNOWN, -np.inf)

    @property
    def present(self) -> Place:
        """The place that the survey examines at present."""
        return self.places[-1]

    @property
    def best_score(self) -> float:
        """The largest evidence of the present pass."""
        return self._best[1]

    def is_beyond(self, position_mm: float) -> bool:
        """Return whether the last sensor is far enough beyond the present place."""
        return position_mm >= self.present.first_mm + self._length_mm + self._settings.beyond_mm

    def look(self, evidence: GutEvidence, fix_mm: float) -> Place | None:
        """Add the evidence of new gut, and return a new suspected place, if any.

        Parameters
        ----------
        evidence : GutEvidence
            Evidence of the last samples.
        fix_mm : float
            Position of the head.
        """
        self._go_on(evidence, fix_mm - self._length_mm)
        place_mm, score = self._unjudged(evidence).best()
        self.newest_score = score
        threshold = self.threshold.threshold
        if not score > threshold:
            return None
        self.threshold.suspected()
        self.places.append(Place(len(self.places) + 1, place_mm, threshold))
        self._best = (place_mm, score)
        return self.present

    def look_closer(self, evidence: GutEvidence, fix_mm: float) -> None:
        """Add evidence to the first pass over the present place."""
        self._go_on(evidence, fix_mm - self._length_mm)
        self._keep_best(self._unjudged(evidence))
        self.present.first_mm = self._best[0]

    def end_first_pass(self) -> None:
        """End the first pass over the present place."""
        self.present.evidence.append(self._best[1])
        # All gut passed until now has been judged, too.
        if self._front_mm is not None:
            self._open_from_mm = self._front_mm

    def jump(self) -> None:
        """Skip gut that the capsule has passed folded, because it was not judged."""
        self._front_mm = None

    def begin_pass(self) -> None:
        """Begin a repeated pass over the present place."""
        self._best = (_UNKNOWN, -np.inf)

    def look_again(self, evidence: GutEvidence) -> None:
        """Add evidence of a repeated pass; only evidence near the present place counts."""
        reach_mm, first_mm = self._settings.reach_mm, self.present.first_mm
        self._keep_best(evidence.within(first_mm - reach_mm, first_mm + reach_mm))

    def end_pass(self, most: int) -> str:
        """End a repeated pass over the present place, and return the decision.

        Parameters
        ----------
        most : int
            Largest number of repeated passes.

        Returns
        -------
        {"confirmed", "dismissed", "again", "undecided"}
        """
        place_mm, score = self._best
        seen, place = np.isfinite(score), self.present
        place.evidence.append(score if seen else _UNKNOWN)
        place.again_mm.append(place_mm)
        # The heights of all passes are computed with the present noise.
        place.heights = [self.threshold.height(evidence) for evidence in place.evidence]
        outcome = decide(
            place.heights,
            confirm=self._settings.confirm,
            dismiss=self._settings.dismiss,
            at_last=self._settings.at_last,
            most=most,
        )
        if outcome != "again":
            self.close(outcome)
        return outcome

    def close(self, status: str) -> None:
        """Set the status of the present place, if it has none."""
        if not self.places or self.present.status:
            return
        self.present.status = status
        if status == "confirmed":
            self.threshold.was_right()

    def _keep_best(self, evidence: GutEvidence) -> None:
        place_mm, score = evidence.best()
        self.newest_score = score
        if score > self._best[1]:
            self._best = (place_mm, score)

    def _unjudged(self, evidence: GutEvidence) -> GutEvidence:
        judged = [place.first_mm for place in self.places if place.status]
        ahead = evidence.within(self._open_from_mm, np.inf)
        return ahead.without(judged, self._settings.apart_mm)

    def _go_on(self, evidence: GutEvidence, front_mm: float) -> None:
        """Update the threshold with new gut that all sensors have passed, block by block."""
        if self._front_mm is None:
            self._front_mm = front_mm
        new_mm = max(front_mm - self._front_mm, 0.0)
        self._front_mm += new_mm
        self.judged_mm += new_mm
        self.threshold.passed(new_mm)
        number = int(front_mm // self._settings.block_mm)
        if self._block is None or number > self._block[0]:
            if self._block is not None and np.isfinite(self._block[1]):
                self.threshold.learn(self._block[1])
            self._block = number, -np.inf
        perhaps = [place.first_mm for place in self.places if place.status != "dismissed"]
        ahead = evidence.within(self._open_from_mm, np.inf)
        _, largest = ahead.without(perhaps, 2 * self._settings.apart_mm).best()
        if largest > self._block[1]:
            self._block = number, largest
