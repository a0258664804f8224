"""Archives for the benchmarks: of the bench as configured, and of benches that differ from it.

Rows are those of `judge_archive`, one an archive.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from judge_archive import (
    dealt_anew,
    judge_by_another,
    judge_diagonal,
    judge_passes,
    judge_template,
    learn_diagonal,
    search_archive,
    simulate_archive,
)

from capsule.phantom.parameters import Phantom, value_of, with_values

# What changes, by what factor.
CONDITIONS = {
    "as configured": {},
    "noise and drift + 50 %": {
        "sensor.noise": 1.5,
        "sensor.drift_per_s": 1.5,
        "sensor.settling": 1.5,
    },
    "capsule 25 % slower": {"advance.speed_mm_s": 0.75},
    "wave 20 % faster": {"wall.speed_mm_s": 1.2},
    "contact - 30 %": {"contact.patch_mm2": 0.7, "contact.reach_mm": 0.7},
    "wall and seat + 30 %": {"wall.unevenness_mm": 1.3, "contact.wander_mm": 1.3},
}
# How far the nodule lies above or below the capsule: what a detector cannot make up for.
_HEIGHT_SPREADS = ("contact.series_offset_mm", "contact.height_offset_mm")
HEIGHTS = {
    f"{factor:g} times": dict.fromkeys(_HEIGHT_SPREADS, factor)
    for factor in (0.0, 0.5, 1.0, 1.25, 1.5, 2.0)
}


def judge_detectors(
    phantom: Phantom, seeds: Sequence[int], config: Mapping, template_archives: int, effort: int
) -> dict[str, list[dict]]:
    """Judge archives of the bench as configured by every detector.

    Parameters
    ----------
    phantom
        The bench.
    seeds
        One archive each.
    config
        The project's configuration.
    template_archives
        How many of them the paper's detector judges, from the first on.
    effort
        Number of particles and of iterations of its fits.

    Returns
    -------
    dict of str to list of dict
        The rows of each detector; the diagonal one is also taught by another archive, and by
        labels that were dealt out anew.
    """
    rows: dict[str, list[dict]] = {}
    # The last archive teaches the first one.
    teacher = learn_diagonal(search_archive(simulate_archive(phantom, seeds[-1]), config))
    for number, seed in enumerate(seeds):
        archive = simulate_archive(phantom, seed)
        judged = judge_template(archive, config, effort, seed) if number < template_archives else {}
        judged["diagonal"], searched = judge_diagonal(archive, config)
        judged["diagonal, taught by another archive"] = judge_by_another(archive, searched, teacher)
        dealt, _ = judge_diagonal(dealt_anew(archive, seed), config)
        judged["diagonal, labels dealt out anew"] = dealt
        for name, row in judged.items():
            rows.setdefault(name, []).append(row)
        teacher = learn_diagonal(searched)
    return rows


def judge_changed(
    phantom: Phantom,
    benches: Mapping[str, Mapping[str, float]],
    seeds: Sequence[int],
    config: Mapping,
    as_configured: list[dict],
) -> Iterator[tuple[str, list[dict]]]:
    """Judge archives of changed benches by the diagonal detector.

    Parameters
    ----------
    phantom
        The bench as configured.
    benches
        For each changed bench, factors on some of its parameters.
    seeds, config
        As in `judge_detectors`.
    as_configured
        The rows of a bench that does not differ.

    Yields
    ------
    label : str
        Of the bench.
    rows : list of dict
        One an archive.
    """
    for label, factors in benches.items():
        if all(factor == 1 for factor in factors.values()):
            yield label, as_configured
            continue
        changes = {name: factor * value_of(phantom, name) for name, factor in factors.items()}
        changed = with_values(phantom, changes)
        archives = (simulate_archive(changed, seed) for seed in seeds)
        yield label, [judge_diagonal(archive, config)[0] for archive in archives]


def judge_retests(phantom: Phantom, seeds: Sequence[int], config: Mapping) -> list[dict]:
    """Judge several passes over each site together: a row for each number of passes."""
    most = max(config["evaluation"]["passes"])
    judged = [judge_passes(simulate_archive(phantom, seed, most), config) for seed in seeds]
    rows = []
    for count in config["evaluation"]["passes"]:
        row = {"passes": str(count)}
        for size_mm in judged[0][count]:
            column = f"found at {size_mm} mm" if size_mm > 0 else "false alarms"
            row[column] = np.mean([shares[count][size_mm] for shares in judged])
        rows.append(row)
    return rows
