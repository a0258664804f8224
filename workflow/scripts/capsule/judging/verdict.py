"""The verdicts of all detectors on a recording: on a whole one, and on one in progress."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from capsule import words
from capsule.detectors.base import Verdict, why_unknown
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import FAMILIAR, Familiarity, FamiliarKind
from capsule.detectors.files import is_of, read_learned, read_template_set
from capsule.detectors.registry import detector_class
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
class SoFar:
    """What the detectors would say if the run ended now.

    Attributes
    ----------
    lines : list of str
        A table, or one line with the reason why there is no verdict yet.
    scores : list of dict
        ``detector``, ``score``, ``threshold`` and ``verdict`` of each detector.
    advice : str
        Whether this is enough, or what to do.
    """

    lines: list[str]
    scores: list[dict[str, Any]]
    advice: str


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
        self._settings = settings
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

    def verdicts(self, values: np.ndarray) -> dict[str, Verdict]:
        """Judge a recording by every configured detector.

        Parameters
        ----------
        values : (S, K) array
            Readings from `capsule.recordings.acceptance.readings_of`; each sensor shows a wave.

        Returns
        -------
        dict of str to Verdict
            Verdicts by the detector's name.
        """
        recording = DescribedRecording(values, self._settings)
        return {name: model.verdict(recording) for name, model in self._models.items()}

    def familiarity(self, values: np.ndarray) -> Familiarity:
        """Return whether readings, as in `verdicts`, are of the kind that taught the detectors."""
        return self._familiar.judge(DescribedRecording(values, self._settings).traits)

    def judge(self, values: np.ndarray) -> list[str]:
        """Return the verdicts of all configured detectors in words.

        Parameters
        ----------
        values : (S, K) array
            Readings, as in `verdicts`.

        Returns
        -------
        list of str
            As from `verdict_lines`.
        """
        return verdict_lines(self.verdicts(values), self._settings, self.familiarity(values))

    def judge_so_far(
        self, samples: Sequence[Sequence[float] | None], header: Mapping[str, str]
    ) -> SoFar:
        """Return the verdicts of all detectors if the run ended now.

        Parameters
        ----------
        samples : sequence of K samples
            ADC counts of the S sensors; None is a missing sample.
        header : mapping of str to str
            The recording's header.
        """
        rules = self._settings["recording"]
        missing = [np.nan] * rules["sensors"]
        values = np.array([missing if sample is None else sample for sample in samples], float)
        time_s = np.arange(len(samples)) / rules["rate_hz"]
        window = self._settings["preprocessing"]["window"]
        if len(samples) < window:
            wait = f"the detectors judge from {window / rules['rate_hz']:.0f} s on"
            return SoFar([wait], [], wait)
        try:
            readings, no_verdict = readings_of(Recording(time_s, values.T, header), self._settings)
        except RecordingError as reason:
            no_verdict = str(reason)
        if no_verdict:
            return SoFar([f"no verdict yet: {no_verdict}"], [], f"no verdict yet: {no_verdict}")
        verdicts, familiarity = self.verdicts(readings), self.familiarity(readings)
        scores = [
            {"detector": name, "score": each.score, "threshold": each.threshold}
            | {"verdict": word_of(each, familiarity).value}
            for name, each in verdicts.items()
        ]
        table = verdict_table(verdicts, self._settings, familiarity)
        return SoFar(["if the run ended now:", *table], scores, _advice(scores, familiarity))


def word_of(verdict: Verdict, familiarity: Familiarity) -> VerdictWord:
    """Return which of the five verdicts this is."""
    unlike = familiarity.because if familiarity.familiar is False else ""
    return verdict_word(
        verdict.score,
        verdict.threshold,
        verdict.probability,
        unlike=unlike,
        reason=why_unknown(verdict),
    )


def _advice(scores: Sequence[Mapping[str, Any]], familiarity: Familiarity) -> str:
    """Return whether the verdicts so far are enough, or what to do."""
    if familiarity.familiar is False:
        return f"seat the capsule anew: {familiarity.sentence}"
    said = {each["verdict"] for each in scores} - {VerdictWord.NO_VERDICT.value}
    if len(said) == 1 and said <= {VerdictWord.NODULE.value, VerdictWord.NO_NODULE.value}:
        return f"enough: {said.pop()}"
    return "pass again: the detectors are not sure" if said else "no verdict yet"


_GAP = "  "


def verdict_table(
    verdicts: Mapping[str, Verdict], settings: Settings, familiarity: Familiarity
) -> list[str]:
    """Return a table with one line per detector.

    Parameters
    ----------
    verdicts : mapping of str to Verdict
        Verdicts by the detector's name.
    settings : mapping
        Sections ``recording`` and ``evaluation`` of the configuration.
    familiarity : Familiarity
        Whether the recording is familiar. If it is not, no probability is stated.

    Returns
    -------
    list of str
        A line about a recording that is not familiar, and the lines of the table; the first of
        these names the columns.
    """
    confidence = words.percent(settings["evaluation"]["size_confidence"])
    head = ["detector", "verdict", f"size ({confidence} interval)", "probability", "place"]
    rate_hz = settings["recording"]["rate_hz"]
    rows = [_cells(name, each, rate_hz, familiarity) for name, each in verdicts.items()]
    return [*filter(None, [familiarity.sentence]), *_aligned([head, *rows])]


def verdict_lines(
    verdicts: Mapping[str, Verdict], settings: Settings, familiarity: Familiarity
) -> list[str]:
    """Return the lines of `verdict_table`, and one that says what its columns mean."""
    prevalence = words.percent(settings["evaluation"]["prevalence"])
    return [
        *verdict_table(verdicts, settings, familiarity),
        "place: time and distance at which sensor 1 passes the nodule; probability: of a nodule, "
        f"if {prevalence} of all recordings have one",
    ]


def _cells(detector: str, verdict: Verdict, rate_hz: float, familiarity: Familiarity) -> list[str]:
    probability = words.probability(familiarity.stated(verdict.probability))
    word = str(word_of(verdict, familiarity))
    if not words.is_known(verdict.predicted_mm):
        return [detector, f"{word}: {why_unknown(verdict)}"]
    if verdict.predicted_mm == 0:
        return [detector, word, "", probability]
    return [
        detector,
        word,
        words.estimated_size(vars(verdict)),
        probability,
        words.place(verdict.location_samples / rate_hz, verdict.location_mm),
    ]


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
        _GAP.join(cell.ljust(width) for cell, width in zip(row, widths, strict=False)).rstrip()
        for row in rows
    ]
