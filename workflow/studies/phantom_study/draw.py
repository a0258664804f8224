"""Draw the figures of the phantom's documentation, and compute their data.

The study draws three figures as SVG. phantom-signals shows simulated runs. phantom-table shows the
output of study_phantom.py judge. phantom-sensitivity shows how the rates change with the bench. The
data of the first and the last figure are also written as CSV.
"""

import argparse
import functools
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from capsule.commands.options import natural
from capsule.figures.style import (
    DETECTOR_LOOKS,
    MUTED,
    ORANGE,
    SENSOR_COLOURS,
    SENSOR_DASHES,
    figure_style,
    render_figure,
)
from capsule.method.preprocessing import normalize, rms_envelope
from capsule.method.templates import TemplateSet
from capsule.phantom.files import read_phantom
from capsule.phantom.parameters import Phantom, value_of, with_values
from capsule.phantom.simulation import Run
from capsule.seeding import generator
from capsule.store import files
from phantom_study.paper_table import PaperTable, cells, read_paper_table
from phantom_study.simulated_archive import (
    SIZES_MM,
    DetectorSettings,
    archive_matrices,
    classify,
    learn,
    passing_samples,
    quick,
    read_detector,
    simulate_archive,
)

# Sizes of the signals that are shown. One more size would make the page too wide.
SHOWN_MM = (0, 2, 3, 4, 5)
# The parameters of each disturbance, and the factors by which its levels multiply them; 1 is the
# calibrated bench.
VARIATIONS = {
    "noise": (("sensor.noise",), (0, 1, 4, 8, 16, 32)),
    "drift": (("sensor.drift_per_s", "sensor.settling"), (0, 0.25, 0.5, 1, 2, 4)),
    "speed": (("advance.speed_mm_s",), (0.7, 0.85, 1, 1.25, 1.5, 2)),
    "contact variation": (
        (
            "contact.coupling_spread",
            "contact.series_offset_mm",
            "contact.height_offset_mm",
            "contact.wander_mm",
            "wall.unevenness_mm",
        ),
        (0, 0.5, 1, 1.5, 2, 3),
    ),
}
# Name of the disturbance whose levels are `FAULTS`.
FAULTY = "one faulty sensor"
# Seed of the archive that makes the templates, and first seed of the archives that are classified.
_TEMPLATE_SEED, _FIRST_SEED = 1, 1001


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this study."""
    add = functools.partial(parser.add_argument, type=Path, required=True)
    add("--table", metavar="FILE", help="the cells, from the output of judge")
    add("--output", metavar="FOLDER", help="output: folder of the figures")
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=5, help="archives at each level of a disturbance (default: 5)")
    add("--runs", default=20, help="runs of each size in such an archive (default: 20)")
    seed = "random seed of the signals shown (default: 1)"
    parser.add_argument("--seed", metavar="N", type=int, default=1, help=seed)


def run(arguments: argparse.Namespace) -> None:
    """Write the figures and the tables."""
    phantom = read_phantom(arguments.parameters, arguments.changes, arguments.bench)
    detector, paper = read_detector(arguments.config), read_paper_table()
    folder = arguments.output

    archive = simulate_archive(phantom, arguments.seed, paper.runs)
    matrices = archive_matrices(archive, detector)
    shown = examples(archive, matrices, SHOWN_MM, detector.preprocessing["window"])
    save(draw_signals(shown), folder / "phantom-signals.svg")
    rows = describe(archive, matrices, learn(matrices, detector), phantom)
    files.write_csv(folder / "phantom-signals.csv", list(rows[0]), rows)

    save(draw_cells(files.read_csv(arguments.table)), folder / "phantom-table.svg")

    rows = []
    for row in sweep(phantom, quick(detector), paper, arguments.archives, arguments.runs):
        rows.append(row)
        print(f"\rsensitivity: {row['variation']} {row['level']}  ", end="", file=sys.stderr)
    print(file=sys.stderr)
    files.write_csv(folder / "phantom-sensitivity.csv", list(rows[0]), rows)
    save(draw_sensitivity(rows), folder / "phantom-sensitivity.svg")


def save(figure: Figure, path: Path) -> None:
    """Write a figure as SVG."""
    with files.write_whole(path, "wb") as stream:
        stream.write(render_figure(figure, "svg", path.stem))


@dataclass(frozen=True)
class Example:
    """A typical run: its title in the figure, its RMS envelope (S, K) and its matrix V (S, L)."""

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


def middle_recording(matrices: Mapping[str, np.ndarray]) -> str:
    """Return the name of the recording whose matrix V has the median sum."""
    names = list(matrices)
    return names[int(np.argsort([matrix.sum() for matrix in matrices.values()])[len(names) // 2])]


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
        One row for each size:

        - the lengths of the shortest and the longest run, in samples
        - the number of runs that were stopped by hand
        - the maximum of the matrix with the median sum, and of all matrices
        - the 5 % and 95 % points of the times from sensor to sensor over the nodule, in samples
        - the smallest and largest Delta mu and sigma_hor of the template, such as ``128-181``
    """
    longest = int(phantom.advance.longest_samples)
    rows = []
    for size, total in zip(templates.sizes_mm, templates.totals, strict=True):
        of_size = {name: matrices[name] for name in _of_size(archive, size)}
        runs = [archive[name] for name in of_size]
        lengths = [each.time_s.size for each in runs]
        low, high = np.percentile([passing_samples(each, phantom) for each in runs], [5, 95])
        particle = total.mean()
        parameters = (particle.peak_spacing, particle.horizontal_spread)
        spacing, spread = map(_span, parameters) if size > 0 else ("", "")
        rows.append(
            {
                "size_mm": f"{size:g}",
                "shortest_samples": min(lengths),
                "longest_samples": max(lengths),
                "stopped_by_hand": sum(length >= longest for length in lengths),
                "middle_height": round(float(of_size[middle_recording(of_size)].max()), 2),
                "highest": round(max(float(matrix.max()) for matrix in of_size.values()), 2),
                "passing_low_samples": round(low),
                "passing_high_samples": round(high),
                "template_peak_spacing_samples": spacing,
                "template_horizontal_spread_samples": spread,
            }
        )
    return rows


