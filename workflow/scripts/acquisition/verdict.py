"""The verdicts of --detect: the paper's detector on what came so far, every one in the end."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from acquisition.bench_errors import AcquisitionError
from capsule import words
from capsule.detectors.matching import nearest_size, template_distances
from capsule.detectors.training import NewRecording, detector_class
from capsule.detectors.verdicts import Verdict, why_unknown
from capsule.preprocessing import preprocess
from capsule.wave_check import missing_wave
from edges.detector_inputs import read_template_set, read_templates
from edges.files import read_json
from edges.scorer_files import read_scorer

WEIGHTS = Path(__file__).resolve().parents[2] / "weights" / "scorer.npz"


def existing(path: Path) -> Path:
    """Refuse a file of results that is not there yet."""
    if not path.exists():
        raise AcquisitionError(f"--detect needs {path}; make it first: snakemake -c2 {path}")
    return path


class RunningVerdict:
    """Compares the samples so far with the templates.

    Parameters
    ----------
    templates : Path
        ``results/templates.npz``, as the workflow makes it.
    settings : mapping
        The configuration.

    Raises
    ------
    AcquisitionError
        There are no templates yet.
    """

    def __init__(self, templates: Path, settings: Mapping) -> None:
        stored = read_templates(existing(templates))
        self._templates, self._sizes_mm = list(stored.values()), list(stored)
        self._settings = settings

    def judge(self, samples: Sequence[Sequence[int] | None], sensors: int) -> str:
        """Say what the detector makes of the samples so far.

        Parameters
        ----------
        samples : sequence of K samples
            ADC counts of the S sensors, or None where a sample is missing.
        sensors : int
            Number of sensors S.

        Returns
        -------
        str
            The verdict, or why there is none yet.
        """
        shape, rules = self._settings["preprocessing"], self._settings["recording"]
        window, length = int(shape["window"]), int(shape["length"])
        if len(samples) < window:
            return f"verdict after {window} samples"
        if len(samples) > length:
            return f"no verdict: more than {length} samples"
        missing = [np.nan] * sensors
        values = np.array([missing if sample is None else sample for sample in samples]).T
        if np.isnan(values).all():
            return "no verdict: no sample yet"
        constant = np.nanmax(values, axis=1) == np.nanmin(values, axis=1)
        if constant.any():
            return f"no verdict: sensor {int(constant.argmax()) + 1} is constant"
        no_wave = missing_wave(
            values, rules["rate_hz"], self._settings["diagonal"], rules["wave_false_rate"]
        )
        if no_wave:
            return f"no verdict: {no_wave}"
        distances = template_distances(preprocess(values, **shape), self._templates)
        size_mm = nearest_size(distances, self._sizes_mm)
        if np.isnan(size_mm):
            return "no verdict: a gap is longer than the window"
        what = f"nodule of {size_mm:g} mm" if size_mm else "no nodule"
        return f"{what} (RMSE {np.nanmin(distances):.3f})"


class FinalVerdict:
    """Judges a whole recording by every configured detector, as the workflow would.

    Parameters
    ----------
    templates, learned : Path
        ``results/templates.npz`` and ``results/detectors.json``, as the workflow makes them.
    settings : mapping
        The configuration.

    Raises
    ------
    AcquisitionError
        One of them is not there yet, or made by another configuration.
    """

    def __init__(self, templates: Path, learned: Path, settings: Mapping) -> None:
        known = read_template_set(existing(templates), settings["fit"]["first_peak"])
        content = read_json(existing(learned))
        self._settings = settings
        self._scorer = read_scorer(WEIGHTS)
        try:
            same = all(content["settings"][key] == settings[key] for key in content["settings"])
            self._models = {
                name: detector_class(name).Model.restored(content, known)
                for name in settings["detectors"]
            }
        except (KeyError, TypeError, ValueError):
            same = False
        if not same:
            raise AcquisitionError(
                f"{learned} was made with another configuration or version; make it again: "
                f"snakemake -c2 {learned}"
            )

    def judge(self, values: np.ndarray) -> list[str]:
        """Say what every configured detector makes of a recording.

        Parameters
        ----------
        values : (S, K) array
            Its readings, as `capsule.checking.readings_of` gives them; each sensor shows a wave.

        Returns
        -------
        list of str
            A line a detector.
        """
        recording = NewRecording(values, self._settings, self._scorer)
        return [self._line(name, model.verdict(recording)) for name, model in self._models.items()]

    def _line(self, detector: str, verdict: Verdict) -> str:
        recording = self._settings["recording"]
        if np.isnan(verdict.predicted_mm):
            return f"verdict of {detector}: none ({why_unknown(verdict)})"
        parts = ["no nodule"]
        if verdict.predicted_mm > 0:
            where = words.place(
                verdict.location_samples / recording["rate_hz"], verdict.location_mm
            )
            parts = [
                f"nodule of {words.estimated_size(vars(verdict))}",
                f"sensor 1 passes the nodule: {where}",
            ]
        if not np.isnan(verdict.probability):
            prevalence = words.percent(self._settings["evaluation"]["prevalence"])
            parts.append(
                f"probability of a nodule {words.percent(verdict.probability)} at a prevalence "
                f"of {prevalence}"
            )
        return f"verdict of {detector}: {', '.join(parts)}"
