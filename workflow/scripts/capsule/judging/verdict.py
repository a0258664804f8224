"""The verdicts of all detectors on a recording: on a whole one, and on one in progress."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from capsule import words
from capsule.detectors.base import Verdict, why_unknown
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarKind
from capsule.detectors.files import is_of, read_learned, read_template_set
from capsule.detectors.registry import detector_class
from capsule.detectors.unlike import familiarity_line, unlike
from capsule.detectors.verdicts import VerdictWord, verdict_word
from capsule.engine.project import WEIGHTS
from capsule.errors import CapsuleError, RecordingError
from capsule.kinds import Settings
from capsule.recordings.acceptance import readings_of
from capsule.recordings.names import UNLABELLED
from capsule.recordings.recording import Recording
from capsule.store.files import fingerprint
from capsule.store.results import changed_recordings


def note_of_change(results: Path, settings: Settings) -> str:
    """Return a line if labelled recordings have changed since the detectors learned, else "".

    Parameters
    ----------
    results : Path
        The folder of results, beside raw/.
    settings : mapping
        The configuration.
    """
    names = changed_recordings(results, settings)
    changed = [name for name in names if UNLABELLED not in Path(name).parts]
    if not changed:
        return ""
    return (
        f"note: {words.plural(len(changed), 'labelled recording')} came, went or changed since the "
        f"detectors of {results}/ learned, such as {changed[0]}; to make them again: snakemake -c2"
    )


@dataclass(frozen=True)
class Judgement:
    """What all detectors say of a recording.

    Attributes
    ----------
    settings : mapping
        Sections ``recording`` and ``evaluation`` of the configuration.
    verdicts : mapping of str to Verdict
        Verdicts by the detector's name; empty if no detector can judge the recording.
    familiarity : Familiarity
        Whether the recording is of the kind that taught the detectors. If it is not, no
        probability is stated.
    waits : str
        Why there is no verdict yet on a run in progress; empty if there is one.
    """

    settings: Settings
    verdicts: Mapping[str, Verdict] = field(default_factory=dict)
    familiarity: Familiarity = field(default_factory=partial(Familiarity, None))
    waits: str = ""

    def word(self, detector: str) -> VerdictWord:
        """Return which of the five verdicts a detector gives."""
        verdict, familiarity = self.verdicts[detector], self.familiarity
        return verdict_word(
            verdict.score,
            verdict.threshold,
            verdict.probability,
            unlike=familiarity.familiar is False,
            reason=why_unknown(verdict),
        )

    @property
    def scores(self) -> list[dict[str, Any]]:
        """``detector``, ``score``, ``threshold`` and ``verdict`` of each detector."""
        return [
            {"detector": name, "score": each.score, "threshold": each.threshold}
            | {"verdict": self.word(name).value}
            for name, each in self.verdicts.items()
        ]

    @property
    def advice(self) -> str:
        """Whether the verdicts so far are enough, or what to do."""
        if self.waits:
            return self.waits
        if self.familiarity.familiar is False:
            return f"seat the capsule anew: {unlike(self.familiarity.cells)}"
        said = {self.word(name) for name in self.verdicts} - {VerdictWord.NO_VERDICT}
        if len(said) == 1 and said <= {VerdictWord.NODULE, VerdictWord.NO_NODULE}:
            return f"enough: {said.pop()}"
        return "pass again: the detectors are not sure" if said else "no verdict yet"

    def table(self) -> list[str]:
        """Return the names of the columns, and a line per detector.

        Before them stands a line about a recording that is not familiar.
        """
        confidence = words.percent(self.settings["evaluation"]["size_confidence"])
        head = ["detector", "verdict", f"size ({confidence} interval)", "probability", "place"]
        rows = [self._cells(name, each) for name, each in self.verdicts.items()]
        line = familiarity_line(self.familiarity.cells)
        return [*filter(None, [line]), *_aligned([head, *rows])]

    def lines(self) -> list[str]:
        """Return the table, and a line that says what its columns mean."""
        prevalence = words.percent(self.settings["evaluation"]["prevalence"])
        return [
            *self.table(),
            "place: time and distance at which sensor 1 passes the nodule; probability: of a "
            f"nodule, if {prevalence} of all recordings have one",
        ]

    def lines_so_far(self) -> list[str]:
        """Return the lines for a run in progress."""
        return [self.waits] if self.waits else ["if the run ended now:", *self.table()]

    def _cells(self, detector: str, verdict: Verdict) -> list[str]:
        probability = words.probability(self.familiarity.stated(verdict.probability))
        word = str(self.word(detector))
        if not words.is_known(verdict.predicted_mm):
            return [detector, f"{word}: {why_unknown(verdict)}"]
        if verdict.predicted_mm == 0:
            return [detector, word, "", probability]
        place_s = verdict.location_samples / self.settings["recording"]["rate_hz"]
        size = words.estimated_size(vars(verdict))
        return [detector, word, size, probability, words.place(place_s, verdict.location_mm)]


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return rows as lines with aligned columns.

    The last cell of a row may be longer than its column.
    """
    columns = max(map(len, rows))
    widths = [
        max((len(row[column]) for row in rows if column < len(row) - 1), default=0)
        for column in range(columns)
    ]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=False)).rstrip()
        for row in rows
    ]