def _of_size(archive: Mapping[str, Run], size_mm: float) -> list[str]:
    return [name for name, each in archive.items() if each.nodule_mm == size_mm]


def _span(values: np.ndarray) -> str:
    return f"{values.min():.0f}-{values.max():.0f}"


@figure_style()
def draw_signals(shown: Sequence[Example]) -> Figure:
    """Draw each run in a column, from readings to matrix, as in the paper's figure."""
    figure = Figure(figsize=(2.4 * len(shown), 5.6), layout="constrained")
    axes = figure.subplots(3, len(shown), sharex=True, sharey="row", squeeze=False)
    for (top, middle, bottom), example in zip(axes.T, shown, strict=True):
        top.set_title(example.title)
        _draw_sensors(top, middle, example)
        rows = np.arange(1, len(example.matrix) + 1)
        columns = np.arange(example.matrix.shape[1])
        levels = np.arange(0.1, 1.6, 0.2)
        bottom.contour(columns, rows, example.matrix, levels, cmap="Greys", vmin=-0.5, vmax=1.2)
        bottom.set(yticks=rows, xlabel="sample (10 a second)", ylim=(rows[-1] + 0.5, 0.5))
    axes[0, 0].set_ylabel("reading, counts\n(sensors set apart)")
    axes[1, 0].set_ylabel("RMS envelope\n(standard deviations)")
    axes[2, 0].set_ylabel("matrix V, sensor")
    axes[1, -1].legend()
    return figure


def _draw_sensors(readings_axes: Axes, envelope_axes: Axes, example: Example) -> None:
    """Draw the readings of the sensors one below the other, and their envelopes."""
    samples = np.arange(example.run.time_s.size)
    looks = zip(example.run.counts, SENSOR_COLOURS, SENSOR_DASHES, strict=False)
    for sensor, (counts, colour, dashes) in enumerate(looks):
        apart = counts - counts.mean() - 150 * sensor
        readings_axes.plot(samples, apart, color=colour, linewidth=0.7)
        line = {"color": colour, "linestyle": dashes, "label": f"sensor {sensor + 1}"}
        envelope_axes.plot(samples, example.envelope[sensor], **line)
    envelope_axes.axhline(1.0, color=MUTED, linewidth=0.6)


