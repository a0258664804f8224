"""What the runs and templates of a simulated archive are like, beside the paper's words on them."""

from collections.abc import Mapping

import numpy as np

from capsule.phantom.parameters import Phantom
from capsule.phantom.simulation import Run
from capsule.templates import TemplateSet
from phantom_study.simulated_archive import passing_samples

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


def describe(
    archive: Mapping[str, Run],
    matrices: Mapping[str, np.ndarray],
    templates: TemplateSet,
    phantom: Phantom,
) -> list[dict]:
    """Describe the runs of each size.

    Parameters
    ----------
    archive
        Runs by recording name, such as ``3mm/r07``.
    matrices
        Their matrices V, shape (S, L).
    templates
        Learned from them.

    Returns
    -------
    list of dict
        One row a size, with `COLUMNS`: how long the runs are, how many were stopped by hand, how
        high the matrix of the run with the middling sum and that of any run is, the 5 and 95 %
        points of the times from sensor to sensor over the place, and the smallest and largest
        Delta mu and sigma_hor of the size's template, as text such as ``128-181``.
    """
    particles = {
        size: total.mean()
        for size, total in zip(templates.sizes_mm, templates.totals, strict=True)
        if size > 0
    }
    rows = []
    for size in sorted({run.nodule_mm for run in archive.values()}):
        names = [name for name, run in archive.items() if run.nodule_mm == size]
        runs = [archive[name] for name in names]
        lengths = [run.time_s.size for run in runs]
        middle = int(np.argsort([matrices[name].sum() for name in names])[len(names) // 2])
        highest = [float(matrices[name].max()) for name in names]
        passing = [passing_samples(run, phantom) for run in runs]
        low, high = np.percentile(passing, [5, 95])
        particle = particles.get(size)
        row = (
            f"{size:g}",
            min(lengths),
            max(lengths),
            sum(length >= int(phantom.advance.longest_samples) for length in lengths),
            round(highest[middle], 2),
            round(max(highest), 2),
            round(low),
            round(high),
            "" if particle is None else _span(particle.peak_spacing),
            "" if particle is None else _span(particle.horizontal_spread),
        )
        rows.append(dict(zip(COLUMNS, row, strict=True)))
    return rows


def _span(values: np.ndarray) -> str:
    return f"{values.min():.0f}-{values.max():.0f}"
