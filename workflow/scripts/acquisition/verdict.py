"""The running verdict of --detect: the paper's detector on what came so far."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from acquisition.errors import AcquisitionError
from capsule.detection import nearest_size, template_distances
from capsule.naming import folder_size_mm
from capsule.preprocessing import preprocess


class RunningVerdict:
    """Compares the samples so far with the templates.

    Parameters
    ----------
    templates : Path
        ``results/templates.npz``, as the workflow makes it.
    shape : mapping
        The section ``preprocessing`` of the configuration.

    Raises
    ------
    AcquisitionError
        There are no templates yet.
    """

    def __init__(self, templates: Path, shape: Mapping[str, float]) -> None:
        if not templates.exists():
            raise AcquisitionError(
                f"--detect needs {templates}; make it first: snakemake -c2 {templates}"
            )
        with np.load(templates) as stored:
            self._templates = list(stored.values())
            self._sizes_mm = [folder_size_mm(label) for label in stored]
        self._shape = shape

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
        window, length = int(self._shape["window"]), int(self._shape["length"])
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
        distances = template_distances(preprocess(values, **self._shape), self._templates)
        size_mm = nearest_size(distances, self._sizes_mm)
        if np.isnan(size_mm):
            return "no verdict: a gap is longer than the window"
        what = f"nodule of {size_mm:g} mm" if size_mm else "no nodule"
        return f"{what} (RMSE {np.nanmin(distances):.3f})"