@figure_style()
def draw_cells(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw each cell of the paper's table over the range of the simulated archives.

    Parameters
    ----------
    rows
        Rows from `phantom_study.paper_table.summary`; numbers may be text.
    """
    figure = Figure(figsize=(7, 0.24 * len(rows) + 1.0), layout="constrained")
    axes = figure.subplots()
    heights = range(len(rows))
    low, high, mean, paper = (
        [float(row[key]) for row in rows] for key in ("low", "high", "mean", "paper")
    )
    axes.hlines(heights, low, high, color="0.7", linewidth=5, label="simulated, central 95 %")
    axes.plot(mean, heights, "k|", markersize=9, label="simulated, mean")
    axes.plot(paper, heights, "o", color=ORANGE, markersize=5, label="paper")
    axes.set(yticks=heights, yticklabels=[row["cell"] for row in rows], xlabel="%", xlim=(-2, 102))
    axes.invert_yaxis()
    figure.legend(loc="outside upper center", ncols=3)
    return figure


@figure_style()
def draw_sensitivity(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw how the rates change with each disturbance.

    Parameters
    ----------
    rows
        One row for each disturbance and level, with ``variation``, ``level`` (a factor, or the
        kind of a fault) and the rates in percent.
    """
    variations = list(dict.fromkeys(row["variation"] for row in rows))
    figure = Figure(figsize=(9.5, 5.6), layout="constrained")
    axes = figure.subplots(2, 3, sharey=True).ravel()
    rates = [key for key in rows[0] if key not in ("variation", "level")]
    for panel, variation in zip(axes, variations, strict=False):
        chosen = [row for row in rows if row["variation"] == variation]
        _panel(panel, variation, chosen, rates)
    for panel in axes[len(variations) :]:
        panel.axis("off")
    handles, labels = axes[0].get_legend_handles_labels()
    axes[-1].legend(handles, labels, loc="center")
    for panel in (axes[0], axes[3]):
        panel.set_ylabel("%")
    return figure


def _panel(axes: Axes, variation: str, rows: Sequence[Mapping[str, str]], rates: list[str]) -> None:
    levels = [row["level"] for row in rows]
    factors = variation != FAULTY
    positions = [float(level) for level in levels] if factors else range(len(levels))
    for rate, style in zip(rates, DETECTOR_LOOKS, strict=True):
        drawn = {**style} if factors else {**style, "linestyle": "none"}
        axes.plot(positions, [float(row[rate]) for row in rows], markersize=4, label=rate, **drawn)
    axes.set(title=variation, ylim=(-3, 103))
    if factors:
        axes.set_xlabel("times the calibrated value")
        axes.axvline(1.0, color="0.85", zorder=0)
    else:
        axes.set(xticks=list(positions), xticklabels=levels, xlim=(-0.5, len(levels) - 0.5))


def varied(phantom: Phantom, parameters: Sequence[str], level: float) -> Phantom:
    """Return the phantom with some parameters at a multiple of their calibrated values."""
    return with_values(phantom, {name: level * value_of(phantom, name) for name in parameters})


def _dead(counts: np.ndarray, numbers: np.random.Generator) -> np.ndarray:
    """Return readings that do not react: only the last digit of the converter changes."""
    return int(np.median(counts)) + numbers.integers(0, 2, counts.size)


def _saturated(counts: np.ndarray, _: np.random.Generator) -> np.ndarray:
    """Return readings not below their median, so that every firm compression is cut off."""
    return np.maximum(counts, int(np.median(counts)))


FAULTS = {"none": lambda counts, _: counts, "dead": _dead, "saturated": _saturated}


def with_faults(archive: Mapping[str, Run], fault: str, seed: int) -> dict[str, Run]:
    """Return an archive with one of `FAULTS` in a random sensor of each run."""
    made = {}
    for name, sound in archive.items():
        numbers, counts = generator(seed, "fault", name), sound.counts.copy()
        sensor = int(numbers.integers(len(counts)))
        counts[sensor] = FAULTS[fault](counts[sensor], numbers)
        made[name] = replace(sound, counts=counts)
    return made


def headline(confusion: np.ndarray, paper: PaperTable) -> dict[str, float]:
    """Return the rates that the sensitivity figure shows, in percent.

    Parameters
    ----------
    confusion : (6, 6) array of int
        Runs of true size (row) classified as size (column), 0..5 mm.
    paper
        The paper's table; exact and within-tolerance rates are averaged over its sizes.
    """
    rates = cells(confusion, paper)

    def mean_of(prefix: str) -> float:
        return float(np.mean([rate for name, rate in rates.items() if name.startswith(prefix)]))

    within = f"within {paper.tolerance_mm:g} mm"
    shown = {name: rates[name] for name in ("specificity", "recall 1 mm", "recall 2 mm")}
    return shown | {"exact size": mean_of("exact "), within: mean_of(within)}


def sweep(
    phantom: Phantom,
    detector: DetectorSettings,
    paper: PaperTable,
    archives: int,
    runs: int,
) -> Iterator[dict]:
    """Yield the rates at every level of each disturbance, and with each kind of faulty sensor.

    Parameters
    ----------
    phantom
        The calibrated bench, on which the templates are made.
    detector, paper
        Settings of the detector, and the names of the rates.
    archives, runs
        Number of archives at each level, and of runs of each size in an archive.

    Yields
    ------
    dict
        ``variation``, ``level`` and the rates of `headline`.
    """
    first = archive_matrices(simulate_archive(phantom, _TEMPLATE_SEED, runs), detector)
    # A laboratory makes its templates once.
    templates = learn(first, detector)
    benches = [
        (name, level, varied(phantom, parameters, level), "none")
        for name, (parameters, levels) in VARIATIONS.items()
        for level in levels
    ]
    benches += [(FAULTY, fault, phantom, fault) for fault in FAULTS]
    for name, level, bench, fault in benches:
        confusion = np.zeros((len(SIZES_MM), len(SIZES_MM)), dtype=int)
        for seed in range(_FIRST_SEED, _FIRST_SEED + archives):
            archive = with_faults(simulate_archive(bench, seed, runs), fault, seed)
            confusion += classify(archive_matrices(archive, detector), templates)
        yield {"variation": name, "level": level} | headline(confusion, paper)
