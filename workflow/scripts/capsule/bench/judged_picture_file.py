"""The picture of a judged file, as PNG or SVG."""

from pathlib import Path

from capsule import files, words
from capsule.bench.judged_file import JudgedFile
from capsule.bench.judged_view import places_s
from capsule.detectors.base import Verdict
from capsule.figures.draw_signals import draw_judged
from capsule.figures.style import render_figure
from capsule.kinds import Settings
from capsule.page.provenance import is_simulated
from capsule.preprocessing import preprocess_run


def write_picture(judged: JudgedFile, settings: Settings, path: Path) -> None:
    """Draw an accepted recording and the places of its verdicts to a .png or .svg file."""
    shape, rate_hz = settings["preprocessing"], settings["recording"]["rate_hz"]
    simulated = is_simulated(judged.check["header"].get("source", ""))
    name = f"{Path(judged.file).name}{', simulated' if simulated else ''}"
    unlike = [words.UNLIKE] if judged.familiarity.familiar is False else []
    said = [f"{detector}: {_in_short(each)}" for detector, each in judged.verdicts.items()]
    run = preprocess_run(
        judged.file,
        "\n".join([name, *unlike, "; ".join(said)]),
        judged.values,
        rate_hz=rate_hz,
        window=shape["window"],
        threshold=shape["threshold"],
    )
    figure = draw_judged(run, shape["threshold"], places_s(judged.verdicts, rate_hz))
    with files.write_whole(path, "wb") as stream:
        stream.write(render_figure(figure, path.suffix.lstrip("."), name))


def _in_short(verdict: Verdict) -> str:
    if not words.is_known(verdict.predicted_mm):
        return "no verdict"
    return words.estimated_size(vars(verdict)) if verdict.predicted_mm else "no nodule"