class FinalVerdict:
    """The configured detectors, which judge a whole recording as the workflow does.

    Parameters
    ----------
    templates, learned : Path
        ``results/templates.npz`` and ``results/detectors.json``, made by the workflow.
    settings : mapping
        The configuration.
    asked_by : str
        Option or action that needs verdicts, for error messages.

    Raises
    ------
    CapsuleError
        One of the files does not exist or is damaged, another configuration or scorer made it, or
        they were not made together.
    """

    def __init__(
        self, templates: Path, learned: Path, settings: Settings, asked_by: str = "--detect"
    ) -> None:
        for path in (templates, learned):
            if not path.exists():
                raise CapsuleError(
                    f"{asked_by} needs {path}; make it first: snakemake -c2 results/{path.name}, "
                    "or with the whole report: capsule report"
                )
        content = read_learned(learned)
        self.settings = settings
        if content.get("templates") != fingerprint(templates, sys.maxsize):
            raise CapsuleError(
                f"{templates} and {learned} were not made together, or one is damaged, so no "
                "verdict would hold; delete both, and make them again: "
                "snakemake -c2 results/detectors.json"
            )
        known = read_template_set(templates, settings["fit"]["first_peak"])
        try:
            same = is_of(content, settings)
            same &= content["scorer"] == fingerprint(WEIGHTS, sys.maxsize)
            self._models = {
                name: detector_class(name).restored(content, known)
                for name in settings["detectors"]
            }
            self._familiar = FamiliarKind.restored(content[FAMILIAR])
        except (KeyError, TypeError, ValueError):
            same = False
        if not same:
            raise CapsuleError(
                f"{learned} was made with another configuration or version; make it again: "
                f"snakemake -c2 results/{learned.name}"
            )

    def judge(self, values: np.ndarray) -> Judgement:
        """Judge a recording by every configured detector.

        Parameters
        ----------
        values : (S, K) array
            Readings from `capsule.recordings.acceptance.readings_of`; each sensor shows a wave.
        """
        recording = DescribedRecording(values, self.settings)
        verdicts = {name: model.verdict(recording) for name, model in self._models.items()}
        return Judgement(self.settings, verdicts, self._familiar.judge(recording.traits))

    def judge_so_far(
        self, samples: Sequence[Sequence[float] | None], header: Mapping[str, str]
    ) -> Judgement:
        """Judge a run in progress as if it ended now.

        Parameters
        ----------
        samples : sequence of K samples
            ADC counts of the S sensors; None is a missing sample.
        header : mapping of str to str
            The recording's header.
        """
        rules, window = self.settings["recording"], self.settings["preprocessing"]["window"]
        if len(samples) < window:
            wait = f"the detectors judge from {window / rules['rate_hz']:.0f} s on"
            return Judgement(self.settings, waits=wait)
        missing = [np.nan] * rules["sensors"]
        values = np.array([missing if sample is None else sample for sample in samples], float)
        time_s = np.arange(len(samples)) / rules["rate_hz"]
        try:
            readings, no_verdict = readings_of(Recording(time_s, values.T, header), self.settings)
        except RecordingError as reason:
            no_verdict = str(reason)
        if no_verdict:
            return Judgement(self.settings, waits=f"no verdict yet: {no_verdict}")
        return self.judge(readings)
