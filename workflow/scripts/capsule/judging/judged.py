"""Judge any file as a recording: the workflow's check, every detector, and what the user sees."""

import argparse
import json
import shutil
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from capsule import arrays, words
from capsule.detectors.base import Verdict, why_unknown
from capsule.detectors.described_recording import DescribedRecording
from capsule.detectors.familiar import Familiarity
from capsule.detectors.unlike import because
from capsule.engine.configuration import read_settings
from capsule.engine.project import config_file
from capsule.errors import WrongOptionError
from capsule.judging.verdict import FinalVerdict, Judgement, note_of_change
from capsule.method.preprocessing import preprocess_run
from capsule.recordings.acceptance import check_recording
from capsule.recordings.held_out import teaching
from capsule.recordings.names import displayed
from capsule.recordings.origin import is_simulated
from capsule.recordings.recording import source_of
from capsule.store import files
from capsule.store.files import read_limited
from capsule.store.results import OfArchive
from capsule.words import BARS, PLAIN_BARS, trace

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
    judgement : Judgement
        What the detectors say of it.
    taught_as : str
        Labelled recording with the same readings, such as ``3mm/r07``, from which the detectors
        have learned; empty if there is none.
    """

    file: str
    check: dict[str, Any]
    values: np.ndarray
    judgement: Judgement
    taught_as: str

    @property
    def is_accepted(self) -> bool:
        """Return whether the workflow would accept the file."""
        return bool(self.check["status"] == "accepted")


def taught_recordings(index: Path, held_out: Sequence[str]) -> dict[str, str]:
    """Return the names of the recordings that teach, by the checksums of their readings.

    The index is ``results/recordings.csv``; without it the result is empty. ``held_out`` is
    ``evaluation.held_out`` of the configuration.
    """
    rows = teaching(files.accepted_recordings(index), held_out) if index.exists() else {}
    return {
        row["readings_sha256"]: name
        for name, row in rows.items()
        if row["size_mm"] and not row["no_verdict"]
    }


def judge_file(path: Path, final: FinalVerdict, taught: Mapping[str, str]) -> JudgedFile:
    """Judge one file.

    Parameters
    ----------
    path : Path
        The file.
    final : FinalVerdict
        The detectors.
    taught : mapping of str to str
        Result of `taught_recordings`.
    """
    settings = final.settings
    max_bytes = int(settings["recording"]["max_megabytes"] * 1e6)
    try:
        content = read_limited(path, max_bytes)
    except OSError as error:
        check = {"status": "rejected", "reason": f"it cannot be read: {error.strerror}"}
        return JudgedFile(str(path), check, np.empty((0, 0)), Judgement(settings), "")
    check, values, _ = check_recording(_NAME, content, max_bytes, settings, str(path))
    judged = check["status"] == "accepted" and not check["no_verdict"]
    judgement = final.judge(values) if judged else Judgement(settings)
    taught_as = taught.get(check["readings_sha256"], "")
    return JudgedFile(str(path), check, values, judgement, taught_as)


def as_plain_values(judged: JudgedFile) -> dict[str, Any]:
    """Return the result for a file as values that JSON can hold; an unknown value is None."""
    check, judgement = judged.check, judged.judgement
    familiarity, rate_hz = judgement.familiarity, judgement.settings["recording"]["rate_hz"]
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
        "familiar": familiarity.familiar,
        "unfamiliar_because": because(familiarity.cells),
        "verdicts": {
            name: _verdict_values(verdict, rate_hz, familiarity)
            for name, verdict in judgement.verdicts.items()
        },
    }


def _verdict_values(verdict: Verdict, rate_hz: float, familiarity: Familiarity) -> dict[str, Any]:
    values = dict(vars(verdict)) | {"reason": why_unknown(verdict)}
    values["probability"] = familiarity.stated(verdict.probability)
    # The same unit as in results/detections.csv.
    values["location_s"] = values.pop("location_samples") / rate_hz
    values["distances"] = verdict.distances or ()
    return {name: arrays.plain(value) for name, value in values.items()}


_MARKS = "abcdefghij"


def judged_lines(judged: JudgedFile, width: int, *, plain: bool = False) -> list[str]:
    """Return the lines that show a judged file.

    Parameters
    ----------
    judged : JudgedFile
        The file's result.
    width : int
        Largest number of characters in a line of the plot.
    plain : bool
        Whether the terminal shows ASCII only.
    """
    check = judged.check
    if not judged.is_accepted:
        return [f"{displayed(judged.file)}: rejected: {check['reason']}"]
    rate_hz = judged.judgement.settings["recording"]["rate_hz"]
    source = displayed(source_of(check["header"])) or "source not given"
    duration = words.duration(check["duration_s"])
    title = f"{displayed(judged.file)}: {check['samples']} samples, {duration}, {source}"
    places = places_s(judged.judgement.verdicts, rate_hz)
    lines = [title, *_plot(judged.values, places, rate_hz, width, plain=plain)]
    if check["no_verdict"]:
        return [*lines, f"no detector can judge it: {check['no_verdict']}"]
    lines += judged.judgement.lines()
    if judged.taught_as:
        lines.append(
            f"note: the detectors have learned from this very recording ({judged.taught_as}), so "
            "they already know its size"
        )
    return lines


def places_s(verdicts: Mapping[str, Verdict], rate_hz: float) -> dict[float, list[str]]:
    """Return the times in s at which sensor 1 passes a nodule, each with its detectors' names."""
    places: dict[float, list[str]] = {}
    for name, verdict in verdicts.items():
        if words.is_known(verdict.location_samples):
            places.setdefault(verdict.location_samples / rate_hz, []).append(name)
    return dict(sorted(places.items()))


