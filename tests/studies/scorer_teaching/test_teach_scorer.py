"""The command for the training works without torch as far as it can."""

import os
import subprocess
import sys

import pytest

from support.project import ROOT

pytestmark = pytest.mark.takes(1)

STUDIES = ROOT / "workflow" / "studies"


def test_without_torch_it_tells_what_to_install(tmp_path):
    # Stands before an installed one.
    (tmp_path / "torch.py").write_text("raise ModuleNotFoundError('none', name='torch')\n")
    environment = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, STUDIES / "teach_scorer.py"]
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 1
    assert done.stderr.splitlines() == [
        "error: the training needs torch; "
        "run: pip install -r workflow/studies/scorer_teaching/requirements.txt"
    ]
    assert (STUDIES / "scorer_teaching/requirements.txt").exists()
