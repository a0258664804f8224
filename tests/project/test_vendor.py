"""The files from other projects have the pinned content, each with its licence."""

import json
import re

import pytest

from support.project import ROOT


@pytest.mark.parametrize(
    ("package", "file"),
    [
        ("uplot", "workflow/report/vendor/uplot/uPlot.iife.min.js"),
        ("axe-core", "tests/vendor/axe-core/axe.min.js"),
    ],
)
def test_the_files_from_elsewhere_are_what_the_lock_pins(package, file):
    folder = ROOT / "workflow" / "report" / "vendor"
    lock = json.loads((folder / "package-lock.json").read_text(encoding="utf-8"))
    head = (ROOT / file).read_text(encoding="utf-8")[:200]
    assert re.search(r"v\d+\.\d+\.\d+", head)[0] == (
        "v" + lock["packages"][f"node_modules/{package}"]["version"]
    )
    assert (ROOT / file).with_name("LICENSE").stat().st_size > 500
    assert '"resolved"' not in json.dumps(lock)
