"""capsule report and capsule demo: the call of the workflow in a folder."""

from unittest.mock import MagicMock

import pytest

from capsule.commands import report
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError


def test_ctrl_c_waits_for_snakemake_to_end_its_jobs(monkeypatch):
    # It ends at the third question.
    called = MagicMock()
    wait = called.return_value.__enter__.return_value.wait
    wait.side_effect = [KeyboardInterrupt, KeyboardInterrupt, 1]
    monkeypatch.setattr(report.subprocess, "Popen", called)
    assert report.call_workflow(PROJECT, []) == report.INTERRUPTED
    assert wait.call_count == 3


def test_what_is_missing_is_named_with_its_remedy(tmp_path, monkeypatch):
    def told(remedy):
        return pytest.raises(CapsuleError, match=remedy)

    with told("holds no raw; run the command in a folder"):
        report.check_workflow(tmp_path)
    (tmp_path / "raw").mkdir()
    with told(r"holds no config/config\.yaml; .*capsule new NAME"):
        report.check_workflow(tmp_path)
    monkeypatch.setattr(report, "PROJECT", tmp_path)
    with told("holds no Snakefile"):
        report.check_workflow(tmp_path)
    monkeypatch.setattr(report.importlib.util, "find_spec", lambda name: None)
    with told(r'pip install -e "\.\[workflow\]"'):
        report.check_workflow(tmp_path)
