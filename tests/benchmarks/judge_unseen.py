"""Judge the detectors on simulated benches, of which some had no part in making them.

    python tests/benchmarks/judge_unseen.py --folders FOLDER ... --archives 40 --cache FOLDER
        --output workflow/studies/results/detection-benches.md --ranges workflow/report/benches.csv
        --pages docs/detection.md

Judged are the benches of judged_only.py, the usual bench, every bench of config/benches/, and
folders of recordings of other benches: each file of a folder is an archive, an .npz of arrays
(S, K) by names such as 3mm/r07. Each detector judges the recordings of each place by what the other
places of the archive teach, and fresh healthy recordings of the bench by what the whole archive
teaches. A recording without a verdict is a failure: it counts neither as found nor as healthy. The
paper's margin needs a particle fit for each recording, so it judges fewer archives, with --fit
particles and iterations. --cache keeps what describes the recordings, so that a second run on the
same archives, with other detectors, only judges. --pages writes the results into documents.
"""

import argparse
import functools
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

FOLDERS = [Path(__file__).parents[2] / "workflow" / each for each in ("scripts", "studies")]
sys.path[:0] = map(str, FOLDERS)

from judge_rates import rates
from judged_only import BENCHES as JUDGED_ONLY_BENCHES
from phantom_study.simulated_archive import DetectorSettings, average_fits, fit_archive
from unseen_archives import (
    SIZES_MM,
    USUAL,
    Description,
    Readings,
    Source,
    UnseenArchive,
    bench_names,
    describe,
    described,
    simulated,
    stored,
)
from unseen_report import DETECTORS, filled_page, page_blocks, range_rows, whole_report

from capsule.arguments import natural
from capsule.detectors.base import NO_VERDICT, StoredRecording, TrainingArchive
from capsule.detectors.described import read_scorer
from capsule.detectors.network import Scorer
from capsule.detectors.registry import detector_class
from capsule.engine.configuration import read_config_file
from capsule.engine.forks import Forks
from capsule.engine.project import CONFIG, WEIGHTS
from capsule.method.preprocessing import preprocess
from capsule.method.templates import TemplateSet, no_nodule_template
from capsule.recordings.names import size_mm
from capsule.store.files import write_csv

# Other benchmarks take these from here.
__all__ = ["SIZES_MM", "USUAL", "bench_names", "judge", "simulated", "stored", "training_archive"]


def training_archive(
    readings: Readings,
    config: Mapping,
    scorer: Scorer,
    effort: int,
    description: Description | None = None,
) -> TrainingArchive:
    """Put together what the detectors learn from; without effort no particle is fitted.

    Parameters
    ----------
    readings
        The recordings, arrays (S, K) by name; not used if they are described and nothing is fitted.
    config, scorer
        The configuration and the network.
    effort
        Particles and iterations of each fit.
    description
        What describes the recordings, if it is known; else they are described here.
    """
    if description is None:
        alone = UnseenArchive(readings, {name: name for name in readings}, {})
        description = describe(alone, config, scorer)
    particles, templates = {}, TemplateSet((0.0,), (), (no_nodule_template(1, 1),), 1)

    def matrix(name: str) -> np.ndarray:
        return preprocess(readings[name], **config["preprocessing"])

    if effort:
        settings = DetectorSettings(
            config["preprocessing"], {**config["fit"], "particles": effort, "iterations": effort}
        )
        particles = fit_archive({name: matrix(name) for name in description.places}, settings)
        templates = average_fits(particles, settings, config["preprocessing"]["length"])
    recordings = {
        name: StoredRecording(
            functools.partial(matrix, name), passage, features=description.features[name]
        )
        for name, passage in description.passages.items()
    }
    return TrainingArchive(
        {name: size_mm(name) for name in description.places},
        recordings,
        templates,
        particles,
        config,
        description.no_verdict,
        description.places,
    )


def judge(
    archive: TrainingArchive,
    detector: str,
    places: Mapping[str, str] | None = None,
    fresh: Sequence[str] = (),
) -> dict[str, float]:
    """Judge each place by what the others teach, and fresh recordings by what all teach.

    Parameters
    ----------
    archive
        The archive, which also describes the fresh recordings.
    detector
        Name of the detector.
    places
        The place of each labelled recording; None if each is a place of its own.
    fresh
        Names of healthy recordings that teach nothing.
    """
    places = places or {name: name for name in archive.no_verdict if name not in set(fresh)}
    started = time.process_time()
    taught = detector_class(detector)
    verdicts = dict.fromkeys([*places, *fresh], NO_VERDICT)
    together: dict[str, list[str]] = {}
    for name, place in places.items():
        if not archive.no_verdict[name]:
            together.setdefault(place, []).append(name)
    for names in together.values():
        model = taught.taught(archive, names)
        verdicts.update({name: model.verdict(archive.recordings[name]) for name in names})
    seconds = time.process_time() - started
    if fresh:
        model = taught.taught(archive)
        judged = [name for name in fresh if not archive.no_verdict[name]]
        verdicts.update({name: model.verdict(archive.recordings[name]) for name in judged})

    def column(names: Sequence[str], field: str) -> np.ndarray:
        return np.array([getattr(verdicts[name], field) for name in names])

    labelled = list(places)
    true_mm = np.array([size_mm(name) for name in labelled])
    row = rates(true_mm, column(labelled, "predicted_mm"))
    low, high = (column(labelled, f"estimate_{end}_mm") for end in ("low", "high"))
    sized = ~np.isnan(low) & (true_mm > 0)
    held = (low <= true_mm + 1e-9) & (true_mm <= high + 1e-9)
    # An interval without an upper end counts up to the largest size of the archive.
    width = np.minimum(high, true_mm.max()) - low
    unknown = np.isnan(column([*labelled, *fresh], "predicted_mm"))
    healthy = column(fresh, "predicted_mm") == 0
    return {
        "specificity": float(healthy.mean()) if healthy.size else np.nan,
        "specificity, left out": row["specificity"],
        **{name: row[name] for name in ("recall at 1 mm", "recall from 2 mm")},
        "within 1 mm, from 2 mm": row["within 1 mm, from 2 mm"],
        "no verdict": float(unknown.mean()),
        "intervals that hold the size": float(held[sized].mean()) if sized.any() else np.nan,
        "their median width (mm)": float(np.median(width[sized])) if sized.any() else np.nan,
        "seconds": seconds,
    }


