"""Read the parts of the report: results, figures, the template and the versions of packages."""

import hashlib
import importlib.metadata
import platform
from collections.abc import Iterable, Mapping
from pathlib import Path
from urllib.parse import quote

from capsule.detectors.registry import DETECTORS, with_detectors
from capsule.engine.keys import files_of_code
from capsule.engine.project import PROJECT, SCHEMAS
from capsule.evaluation.files import read_evaluation, read_printed, read_table
from capsule.figures.registry import FIGURES
from capsule.kinds import Cells, Settings
from capsule.page import surveys
from capsule.page.tables import Tables
from capsule.recordings.held_out import teaching
from capsule.recordings.names import size_mm
from capsule.store import files
from capsule.store.results import PLOT_DATA, SURVEY_VALUES, OfArchive, Results

PACKAGES = ("snakemake", "numpy", "scipy", "pandas", "matplotlib", "jinja2")
UPLOT = "vendor/uplot/uPlot.iife.min.js"
STYLES = ("vendor/uplot/uPlot.min.css", "report.css")
# One script of all files: each takes what it needs from the others. The first makes it strict.
SCRIPTS = (
    "scripts/elements.js",
    UPLOT,
    *(f"scripts/{name}.js" for name in ("theme", "charts", "evidence_list", "saving", "viewer")),
    *(f"scripts/{name}.js" for name in ("shown", "recordings_table", "surveys", "start")),
)
TEMPLATES = ("report.html.j2", "macros.html.j2", "sketches.html.j2", "sections/[!.]*.html.j2")


def read_tables(folder: Path, template: Path, settings: Settings) -> Tables:
    """Read the results that the page shows, and what stands in the folder of the template."""
    table, confidence = folder / OfArchive.RECORDINGS, settings["evaluation"]["confidence"]
    averaged = files.read_or_explain(folder / OfArchive.TEMPLATE_PARAMETERS, files.read_json)
    printed = read_printed(template / "paper.yaml")
    results, accepted = Results.of_table(folder, table), files.accepted_recordings(table)
    fitted = teaching(accepted, settings["evaluation"]["held_out"])
    return Tables(
        evaluation=read_evaluation(folder, printed, confidence),
        index=read_table(table),
        settings=settings,
        passed_over=read_table(folder / OfArchive.PASSED_OVER),
        detections=read_table(folder / OfArchive.DETECTIONS),
        sites=read_table(folder / OfArchive.SITES),
        templates=averaged["templates"],
        learning=read_table(folder / OfArchive.LEARNING),
        benches=files.read_csv(template / "benches.csv"),
        references=(template / "references.bib").read_text(encoding="utf-8"),
        printed=printed,
        schema=with_detectors(files.read_json(SCHEMAS / "config.schema.json")),
        described=results.described(PLOT_DATA, accepted, files.read_json),
        fits=results.fits(name for name in fitted if size_mm(name)),
        matrix=results.matrix,
    )


def read_figure(folder: Path, name: str) -> str:
    """Read a figure, such as ``roc``, as the address of an image."""
    content = (folder / f"{name}.svg").read_text(encoding="utf-8")
    return f"data:image/svg+xml,{quote(content, safe=' /:;=,()')}"


def read_surveys(folder: Path, names: Iterable[str], passed_over: Mapping[str, str]) -> Cells:
    """Read the values that the page shows for each survey, with its picture.

    `passed_over` are the folders that hold no finished survey, each with the reason.
    """
    drawn = [
        files.read_or_explain(folder / name / SURVEY_VALUES, files.read_json)
        | {"picture": read_figure(folder / name, "picture")}
        for name in names
    ]
    return surveys.page_values(drawn, passed_over)


def read_frame(folder: Path) -> tuple[dict[str, str], str, str]:
    """Read the templates by name, the style and the script from the folder of the template."""
    templates = {
        path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
        for pattern in TEMPLATES
        for path in sorted(folder.glob(pattern))
    }
    style, script = (
        "\n".join((folder / name).read_text(encoding="utf-8") for name in names)
        for names in (STYLES, SCRIPTS)
    )
    return templates, style, script


def code_checksums() -> dict[str, str]:
    """Return the SHA-256 of each file of the rules' code, by its path in the project.

    An installed library stands beside the project's files.
    """
    registered = [*FIGURES.values(), *(row.module for row in DETECTORS.values())]
    scripts = (PROJECT / "workflow" / "scripts").glob("*.py")
    paths = {each for script in scripts for each in files_of_code(script, registered)}
    found = {}
    for path in paths:
        folder = PROJECT if path.is_relative_to(PROJECT) else PROJECT.parent
        checksum = hashlib.sha256(path.read_bytes()).hexdigest()
        found[path.relative_to(folder).as_posix()] = checksum
    return found


def read_versions(template: Path) -> list[tuple[str, str]]:
    """Read the versions of Python, of the packages that computed the results, and of uPlot.

    The first line of uPlot's file names its version.
    """
    packages = [(name, importlib.metadata.version(name)) for name in PACKAGES]
    first_line = (template / UPLOT).read_text(encoding="utf-8").partition("\n")[0]
    chart = first_line.partition("(v")[2].partition(")")[0]
    return [("Python", platform.python_version()), *packages, ("uPlot", chart)]
