"""Read the parts of the report: results, figures, the template and the versions of packages.

The figures inside the page get the colours of dark mode. The files in results/figures stay light,
for papers.
"""

import base64
import hashlib
import importlib.metadata
import platform
import re
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from capsule import files
from capsule.arrays import FloatArray
from capsule.detectors.registry import DETECTORS
from capsule.evaluation.files import (
    read_evaluation,
    read_table,
)
from capsule.figures.registry import FIGURES
from capsule.keys import imported_files
from capsule.kinds import Cells, Settings
from capsule.page import surveys
from capsule.page.render import Frame
from capsule.page.sections import Tables
from capsule.project import PROJECT

# The scripts of the rules, in their order.
RULE_SCRIPTS = (
    *("preprocess", "list", "fit", "describe", "templates", "evaluate", "detect", "draw"),
    *("chart_survey", "report"),
)
PACKAGES = ("snakemake", "numpy", "scipy", "pandas", "matplotlib", "jinja2")
UPLOT = "vendor/uplot/uPlot.iife.min.js"
STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
# Each script uses only scripts above it.
_NAMES = (
    *("signals", "palette", "elements", "grid", "saving", "tools", "matrix", "address"),
    *("chart_frame", "charts", "score_chart", "evidence_charts", "evidence_list", "tables"),
    *("viewer", "shown", "switches", "folds", "glossary", "links", "notes", "recording_rows"),
    *("evidence_store", "chooser", "recordings_table", "copy", "survey_time", "survey_capsule"),
    *("survey_closeup", "survey_signals", "survey_overlay", "surveys", "start"),
)
SCRIPTS = (UPLOT, *(f"scripts/{name}.js" for name in _NAMES))
TEMPLATES = ("report.html.j2", "macros.html.j2", "sections/[!.]*.html.j2")

# In dark mode, white becomes the background of a section, and the figures' ink becomes the colour
# of the text. Both colours are those of report.css.
PAPER, INK = "#1b2026", "#e9ecf0"
_WHITE, _FIGURE_INK = "#ffffff", "#1a1a1a"
_COLOUR = re.compile(rb"(fill|stroke): (#[0-9a-f]{6})")
_OPENING = re.compile(rb"<svg\b[^>]*>")
# The Oklab colour space, in which equal steps of lightness look equal (Ottosson 2020). The first
# matrix turns linear sRGB into cone responses; the second turns their cube roots into lightness
# and two axes of colour.
_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def read_tables(results: Path, template: Path, printed: Settings, settings: Settings) -> Tables:
    """Read the tables that the page shows.

    Parameters
    ----------
    results, template : Path
        The folders of results and of the template.
    printed, settings : mapping
        The content of paper.yaml, and the configuration.
    """
    confidence = settings["evaluation"]["confidence"]
    evaluation = read_evaluation(results / "evaluation", printed, confidence)
    return Tables(
        evaluation=evaluation,
        judgements=evaluation.tables,
        index=read_table(results / "recordings.csv"),
        settings=settings,
        passed_over=read_table(results / "passed_over.csv"),
        detections=read_table(results / "detections.csv"),
        sites=read_table(results / "sites.csv"),
        templates=files.read_json(results / "templates.json")["templates"],
        learning=read_table(results / "evaluation" / "learning.csv"),
        benches=files.read_csv(template / "benches.csv"),
        references=(template / "references.bib").read_text(encoding="utf-8"),
    )


def read_figures(folder: Path) -> dict[str, dict[str, str]]:
    """Read each figure at the widths of a page and of a column, as addresses of images."""
    return {name: _pictures(folder, name) for name in FIGURES}


def read_surveys(folder: Path, names: Iterable[str], passed_over: Mapping[str, str]) -> Cells:
    """Read the values that the page shows for each survey, with its pictures at both widths.

    Parameters
    ----------
    folder : Path
        results/surveys.
    names : iterable of str
        Names of the surveys.
    passed_over : mapping of str to str
        Folders that hold no finished survey, each with the reason.
    """
    drawn = [
        files.read_json(folder / name / "survey.json")
        | {"pictures": _pictures(folder / name, "picture")}
        for name in names
    ]
    return surveys.page_values(drawn, passed_over)


