"""The command for the training works without torch as far as it can."""

import os
import subprocess
import sys

import pytest

from support.project import ROOT

pytestmark = pytest.mark.takes(1)

FRONT = ROOT / "workflow" / "studies" / "teach_scorer.py"


def test_without_torch_it_tells_what_to_install(tmp_path):
    # Stands before an installed one.
    (tmp_path / "torch.py").write_text("raise ModuleNotFoundError('none', name='torch')\n")
    done = subprocess.run(
        [sys.executable, FRONT],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(tmp_path)},
    )
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "error: the training needs torch; "
        "run: pip install -r workflow/studies/scorer_teaching/requirements.txt"
    ]
    assert (ROOT / "workflow" / "studies" / "scorer_teaching" / "requirements.txt").exists()
