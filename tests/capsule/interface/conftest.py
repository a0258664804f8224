"""A small archive for all tests here: shipped recordings, with one size under another name."""

import pytest

import capsule
from support.project import ROOT

# The size 0.5 mm has copies of the recordings of 2 mm.
ORIGINALS = {"0mm": "0mm", "0.5mm": "2mm", "3mm": "3mm"}
# These were made at one site.
TOGETHER = {"0mm/r01": "first", "0mm/r02": "first", "3mm/r01": "second", "3mm/r04": "second"}


@pytest.fixture(scope="session")
def raw(tmp_path_factory):
    folder = tmp_path_factory.mktemp("archive") / "raw"
    pairs = {f"{size}/r0{n}": f"{each}/r0{n}" for size, each in ORIGINALS.items() for n in "1234"}
    for name, original in (pairs | {"unlabelled/patient": "4mm/r01"}).items():
        text = (ROOT / "raw" / f"{original}.csv").read_text(encoding="utf-8")
        path = folder / f"{name}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        site = f"# site: {TOGETHER.get(name, name)}"
        path.write_text(text.replace(f"# site: simulated-1/{original}", site))
    return folder


@pytest.fixture(scope="session")
def archive(raw):
    return capsule.load(raw, fit={"particles": 20, "iterations": 20})
