"""Judge any file as a recording: first the workflow's check, then every detector."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from capsule.acceptance import check_recording
from capsule.bench.verdict import FinalVerdict
from capsule.detectors.base import Verdict, why_unknown
from capsule.detectors.familiar import Familiarity
from capsule.files import read_csv, read_limited
from capsule.kinds import Settings
from capsule.recording import source_of
from capsule.results import read_or_explain

# The check needs a recording's name; an unlabelled one fits a file of any location.
_NAME = "unlabelled/judged"


@dataclass(frozen=True)
class JudgedFile:
    """The result of judging one file.

    Attributes
    ----------
    file : str
        Name of the file, as given.
    check : dict
        Result of the workflow's check: ``status``, ``reason``, ``header`` and more.
    values : (S, K) array
        The readings; NaN for a rejected file.
    verdicts : dict of str to Verdict
        Verdicts by the detector's name; empty if no detector can judge the file.
    familiarity : Familiarity
        Whether the file is of the kind that taught the detectors.
    taught_as : str
        Labelled recording with the same readings, such as ``3mm/r07``, from which the detectors
        have learned; empty if there is none.
    """

    file: str
    check: dict[str, Any]
    values: np.ndarray
    verdicts: dict[str, Verdict]
    familiarity: Familiarity
    taught_as: str

    @property
    def is_accepted(self) -> bool:
        """Return whether the workflow would accept the file."""
        return bool(self.check["status"] == "accepted")


def taught_recordings(index: Path) -> dict[str, str]:
    """Return the names of the labelled recordings by the checksums of their readings.

    The index is ``results/recordings.csv``; without it the result is empty.
    """
    return read_or_explain(index, _taught_in) if index.exists() else {}


def _taught_in(index: Path) -> dict[str, str]:
    rows = read_csv(index)
    return {row["readings_sha256"]: row["recording"] for row in rows if row["size_mm"]}


def judge_file(
    path: Path, final: FinalVerdict, settings: Settings, taught: Mapping[str, str]
) -> JudgedFile:
    """Judge one file.

    Parameters
    ----------
    path : Path
        The file.
    final : FinalVerdict
        The detectors.
    settings : mapping
        The configuration.
    taught : mapping of str to str
        Result of `taught_recordings`.
    """
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    try:
        content = read_limited(path, max_bytes)
    except OSError as error:
        check = {"status": "rejected", "reason": f"it cannot be read: {error.strerror}"}
        return JudgedFile(str(path), check, np.empty((0, 0)), {}, Familiarity(None), "")
    check, values, _ = check_recording(_NAME, content, max_bytes, settings, str(path))
    judged = check["status"] == "accepted" and not check["no_verdict"]
    verdicts = final.verdicts(values) if judged else {}
    familiarity = final.familiarity(values) if judged else Familiarity(None)
    taught_as = taught.get(check["readings_sha256"], "")
    return JudgedFile(str(path), check, values, verdicts, familiarity, taught_as)


def as_plain_values(judged: JudgedFile, rate_hz: float) -> dict[str, Any]:
    """Return the result for a file as values that JSON can hold; an unknown value is None."""
    check = judged.check
    return {
        "file": judged.file,
        "status": check["status"],
        "reason": check["reason"],
        "no_verdict": check.get("no_verdict", ""),
        "samples": check.get("samples"),
        "duration_s": check.get("duration_s"),
        "sha256": check.get("sha256"),
        "source": source_of(check.get("header", {})),
        "taught_as": judged.taught_as,
        "familiar": judged.familiarity.familiar,
        "unfamiliar_because": judged.familiarity.because,
        "verdicts": {
            name: _verdict_values(verdict, rate_hz, judged.familiarity)
            for name, verdict in judged.verdicts.items()
        },
    }


def _verdict_values(verdict: Verdict, rate_hz: float, familiarity: Familiarity) -> dict[str, Any]:
    values = dict(vars(verdict)) | {"reason": why_unknown(verdict)}
    values["probability"] = familiarity.stated(verdict.probability)
    # The same unit as in results/detections.csv.
    values["location_s"] = values.pop("location_samples") / rate_hz
    values["distances"] = [_known(each) for each in verdict.distances or ()]
    return {name: _known(value) for name, value in values.items()}


def _known(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value
