"""The workflow gives the same bytes on a Slurm cluster as on this computer."""

import importlib.util

import pytest
import yaml

from support import slurm
from support.project import ROOT, Project

RECORDINGS = ["0mm/r01", "1mm/r01", "1mm/r02"]

pytestmark = [
    pytest.mark.workflow,
    pytest.mark.waits,
    pytest.mark.skipif(bool(slurm.missing_reason()), reason=str(slurm.missing_reason())),
    pytest.mark.skipif(
        importlib.util.find_spec("snakemake_executor_plugin_slurm") is None,
        reason="snakemake-executor-plugin-slurm is not installed",
    ),
]

# Only this test's cluster has no accounting and answers at once.
WITHOUT_ACCOUNTING = [
    "--slurm-status-command=squeue",
    "--slurm-no-account",
    "--slurm-init-seconds-before-status-checks=1",
    "--seconds-between-status-checks=1",
    "--latency-wait=5",
]


def test_slurm_gives_the_same_results_in_few_jobs(tmp_path):
    local = Project.create(tmp_path / "local", RECORDINGS, particles=20, iterations=20)
    remote = local.copy(tmp_path / "remote")
    assert local.snakemake().status == 0

    with slurm.SingleNodeSlurm(tmp_path / "slurm") as cluster:
        run = remote.snakemake(
            "--profile=profiles/slurm",
            *WITHOUT_ACCOUNTING,
            environment=cluster.environment,
        )
    assert run.status == 0, run.output
    expected, actual = local.result_bytes(), remote.result_bytes()
    assert list(actual) == list(expected)
    same = [name for name in expected if not name.startswith("report")]
    assert [name for name in same if actual[name] != expected[name]] == []
    # A dozen jobs in a handful of Slurm jobs.
    assert 3 <= run.output.count("has been submitted with SLURM jobid") <= 5


def test_the_profile_groups_every_rule_but_those_of_recordings():
    profile = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text(encoding="utf-8"))
    rules = "".join(path.read_text() for path in (ROOT / "workflow/rules").glob("*.smk"))
    grouped = [entry.split("=")[0] for entry in profile["groups"]]
    # A job of a set takes a Slurm job of its own, and replaces the jobs of single recordings.
    assert profile["config"] == ["recordings_per_job=400"]
    alone = ["preprocess", "fit", "preprocess_set", "fit_set"]
    assert all(f"\nrule {name}:" in rules for name in [*grouped, *alone])
    assert rules.count("\nrule ") == len(grouped) + len(alone), "every rule belongs to a group"
