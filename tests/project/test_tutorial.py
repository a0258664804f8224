"""The tutorial runs, and gives the output that it shows."""

import os

import nbformat
import pytest
from nbclient import NotebookClient

from support.project import ROOT

pytestmark = pytest.mark.slow

PATH = ROOT / "docs" / "tutorial.ipynb"


def texts(notebook):
    """Return the text of each cell's output; for a picture, only that there is one."""
    return [
        [
            output["text"] if "text" in output else output["data"]["text/plain"]
            for output in cell["outputs"]
        ]
        for cell in notebook.cells
        if cell["cell_type"] == "code"
    ]


@pytest.mark.takes
@pytest.mark.filterwarnings("ignore:Kernel is running over TCP")
def test_the_tutorial_gives_what_it_shows(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.fspath(ROOT / "workflow" / "scripts"))
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    stored = nbformat.read(PATH, as_version=4)
    fresh = nbformat.read(PATH, as_version=4)
    NotebookClient(fresh, timeout=300, resources={"metadata": {"path": PATH.parent}}).execute()
    assert texts(fresh) == texts(stored)
    pictures = [
        output
        for cell in fresh.cells
        if cell["cell_type"] == "code"
        for output in cell["outputs"]
        if "image/png" in output.get("data", {})
    ]
    assert len(pictures) >= 5
