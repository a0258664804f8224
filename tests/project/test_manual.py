"""The manual builds without a warning, and its links have targets."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
import yaml

from support.documents import documents
from support.project import ROOT

DOCS = ROOT / "docs"
NAMES = [path.relative_to(ROOT).as_posix() for path in documents()]
_LINK = re.compile(r"\]\(([^)\s]+)\)")
_TARGETS = {"a": "href", "img": "src", "link": "href", "script": "src"}


class Page(HTMLParser):
    """A parser that collects a page's links, the files that it loads, and its anchors."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.targets: list[tuple[str, str]] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attrs):
        """Record the links and anchors of a tag."""
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        if target := given.get(_TARGETS.get(tag, "")):
            self.targets.append((tag, target))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the manual with warnings as errors, and return its folder."""
    pytest.importorskip("sphinx", reason="Sphinx is not installed")
    folder = tmp_path_factory.mktemp("manual")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", folder / "trees"]
    built = subprocess.run(
        [*command, DOCS, folder / "site"], capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    return folder / "site"


@pytest.fixture(scope="module")
def pages(site):
    return {path: Page(path) for path in site.rglob("*.html")}


@pytest.mark.slow
@pytest.mark.takes(40)
def test_every_link_in_the_site_leads_to_a_file_and_to_an_anchor_in_it(pages):
    checked = 0
    for path, page in pages.items():
        for _, target in page.targets:
            parts = urlsplit(target)
            if parts.scheme:
                continue
            aim = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            assert aim.exists(), f"{path.name}: {target}"
            if parts.fragment and aim in pages:
                assert unquote(parts.fragment) in pages[aim].anchors, f"{path.name}: {target}"
            checked += 1
    assert checked > 1000


@pytest.mark.slow
@pytest.mark.takes
def test_no_page_loads_anything_from_elsewhere(pages):
    loaded = [target for page in pages.values() for tag, target in page.targets if tag != "a"]
    assert len(loaded) > len(pages)
    assert not [target for target in loaded if urlsplit(target).scheme not in ("", "data")]


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
    for target in _LINK.findall(document.read_text(encoding="utf-8")):
        parts = urlsplit(target)
        if not parts.scheme and parts.path:
            assert (document.parent / parts.path).exists(), target


def test_every_equation_has_the_label_and_the_number_of_the_paper():
    text = (DOCS / "method.md").read_text(encoding="utf-8")
    labels = yaml.safe_load((ROOT / "workflow/report/paper.yaml").read_text(encoding="utf-8"))
    shown = re.findall(r"```math\n% (\S+)\n.*?\\tag\{(\d+)\}", text, re.DOTALL)
    assert shown == [(label, str(n)) for n, label in enumerate(labels["equations"], 1)]