def judge_archive(
    source: Source,
    number: int,
    config: Mapping,
    scorer: Scorer,
    arguments: argparse.Namespace,
) -> dict[str, dict[str, float]]:
    """Judge one archive of a bench by every detector, the paper's margin only on the first ones."""
    description = described(source, number, config, scorer, arguments.weights, arguments.cache)
    detectors = arguments.detectors
    effort = arguments.fit if number < arguments.fitted else 0
    readings: Readings = {}
    if effort and "template" in detectors:
        archive = source.archive(number)
        readings = {**archive.readings, **archive.fresh}
    else:
        effort = 0
    taught = training_archive(readings, config, scorer, effort, description)
    return {
        detector: judge(taught, detector, description.places, description.fresh)
        for detector in detectors
        if effort or detector != "template"
    }


def read_arguments() -> argparse.Namespace:
    """Read what to judge."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    add = functools.partial(parser.add_argument, metavar="N", type=natural)
    add("--archives", default=40, help="archives of each simulated bench (default: 40)")
    add("--fitted", default=4, help="archives that the paper's margin judges (default: 4)")
    add("--fit", default=300, help="particles and iterations of its fits (default: 300)")
    add("--runs", default=20, help="places of each size in an archive (default: 20)")
    add("--passes", default=1, help="passes over each place (default: 1)")
    add("--processes", default=2, help="archives that are judged at a time (default: 2)")
    parser.add_argument(
        "--detectors", nargs="+", choices=DETECTORS, default=DETECTORS, help="(default: all)"
    )
    every = [*JUDGED_ONLY_BENCHES, *bench_names()]
    parser.add_argument(
        "--benches", nargs="*", choices=every, default=every, help="simulated ones (default: all)"
    )
    add = functools.partial(parser.add_argument, metavar="PATH", type=Path)
    add("--folders", nargs="*", default=[], help="folders of archives of other benches")
    add("--weights", default=WEIGHTS, help="the scorer's weights (default: those that ship)")
    add("--cache", help="folder that keeps what describes the recordings")
    add("--output", help="output: the table, Markdown")
    add("--ranges", help="output: the range, for the report, CSV")
    add("--rows", help="output: the rates of each archive, CSV")
    add("--pages", nargs="*", default=[], help="documents in which the results are written anew")
    parser.add_argument(
        "--describe-only", action="store_true", help="fill the folder of --cache, and judge nothing"
    )
    return parser.parse_args()


def main() -> None:
    """Judge every bench, and write the tables."""
    arguments = read_arguments()
    config, scorer = read_config_file(CONFIG / "config.yaml"), read_scorer(arguments.weights)
    sources = [Source(name, None, arguments.runs, arguments.passes) for name in arguments.benches]
    sources += [Source(folder.name, folder) for folder in arguments.folders]
    # Each bench's first archive, then each second one: both processes are busy to the end.
    tasks = [
        (source, number)
        for number in range(max(arguments.archives, *(len(source.files) for source in sources)))
        for source in sources
        if number < (len(source.files) if source.folder else arguments.archives)
    ]

    def judged_archive(task: tuple[Source, int]) -> dict[str, dict[str, float]]:
        source, number = task
        if arguments.describe_only:
            described(source, number, config, scorer, arguments.weights, arguments.cache)
            return {}
        return judge_archive(source, number, config, scorer, arguments)

    judged: dict[str, dict[str, list[dict]]] = {
        source.bench: {detector: [] for detector in arguments.detectors} for source in sources
    }
    rows = []
    of_tasks = Forks(arguments.processes)(judged_archive, tasks)
    for done, ((source, number), of_archive) in enumerate(zip(tasks, of_tasks, strict=True), 1):
        for detector, row in of_archive.items():
            judged[source.bench][detector].append(row)
            label = {"bench": source.bench, "archive": number + 1, "detector": detector}
            rows.append(label | row)
        print(f"{done} of {len(tasks)}: {source.bench} {number + 1}", file=sys.stderr, flush=True)
    if arguments.describe_only:
        return
    text = whole_report(judged, arguments.fit)
    if arguments.rows:
        write_csv(arguments.rows, list(rows[0]), rows)
    if arguments.ranges:
        ranges = range_rows(judged)
        write_csv(arguments.ranges, list(ranges[0]), ranges)
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")
    blocks = page_blocks(judged)
    for page in arguments.pages:
        page.write_text(filled_page(page.read_text(encoding="utf-8"), blocks), encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
