"""What `capsule forget` removes, and what it refuses."""

from pathlib import Path

import pytest

from capsule.commands import cli
from capsule.engine.jobs import hold_run_lock
from support.synthetic import write_archive

NAMES = ["0mm/r01", "3mm/r07", "3mm/r07b", "unlabelled/p1"]


def write(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Work in a folder with recordings and results."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CAPSULE_RUN", "")
    write_archive(tmp_path / "raw", NAMES, samples=30)
    made = [f"{kind}/{name}.npy" for kind in ("signals", "matrices") for name in NAMES]
    made += [*(f"fits/{name}.json" for name in NAMES), "recordings.csv", "report.html"]
    made += ["logs/fit/3mm/r07.log", "surveys/gut-7/survey.json", "surveys/gut-8/survey.json"]
    for name in made:
        write(tmp_path / "results" / name, f"made for {name}\n")
    for name in ("gut-7", "gut-8"):
        write(tmp_path / "sessions" / name / "stream.csv", f"1.0,2.0,3.0,4.0 of {name}\n")
    return tmp_path


def forget(*words):
    """Call the command; return its exit status."""
    with pytest.raises(SystemExit) as ended:
        cli.main(["forget", *words])
        raise SystemExit(0)
    return ended.value.code


def present(folder):
    return {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "run.lock"
    }


@pytest.mark.parametrize("deleted", [False, True], ids=["there", "deleted by hand"])
def test_what_is_its_own_goes_and_what_is_the_others_own_stays(folder, deleted, capsys):
    (folder / "raw/3mm/r07.csv.part").touch()
    others = {"raw/3mm/r07.2.csv", "results/fits/3mm/r07.2.json"}
    for name in others:
        write(folder / name, "made for 3mm/r07.2, 3mm/r07+2 and 3mm/r07b.")
    for name in ("r07", "r07b"):
        write(folder / f"logs/acquisition/3mm/{name}.log", "damaged, a wrong checksum\n")
    if deleted:
        (folder / "raw/3mm/r07.csv").unlink()
    assert forget("raw/3mm/r07.csv", "--yes") == 0
    left = present(folder)
    assert {name for name in left if "r07." in name} == others
    assert {f"raw/{name}.csv" for name in NAMES} - left == {"raw/3mm/r07.csv"}
    assert {"results/fits/3mm/r07b.json", "logs/acquisition/3mm/r07b.log"} <= left
    assert not {"results/recordings.csv", "results/report.html"} & left
    assert "results/surveys/gut-7/survey.json" in left
    told = capsys.readouterr().out
    assert "All results over the archive" in told and "snakemake -c2" in told


def test_what_is_refused_removes_nothing(folder, capsys):
    before = present(folder)

    def refused(*words):
        status, error = forget(*words), capsys.readouterr().err
        assert error.count("\n") == 1
        assert present(folder) == before
        return status, error

    status, told = refused("3mm/r70", "--yes")
    assert status == 1 and "nothing here names 3mm/r70; give a name such as 3mm/r07" in told
    status, told = refused("3mm/r07")
    assert status == 2 and "to remove all this, add --yes" in told
    for name in ("../r07", "/etc/passwd", "3mm/.."):
        status, told = refused(name, "--yes")
        assert status == 2 and "no name such as 3mm/r07" in told
    with hold_run_lock():
        status, told = refused("3mm/r07", "--yes")
    assert status == 1 and "another run uses this folder" in told


def test_at_a_terminal_it_asks(folder, monkeypatch):
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    for answer, status in (("", 2), ("n", 2), ("y", 0)):
        monkeypatch.setattr("builtins.input", lambda question, said=answer: said)
        assert forget("3mm/r07") == status
        assert (folder / "raw/3mm/r07.csv").exists() == bool(status)


def test_after_a_kill_the_same_command_goes_on(folder, monkeypatch):
    removed, truly = [], Path.unlink

    def unlink(path, missing_ok=False):
        if len(removed) == 5:
            raise KeyboardInterrupt
        removed.append(path)
        truly(path)

    with monkeypatch.context() as patched:
        patched.setattr("pathlib.Path.unlink", unlink)
        assert forget("3mm/r07", "--yes") == 130
    assert (folder / "raw/3mm/r07.csv").exists()
    assert forget("3mm/r07", "--yes") == 0
    assert not {name for name in present(folder) if "r07." in name}


def test_a_survey_goes_with_its_pictures_and_of_a_link_nothing_but_the_link(
    folder, tmp_path_factory, capsys
):
    elsewhere = tmp_path_factory.mktemp("elsewhere")

    def link(name):
        (folder / name).rename(elsewhere / Path(name).name)
        (folder / name).symlink_to(elsewhere / Path(name).name)

    names = ["raw/3mm/r07.csv", "sessions/gut-7"]
    for name in names:
        link(name)
    assert forget(*names, "--yes") == 0
    left = {"sessions/gut-8/stream.csv", "results/surveys/gut-8/survey.json"}
    assert {name for name in present(folder) if "gut-" in name} == left
    assert forget("sessions/gut-8", "--yes") == 0
    assert not (folder / "sessions/gut-8").exists()
    assert (elsewhere / "r07.csv").exists() and (elsewhere / "gut-7/stream.csv").exists()
    assert not any((folder / name).is_symlink() for name in names)
    capsys.readouterr()
    # A folder behind a link is not entered.
    for name in ("results", ".snakemake", "raw/0mm"):
        link(name)
    before = present(elsewhere)
    assert forget("0mm/r01", "--yes") == 1
    assert present(elsewhere) == before
    assert "raw/0mm/r01.csv stays: a link leads there" in capsys.readouterr().out
