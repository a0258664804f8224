"""What `capsule forget` removes, and what it refuses."""

from functools import partial
from pathlib import Path

import pytest

from capsule.engine.jobs import hold_run_lock
from capsule.errors import CapsuleError
from support.command import run_command

NAMES = ["0mm/r01", "3mm/r07", "3mm/r07b", "unlabelled/p1"]
RUN = Path("raw/3mm/r07.csv")
MADE = [f"results/{kind}/{name}.npy" for kind in ("signals", "matrices", "fits") for name in NAMES]
MADE += ["results/recordings.csv", "results/report.html", "results/logs/fit/3mm/r07.log"]
OF_A_SURVEY = ["sessions/gut-{}/s.csv", "results/surveys/gut-{}/survey.json"]
SURVEYS = [path.format(number) for number in (7, 8) for path in OF_A_SURVEY]
forget = partial(run_command, "forget")


def write(*names, text="made for {}\n"):
    for path in map(Path, names):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.format(path))


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """Work in a folder with recordings and results."""
    monkeypatch.chdir(tmp_path)
    write(*(f"raw/{name}.csv" for name in NAMES), *MADE, *SURVEYS)


def present(folder="."):
    """Return the files below a folder, but for the lock of a run."""
    paths = (path for path in Path(folder).rglob("*") if path.is_file())
    return {path.as_posix() for path in paths if path.name != "run.lock"}


@pytest.mark.parametrize("deleted", [False, True], ids=["there", "deleted by hand"])
def test_what_is_its_own_goes_and_what_is_the_others_own_stays(deleted, capsys):
    others = {"raw/3mm/r07.2.csv", "results/fits/3mm/r07.2.json"}
    write(*others, text="made for 3mm/r07.2, 3mm/r07+2 and 3mm/r07b.")
    write("raw/3mm/r07.csv.part", "logs/acquisition/3mm/r07.log", "logs/acquisition/3mm/r07b.log")
    before = present()
    if deleted:
        RUN.unlink()
    assert forget("raw/3mm/r07.csv", "--yes") == 0
    own = {name for name in before if "3mm/r07." in name} - others
    assert len(own) == 7
    assert before - present() == own | {"results/recordings.csv", "results/report.html"}
    assert "snakemake -c2" in capsys.readouterr().out


def test_what_is_refused_removes_nothing(monkeypatch):
    before = present()

    def refused(status, told, *words):
        with pytest.raises(CapsuleError, match=told) as caught:
            forget(*words)
        assert (caught.value.status, present()) == (status, before)

    refused(1, "nothing here names 3mm/r70; .* such as 3mm/r07", "3mm/r70", "--yes")
    refused(2, "to remove all this, add --yes", "3mm/r07")
    for name in ("../r07", "/etc/passwd", "3mm/.."):
        refused(2, "no name such as 3mm/r07", name, "--yes")
    with hold_run_lock():
        refused(1, "another run uses this folder", "3mm/r07", "--yes")
    assert (forget("3mm/r07", "--dry-run"), present()) == (0, before)
    # At a terminal it asks.
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    monkeypatch.setattr("builtins.input", lambda question: answers.pop())
    answers = ["y", "n", ""]
    for _ in range(2):
        refused(2, "nothing was removed", "3mm/r07")
    assert (forget("3mm/r07"), RUN.exists()) == (0, False)


def test_after_a_kill_the_same_command_goes_on(monkeypatch):
    truly, outcomes = Path.unlink, iter([None] * 5)

    def unlink(path, missing_ok=False):
        next(outcomes)
        truly(path)

    with monkeypatch.context() as patched, pytest.raises(StopIteration):
        patched.setattr("pathlib.Path.unlink", unlink)
        forget("3mm/r07", "--yes")
    assert RUN.exists()
    assert forget("3mm/r07", "--yes") == 0
    assert not {name for name in present() if "r07." in name}


def test_a_survey_goes_whole_and_of_a_link_nothing_but_the_link(tmp_path_factory, capsys):
    elsewhere = tmp_path_factory.mktemp("elsewhere")

    def link(*names):
        for path in map(Path, names):
            path.rename(elsewhere / path.name)
            path.symlink_to(elsewhere / path.name)

    link(RUN, "sessions/gut-7")
    assert forget(RUN, "sessions/gut-7", "--yes") == 0
    assert {name for name in present() if "gut-" in name} == {*SURVEYS[2:]}
    assert forget("sessions/gut-8", "--yes") == 0
    assert not Path("sessions/gut-8").exists()
    assert (elsewhere / "r07.csv").exists() and (elsewhere / "gut-7/s.csv").exists()
    assert not RUN.is_symlink() and not Path("sessions/gut-7").is_symlink()
    # A folder behind a link is not entered.
    link("results", ".snakemake", "raw/0mm")
    before = present(elsewhere)
    assert forget("0mm/r01", "--yes") == 1
    assert present(elsewhere) == before
    assert "raw/0mm/r01.csv stays: a link leads there" in capsys.readouterr().out
