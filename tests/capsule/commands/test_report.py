"""capsule report and capsule demo: the call of the workflow in a folder."""

import contextlib

import pytest

from capsule.commands import report
from capsule.engine.project import PROJECT
from capsule.errors import CapsuleError


def test_ctrl_c_waits_for_snakemake_to_end_its_jobs(tmp_path, monkeypatch):
    class Snakemake(contextlib.nullcontext):
        waited = 0

        def __init__(self, command, cwd):
            super().__init__(self)

        def wait(self):
            """End at the third question."""
            Snakemake.waited += 1
            if Snakemake.waited < 3:
                raise KeyboardInterrupt
            return 1

    monkeypatch.setattr(report.subprocess, "Popen", Snakemake)
    assert report.call_workflow(PROJECT, []) == report.INTERRUPTED
    assert Snakemake.waited == 3


@pytest.mark.parametrize(
    ("there", "said"),
    [
        ([], r"holds no raw; run the command in a folder"),
        (["raw"], r"holds no config/config.yaml; .*capsule new NAME"),
    ],
)
def test_what_is_missing_is_named_with_its_remedy(tmp_path, there, said):
    for name in there:
        (tmp_path / name).mkdir()
    with pytest.raises(CapsuleError, match=said):
        report.check_workflow(tmp_path)


def test_a_project_without_snakemake_or_its_snakefile_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(report, "PROJECT", tmp_path)
    with pytest.raises(CapsuleError, match=r"holds no Snakefile"):
        report.check_workflow(tmp_path)
    monkeypatch.setattr(report.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(CapsuleError, match=r'pip install -e "\.\[workflow\]"'):
        report.check_workflow(tmp_path)