def _plot(
    values: np.ndarray,
    places: Mapping[float, Sequence[str]],
    rate_hz: float,
    width: int,
    *,
    plain: bool,
) -> list[str]:
    """Return one line of bars per sensor, and below them a mark at each place."""
    label = "sensor 1 "
    cells = max(min(width - len(label), values.shape[1]), 1)
    edges = np.linspace(0, values.shape[1], cells + 1).astype(int)
    bars = PLAIN_BARS if plain else BARS
    lines = []
    for sensor, readings in enumerate(values, start=1):
        means = [_mean(readings[a:b]) for a, b in pairwise(edges)]
        lines.append(f"{f'sensor {sensor}':<{len(label)}}{trace(means, bars)}".rstrip())
    inside = {place: names for place, names in places.items() if place >= 0}
    if inside:
        row = [" "] * cells
        for mark, place in zip(_MARKS, inside, strict=False):
            row[min(int(place * rate_hz * cells / values.shape[1]), cells - 1)] = mark
        lines.append(f"{'place':<{len(label)}}{''.join(row)}".rstrip())
        named = [
            f"{mark}: {words.enumerate_words(names)}"
            for mark, names in zip(_MARKS, inside.values(), strict=False)
        ]
        lines.append(f"{'':<{len(label)}}{', '.join(named)}")
    return lines


def _mean(readings: np.ndarray) -> float | None:
    known = readings[~np.isnan(readings)]
    return float(known.mean()) if known.size else None


def write_picture(judged: JudgedFile, path: Path) -> None:
    """Draw an accepted recording and the places of its verdicts to a .png or .svg file."""
    from capsule.figures.draw_signals import draw_judged  # matplotlib only if it is used
    from capsule.figures.style import render_figure

    judgement, settings = judged.judgement, judged.judgement.settings
    shape, rate_hz = settings["preprocessing"], settings["recording"]["rate_hz"]
    simulated = is_simulated(judged.check["header"].get("source", ""))
    name = f"{Path(judged.file).name}{', simulated' if simulated else ''}"
    said = [
        f"{detector}: {judgement.word(detector)}"
        + (f" {words.estimated_size(vars(each))}" if each.predicted_mm > 0 else "")
        for detector, each in judgement.verdicts.items()
    ]
    run = preprocess_run(
        judged.file,
        "\n".join([name, *said]),
        judged.values,
        rate_hz=rate_hz,
        window=shape["window"],
        threshold=shape["threshold"],
    )
    places = places_s(judgement.verdicts, rate_hz)
    passage = DescribedRecording(judged.values, settings).passage
    passing_s = tuple(
        (passage.location_samples + sensor * passage.lag_samples) / rate_hz
        for sensor in range(len(judged.values))
    )
    # The paper's detector has a place of its own, and says nothing of the way to sensor 4.
    found = passing_s[0] in places
    figure = draw_judged(run, shape["threshold"], places, passing_s if found else ())
    with files.write_whole(path, "wb") as stream:
        stream.write(render_figure(figure, path.suffix.lstrip("."), name))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = "exit status: 0 judged, 1 a file was rejected, or other fault"
    add = parser.add_argument
    add("files", type=Path, nargs="+", metavar="FILE", help="a recording, in any folder")
    results = "the workflow's results: detectors.json and templates.npz (default: results/)"
    add("--results", type=Path, default=Path("results"), metavar="FOLDER", help=results)
    config = "the workflow's configuration (default: config/config.yaml here, or the shipped one)"
    add("--config", type=Path, default=config_file(), metavar="FILE", help=config)
    picture = "draw the recording, and the place of the nodule, to a .png or .svg file"
    add("--picture", type=Path, metavar="FILE", help=picture)
    add("--json", action="store_true", help="print the verdicts as JSON, for other programs")


def main(arguments: argparse.Namespace) -> int:
    """Judge each file, and print the verdicts; return 0 only if all files were accepted.

    Raises
    ------
    CapsuleError
        The results or the configuration cannot be used.
    WrongOptionError
        Options contradict each other.
    """
    if arguments.picture and len(arguments.files) > 1:
        raise WrongOptionError("--picture draws one recording: give one FILE")
    if arguments.picture and arguments.picture.suffix not in (".png", ".svg"):
        raise WrongOptionError(f"--picture {arguments.picture}: the name must end in .png or .svg")
    settings, results = read_settings(arguments.config), arguments.results
    learned = results / OfArchive.DETECTORS
    final = FinalVerdict(results / OfArchive.TEMPLATES, learned, settings, "a verdict")
    if note := note_of_change(results, settings):
        print(note, file=sys.stderr)
    taught = taught_recordings(results / OfArchive.RECORDINGS, settings["evaluation"]["held_out"])
    judged = [judge_file(path, final, taught) for path in arguments.files]
    if arguments.json:
        values = [as_plain_values(each) for each in judged]
        print(json.dumps(values, indent=1, allow_nan=False))
    else:
        width = shutil.get_terminal_size().columns - 1
        plain = not (sys.stdout.encoding or "ascii").lower().startswith("utf")
        for each in judged:
            print("\n".join(judged_lines(each, width, plain=plain)))
    if arguments.picture and judged[0].is_accepted:
        write_picture(judged[0], arguments.picture)
    return int(not all(each.is_accepted for each in judged))