def _pictures(folder: Path, name: str) -> dict[str, str]:
    """Return a figure at both widths as addresses of images inside the page."""
    return {
        width: "data:image/svg+xml;base64,"
        + base64.b64encode(with_dark_colours((folder / f"{name}{suffix}.svg").read_bytes())).decode(
            "ascii"
        )
        for width, suffix in (("wide", ""), ("narrow", "_column"))
    }


def read_frame(folder: Path) -> Frame:
    """Read the templates, styles and scripts of the page from the folder of the template."""
    templates = {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for pattern in TEMPLATES
        for path in sorted(folder.glob(pattern))
    }
    style, script = (
        "\n".join((folder / name).read_text(encoding="utf-8") for name in names)
        for names in (STYLES, SCRIPTS)
    )
    return Frame(templates, style, script)


def code_checksums() -> dict[str, str]:
    """Return the SHA-256 of each file of the rules' code, by its path in the project.

    An installed library stands beside the project's files.
    """
    scripts = PROJECT / "workflow" / "scripts"
    registered = [row.module for row in DETECTORS.values()]
    registered += [row.module for row in FIGURES.values()]
    paths = {scripts / f"{name}.py" for name in RULE_SCRIPTS}
    paths |= {each for path in paths for each in imported_files(path, registered)}
    found = {}
    for path in paths:
        folder = PROJECT if path.is_relative_to(PROJECT) else PROJECT.parent
        checksum = hashlib.sha256(path.read_bytes()).hexdigest()
        found[path.relative_to(folder).as_posix()] = checksum
    return found


def read_versions(template: Path) -> list[tuple[str, str]]:
    """Read the versions of Python, of the packages that computed the results, and of uPlot.

    Parameters
    ----------
    template : Path
        The folder of the template; the first line of uPlot's file names its version.
    """
    packages = [(name, importlib.metadata.version(name)) for name in PACKAGES]
    first_line = (template / UPLOT).read_text(encoding="utf-8").partition("\n")[0]
    chart = first_line.partition("(v")[2].partition(")")[0]
    return [("Python", platform.python_version()), *packages, ("uPlot", chart)]


def with_dark_colours(svg: bytes) -> bytes:
    """Return an SVG file of matplotlib with colours for a dark page in one ``style`` element more.

    The file's style attributes give colours as ``fill: #rrggbb`` and ``stroke: #rrggbb``.
    """
    # One rule per property and colour overrides the style attributes.
    rules = b"".join(
        b'[style*="%b: %b"]{%b:%b!important}'
        % (name, colour, name, dark_colour(colour.decode()).encode())
        for name, colour in sorted(set(_COLOUR.findall(svg)))
    )
    style = b'<style id="dark">@media (prefers-color-scheme: dark){' + rules + b"}</style>"
    return _OPENING.sub(lambda opening: opening[0] + style, svg, count=1)


def dark_colour(colour: str) -> str:
    """Return a figure's colour, such as ``#1a1a1a``, for a dark page.

    The lightness is inverted, the hue is kept.
    """
    white, ink, paper, text, lab = (
        _lab_of(each) for each in (_WHITE, _FIGURE_INK, PAPER, INK, colour)
    )
    darkness = (white[0] - lab[0]) / (white[0] - ink[0])
    # White becomes PAPER and the figures' ink becomes INK exactly, with their tints.
    return _colour_of(paper + darkness * (text - paper) + np.array([0.0, lab[1], lab[2]]))


def _lab_of(colour: str) -> FloatArray:
    """Return lightness and the two axes of colour, (3,)."""
    part = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    lab: FloatArray = _TO_LAB @ np.cbrt(_TO_CONES @ linear)
    return lab


def _colour_of(lab: FloatArray) -> str:
    """Return the colour of the given lightness and axes, limited to what a screen can show."""
    linear = np.linalg.solve(_TO_CONES, np.linalg.solve(_TO_LAB, lab) ** 3).clip(0, 1)
    part = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return "#" + "".join(f"{round(255 * value):02x}" for value in part)
