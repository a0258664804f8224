"""A mistake in the configuration gives one plain message, and no job runs."""

import pytest

from support.project import Project

pytestmark = pytest.mark.workflow


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    folder = tmp_path_factory.mktemp("new") / "project"
    return Project.create(folder, ["3mm/r01"], samples=200)


@pytest.mark.parametrize(
    ("main", "mine", "arguments", "told"),
    [
        (
            None,
            "fit: {particles: many}\n",
            ["--configfile", "mine.yaml"],
            "--config or --configfile: fit.particles: 'many' is not allowed; must be a whole",
        ),
        (
            None,
            "fit: {seed: 3}\n",
            ["--configfile", "mine.yaml", "--config", "on_rejected=stop"],
            "--configfile: on_rejected: 'stop' is not allowed; must be one of report, fail",
        ),
        (None, None, ["--config", "fit={sed: 3}"], ": fit.sed: there is no such key; did you mean"),
        (
            "fit: {seed: 3}\nfit: {particles: 5}\n",
            None,
            [],
            "config/config.yaml, line 2: the key 'fit' appears twice",
        ),
        ("", None, [], "config/config.yaml: this file is empty"),
        ("- 1\n", None, [], "config/config.yaml: this file holds a list instead of keys"),
        ("fit: [\n", None, [], "config/config.yaml, line 2: "),
    ],
)
def test_a_mistake_is_told_with_its_file(new, tmp_path, main, mine, arguments, told):
    project = new.copy(tmp_path / "project")
    if main is not None:
        (project.folder / "config/config.yaml").write_text(main, encoding="utf-8")
    if mine is not None:
        (project.folder / "mine.yaml").write_text(mine, encoding="utf-8")
    run = project.snakemake(*arguments)
    assert run.status != 0
    assert told in run.output
    assert "Traceback" not in run.output
    assert not project.results.exists()


def test_a_file_need_only_hold_the_keys_that_differ(new, tmp_path):
    project = new.copy(tmp_path / "project")
    (project.folder / "mine.yaml").write_text("fit: {particles: 7, iterations: 3}\n")
    arguments = ["results/fits/3mm/r01.json", "--configfile", "mine.yaml", "--printshellcmds"]
    run = project.snakemake(*arguments)
    assert run.status == 0, run.output
    assert '"first_peak": 150' in run.output
    assert '"iterations": 3, "particles": 7' in run.output
