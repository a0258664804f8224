"""Describe the runs and the templates of a simulated archive."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import Run
from capsule.preprocessing import normalize, rms_envelope
from capsule.templates import TemplateSet
from phantom_study.simulated_archive import middle_recording, passing_samples

COLUMNS = (
    "size_mm",
    "shortest_samples",
    "longest_samples",
    "stopped_by_hand",
    "middle_height",
    "highest",
    "passing_low_samples",
    "passing_high_samples",
    "template_peak_spacing_samples",
    "template_horizontal_spread_samples",
)


@dataclass(frozen=True)
class Example:
    """A typical run, from its readings to its matrix.

    Attributes
    ----------
    title
        Title in the figure.
    run
        The simulated run.
    envelope
        Its RMS envelope, shape (S, K).
    matrix
        Its matrix V, shape (S, L).
    """

    title: str
    run: Run
    envelope: np.ndarray
    matrix: np.ndarray


def examples(
    archive: Mapping[str, Run],
    matrices: Mapping[str, np.ndarray],
    sizes_mm: Sequence[float],
    window: int,
) -> list[Example]:
    """Return, for each of some sizes, the run whose matrix has the median sum.

    Parameters
    ----------
    archive
        Runs by recording name, such as ``3mm/r07``.
    matrices
        Their matrices V, shape (S, L).
    sizes_mm
        The sizes; each has one example.
    window
        W of the RMS envelope, in samples.
    """
    chosen = []
    for size in sizes_mm:
        name = middle_recording({other: matrices[other] for other in _of_size(archive, size)})
        envelope = rms_envelope(normalize(archive[name].counts.astype(np.float64)), window)
        title = name if size > 0 else f"{name} (no nodule)"
        chosen.append(Example(title, archive[name], envelope, matrices[name]))
    return chosen


def describe(
    archive: Mapping[str, Run],
    matrices: Mapping[str, np.ndarray],
    templates: TemplateSet,
    phantom: Phantom,
) -> list[dict]:
    """Return a description of the runs of each size.

    Parameters
    ----------
    archive
        Runs by recording name, such as ``3mm/r07``.
    matrices
        Their matrices V, shape (S, L).
    templates
        Templates learned from the matrices.
    phantom
        The bench of the runs.

    Returns
    -------
    list of dict
        One row for each size, with the keys of `COLUMNS`:

        - the lengths of the shortest and the longest run, in samples
        - the number of runs that were stopped by hand
        - the maximum of the matrix with the median sum, and of all matrices
        - the 5 % and 95 % points of the times from sensor to sensor over the nodule, in samples
        - the smallest and largest Delta mu and sigma_hor of the template, such as ``128-181``
    """
    particles = {
        size: total.mean()
        for size, total in zip(templates.sizes_mm, templates.totals, strict=True)
        if size > 0
    }
    rows = []
    for size in sorted({run.nodule_mm for run in archive.values()}):
        runs = [archive[name] for name in _of_size(archive, size)]
        of_size = {name: matrices[name] for name in _of_size(archive, size)}
        lengths = [run.time_s.size for run in runs]
        passing = [passing_samples(run, phantom) for run in runs]
        low, high = np.percentile(passing, [5, 95])
        particle = particles.get(size)
        row = (
            f"{size:g}",
            min(lengths),
            max(lengths),
            sum(length >= int(phantom.advance.longest_samples) for length in lengths),
            round(float(of_size[middle_recording(of_size)].max()), 2),
            round(max(float(matrix.max()) for matrix in of_size.values()), 2),
            round(low),
            round(high),
            "" if particle is None else _span(particle.peak_spacing),
            "" if particle is None else _span(particle.horizontal_spread),
        )
        rows.append(dict(zip(COLUMNS, row, strict=True)))
    return rows


def _of_size(archive: Mapping[str, Run], size_mm: float) -> list[str]:
    return [name for name, run in archive.items() if run.nodule_mm == size_mm]


def _span(values: np.ndarray) -> str:
    return f"{values.min():.0f}-{values.max():.0f}"
