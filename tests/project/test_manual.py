"""The manual builds without a warning, its links have targets, and it says what the code does."""

import re
import sys

import pytest
import yaml

from capsule.engine.configuration import allowed_values, read_schema
from capsule.engine.keys import imported_files
from capsule.evaluation.intervals import new_specificity, recordings_needed
from capsule.store.files import read_csv
from support.command import output_of
from support.documents import documents, text_of
from support.project import ROOT

SCHEMA = read_schema(ROOT / "workflow/schemas/config.schema.json")
STUDIES = sorted((ROOT / "workflow/studies").rglob("*.md"))
NAMES = [path.relative_to(ROOT).as_posix() for path in [*documents(), *STUDIES]]


@pytest.mark.slow
@pytest.mark.takes(40)
def test_the_manual_is_built_of_what_the_code_says_and_loads_nothing_from_elsewhere(tmp_path):
    """A link without a target is a warning of Sphinx, so an error."""
    pytest.importorskip("sphinx", reason="Sphinx is not installed")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", tmp_path / "trees"]
    output_of(*command, ROOT / "docs", tmp_path / "site")
    text = {path.stem: path.read_text("utf-8") for path in (tmp_path / "site").rglob("*.html")}
    loads = re.compile(r"<(?:link|script|img)\b[^>]*\b(?:href|src)=\"([^\"]+)\"")
    loaded = [target for page in text.values() for target in loads.findall(page)]
    assert len(loaded) > len(text)
    assert not [each for each in loaded if re.match(r"\w+:|//", each) and each[:5] != "data:"]
    assert "usage: capsule record" in text["configuration"]
    assert "--run-gap-s" in text["import"]
    assert 'id="capsule.judge"' in text["api"]
    assert 'id="capsule.method.sliding.SlidingComparison"' in text["api"]
    assert text["method"].count("<math") > 28
    # For readers of the source alone.
    assert "filled from the docstrings" not in text["api"]
    assert not any("<!-- filled" in page for page in text.values())


def test_every_package_of_the_library_is_shown_or_named_as_internal():
    page = text_of("docs/api.md")
    shown = set(re.findall(r"filled: modules of (\S+) ", page))
    named = set(re.findall(r"`(capsule\.\w+)`", page.partition("More packages serve")[2]))
    library = ROOT / "workflow/scripts/capsule"
    packages = {path.parent.relative_to(library.parent) for path in library.rglob("__init__.py")}
    assert not shown & named
    assert shown | named | {"capsule"} == {".".join(each.parts) for each in packages}


@pytest.mark.parametrize("name", NAMES)
def test_every_link_in_a_document_leads_to_a_file(name):
    for target in re.findall(r"\]\(([^)\s#]+)[^)\s]*\)", text_of(name)):
        assert re.match(r"\w+:", target) or ((ROOT / name).parent / target).exists(), target


def test_every_equation_has_the_label_and_the_number_of_the_paper():
    labels = yaml.safe_load(text_of("workflow/report/paper.yaml"))
    found = r"```math\n% (\S+)\n.*?\\tag\{(\d+)\}"
    shown = re.findall(found, text_of("docs/method.md"), re.DOTALL)
    assert shown == [(label, str(n)) for n, label in enumerate(labels["equations"], 1)]


def test_the_files_that_a_recording_passes_are_there_and_each_step_uses_them():
    page = text_of("docs/files.md").partition("### What a recording passes\n")[2]
    section = page.partition("\n### ")[0]
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", section, re.MULTILINE))
    assert list(rows) == ["preprocess", "list", "describe", "evaluate", "report"]
    workflow = ROOT / "workflow"
    for step, cell in rows.items():
        used = imported_files(workflow / f"scripts/{step}.py", ["capsule.detectors.shipped"])
        for part in cell.split(";"):
            # A folder stands before the files in it.
            folder, *names = re.findall("`([^`]+)`", part if "/`:" in part else f"`./` {part}")
            for path in (workflow / folder / name for name in names):
                assert path.exists()
                assert path in used or "scripts/capsule" not in path.as_posix(), (step, path)


def rows_of(schema, path=""):
    """Yield the row of every key that holds a value."""
    for name, part in schema["properties"].items():
        if "properties" in part:
            yield from rows_of(part, f"{path}{name}.")
        else:
            cells = [f"`{path}{name}`", part.get("symbol", ""), part.get("unit", "")]
            cells += [allowed_values(part, SCHEMA), part["description"]]
            yield f"| {' | '.join(cells)} |"


def test_every_key_is_explained_as_the_schema_has_it_and_no_other():
    lines = text_of("config/README.md").splitlines()
    assert [line for line in lines if line.startswith("| `")] == [*rows_of(SCHEMA)]


def test_pages_give_the_range_that_the_benchmark_measured_and_the_numbers_that_are_computed():
    lines, benches = [], read_csv(ROOT / "workflow/report/benches.csv")
    for *words, specificity, small, large in map(dict.values, benches):
        rates = [f"{100 * float(rate):.1f} %" for rate in (specificity, small, large)]
        lines.append(f"| {' | '.join([*words, *rates])} |\n")
    for page in ("docs/detection.md", "workflow/studies/results/detection-benches.md"):
        assert f"---|\n{''.join(lines)}\n" in text_of(page)
    needed = {
        rate: [recordings_needed(rate / 100, each, 0.95) for each in (0.15, 0.1, 0.05)]
        for rate in (50, 60, 70, 80, 85, 90, 95, 100)
    }
    head = "| expected rate | ±15 points | ±10 points | ±5 points |\n|---|---|---|---|\n"
    rows = [f"| {rate} % | {' | '.join(map(str, of))} |\n" for rate, of in needed.items()]
    assert f"{head}{''.join(rows)}\n" in text_of("docs/your-bench.md")
    intervals = " ".join(text_of("docs/intervals.md").split())
    low, high = (f"{100 * share:.1f}" for share in new_specificity(20, 0.95))
    assert f"At n = 20 the central 90 % are {low} to {high} %." in intervals
    assert f"95 % to +-5 points takes {needed[95][2]} healthy recordings" in intervals
