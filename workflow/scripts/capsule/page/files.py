"""Read the parts of the report: results, figures, the template and the versions of packages."""

import hashlib
import importlib.metadata
import platform
from collections.abc import Iterable, Mapping
from pathlib import Path

from capsule import files
from capsule.detectors.registry import DETECTORS
from capsule.evaluation.files import (
    read_evaluation,
    read_judgements,
    read_learning,
    read_table,
)
from capsule.figures.registry import FIGURES
from capsule.keys import imported_files
from capsule.kinds import Cells, Settings
from capsule.page import survey_section
from capsule.page.dark_figures import with_dark_colours
from capsule.page.render import Frame, image_address
from capsule.page.sections import Tables
from capsule.project import PROJECT

# The scripts of the rules, in their order.
RULE_SCRIPTS = (
    "preprocess",
    "list",
    "fit",
    "describe",
    "templates",
    "evaluate",
    "detect",
    "draw",
    "chart_survey",
    "report",
)
PACKAGES = ("snakemake", "numpy", "scipy", "pandas", "matplotlib", "jinja2")
UPLOT = "vendor/uplot/uPlot.iife.min.js"
STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
# Each script uses only scripts above it.
SCRIPTS = (
    UPLOT,
    "scripts/signals.js",
    "scripts/palette.js",
    "scripts/elements.js",
    "scripts/grid.js",
    "scripts/saving.js",
    "scripts/tools.js",
    "scripts/matrix.js",
    "scripts/address.js",
    "scripts/chart_frame.js",
    "scripts/charts.js",
    "scripts/score_chart.js",
    "scripts/evidence_charts.js",
    "scripts/evidence_list.js",
    "scripts/tables.js",
    "scripts/viewer.js",
    "scripts/shown.js",
    "scripts/switches.js",
    "scripts/folds.js",
    "scripts/glossary.js",
    "scripts/links.js",
    "scripts/notes.js",
    "scripts/recording_rows.js",
    "scripts/evidence_store.js",
    "scripts/chooser.js",
    "scripts/recordings_table.js",
    "scripts/copy.js",
    "scripts/survey_time.js",
    "scripts/survey_capsule.js",
    "scripts/survey_closeup.js",
    "scripts/survey_signals.js",
    "scripts/survey_overlay.js",
    "scripts/surveys.js",
    "scripts/start.js",
)
TEMPLATES = ("report.html.j2", "macros.html.j2", "sections/[!.]*.html.j2")


def read_tables(results: Path, template: Path, printed: Settings, confidence: float) -> Tables:
    """Read the tables that the page shows.

    Parameters
    ----------
    results : Path
        The folder of results.
    template : Path
        The folder of the template.
    printed : mapping
        The content of paper.yaml.
    confidence : float
        Confidence level of the intervals of the paper's rates.
    """
    evaluation = results / "evaluation"
    return Tables(
        index=read_table(results / "recordings.csv"),
        passed_over=read_table(results / "passed_over.csv"),
        detections=read_table(results / "detections.csv"),
        sites=read_table(results / "sites.csv"),
        templates=files.read_json(results / "templates.json")["templates"],
        evaluation=read_evaluation(evaluation, printed, confidence),
        judgements=read_judgements(evaluation),
        learning=read_learning(evaluation),
        benches=files.read_csv(template / "benches.csv"),
        references=(template / "references.bib").read_text(encoding="utf-8"),
    )


def read_figures(folder: Path) -> dict[str, dict[str, str]]:
    """Read each figure at the widths of a page and of a column, as addresses of images."""
    return {
        name: {
            width: image_address(with_dark_colours((folder / f"{name}{suffix}.svg").read_bytes()))
            for width, suffix in (("wide", ""), ("narrow", "_column"))
        }
        for name in FIGURES
    }


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
        files.read_json(folder / name / "survey.json") | {"pictures": _pictures(folder / name)}
        for name in names
    ]
    return survey_section.page_values(drawn, passed_over)


def _pictures(folder: Path) -> dict[str, str]:
    return {
        width: image_address(with_dark_colours((folder / f"picture{suffix}.svg").read_bytes()))
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
