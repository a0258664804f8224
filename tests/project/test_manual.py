"""The manual builds without a warning, and its links have targets."""

import re
import sys

import pytest
import yaml

from capsule.engine.keys import imported_files
from support.command import output_of
from support.documents import documents
from support.project import ROOT

DOCS = ROOT / "docs"
NAMES = [path.relative_to(ROOT).as_posix() for path in documents()]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the manual, and return its folder; a link without a target is a warning, so an error.

    Sphinx warns of pages, of headings and of files that are not there.
    """
    pytest.importorskip("sphinx", reason="Sphinx is not installed")
    folder = tmp_path_factory.mktemp("manual")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", folder / "trees"]
    output_of(*command, DOCS, folder / "site")
    return folder / "site"


@pytest.mark.slow
@pytest.mark.takes(40)
def test_no_page_loads_anything_from_elsewhere(site):
    loads = re.compile(r"<(?:link|script|img)\b[^>]*\b(?:href|src)=\"([^\"]+)\"")
    pages = [path.read_text(encoding="utf-8") for path in site.rglob("*.html")]
    loaded = [target for page in pages for target in loads.findall(page)]
    assert len(loaded) > len(pages)
    assert not [each for each in loaded if re.match(r"\w+:|//", each) and each[:5] != "data:"]


@pytest.mark.slow
@pytest.mark.takes
def test_the_pages_hold_what_is_taken_from_the_code(site):
    def text(page):
        return (site / page).read_text(encoding="utf-8")

    assert "usage: capsule record" in text("configuration.html")
    assert "--run-gap-s" in text("import.html")
    assert "preprocessing.window" in text("configuration.html")
    assert 'id="capsule.judge"' in text("api.html")
    assert 'id="capsule.method.sliding.SlidingComparison"' in text("api.html")
    assert text("method.html").count("<math") > 28
    # For readers of the source alone.
    assert "filled from the docstrings" not in text("api.html")
    assert not any(
        "<!-- filled" in path.read_text(encoding="utf-8") for path in site.rglob("*.html")
    )


def test_every_package_of_the_library_is_shown_or_named_as_internal():
    page = (DOCS / "api.md").read_text(encoding="utf-8")
    shown = set(re.findall(r"filled: modules of (\S+) ", page))
    named = set(re.findall(r"`(capsule\.\w+)`", page.partition("More packages serve")[2]))
    library = ROOT / "workflow/scripts/capsule"
    packages = {path.parent.relative_to(library.parent) for path in library.rglob("__init__.py")}
    assert not shown & named
    assert shown | named | {"capsule"} == {".".join(each.parts) for each in packages}


@pytest.mark.parametrize("name", NAMES)
def test_every_link_in_a_document_leads_to_a_file(name):
    document = ROOT / name
    for target in re.findall(r"\]\(([^)\s#]+)[^)\s]*\)", document.read_text(encoding="utf-8")):
        if not re.match(r"\w+:", target):
            assert (document.parent / target).exists(), target


def test_every_equation_has_the_label_and_the_number_of_the_paper():
    text = (DOCS / "method.md").read_text(encoding="utf-8")
    labels = yaml.safe_load((ROOT / "workflow/report/paper.yaml").read_text(encoding="utf-8"))
    shown = re.findall(r"```math\n% (\S+)\n.*?\\tag\{(\d+)\}", text, re.DOTALL)
    assert shown == [(label, str(n)) for n, label in enumerate(labels["equations"], 1)]


def test_the_files_that_a_recording_passes_are_there_and_each_step_uses_them():
    page = (DOCS / "files.md").read_text(encoding="utf-8")
    section = page.partition("### What a recording passes\n")[2].partition("\n### ")[0]
    rows = re.findall(r"^\| `(\w+)` \| (.*) \|$", section, re.MULTILINE)
    assert [step for step, _ in rows] == ["preprocess", "list", "describe", "evaluate", "report"]
    for step, cell in rows:
        used = imported_files(
            ROOT / "workflow" / f"scripts/{step}.py", ["capsule.detectors.taught"]
        )
        folder = ""
        # A folder stands before the files in it, up to a semicolon.
        for name, rest in re.findall(r"`([^`]+)`([^`]*)", cell):
            path = ROOT / "workflow" / folder / name
            assert path.exists(), name
            if path.parts[-2:][0] != "scripts" and path.suffix == ".py":
                assert path in used, (step, name)
            folder = name if name.endswith("/") else "" if ";" in rest else folder
