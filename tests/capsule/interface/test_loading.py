"""An archive in memory: what is accepted, what is not, and what is refused."""

import re
import shutil
import subprocess
import sys

import numpy as np
import pytest

import capsule
from support.project import ROOT

pytestmark = pytest.mark.takes(0.2)

SCRIPTS = ROOT / "workflow" / "scripts"


@pytest.fixture
def spoilt(raw, tmp_path):
    """Spoil one recording, copy one, nearly copy one, and leave a note."""
    folder = shutil.copytree(raw, tmp_path / "raw")
    (folder / "3mm/r02.csv").write_text("no recording\n")
    shutil.copy(folder / "3mm/r03.csv", folder / "3mm/r03-copy.csv")
    lines = (folder / "0mm/r03.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (folder / "0mm/r05.csv").write_text("".join(lines[:-20]))
    (folder / "notes.txt").write_text("a note")
    return folder


def test_a_rejected_recording_is_listed_with_its_reason_and_nowhere_else(spoilt):
    archive = capsule.load(spoilt)
    rejected = archive.recordings[archive.recordings["status"] == "rejected"]
    assert rejected["reason"].to_dict() == {
        "3mm/r02": "line 1: the column 'time_s' is missing; found: 'no recording', "
        "required: time_s,sensor_1,sensor_2,sensor_3,sensor_4",
        "3mm/r03-copy": "the same content as 3mm/r03",
    }
    held = [archive.readings, archive.matrices, archive.headers, archive.labelled]
    assert not {"3mm/r02", "3mm/r03-copy"} & set().union(*held)
    assert len(archive) == 13
    assert repr(archive) == (
        "<LoadedArchive: 13 recordings accepted (0mm, 1.5mm, 3mm, unlabelled), 2 rejected>"
    )
    assert archive.passed_over["path"].tolist() == ["notes.txt"]
    assert archive.unlabelled == ["unlabelled/patient"]


def test_recordings_that_are_nearly_the_same_leave_together(spoilt):
    archive = capsule.load(spoilt)
    assert archive.recordings["near_copies"].dropna().to_dict() == {
        "0mm/r03": "0mm/r05",
        "0mm/r05": "0mm/r03",
    }
    pair = {archive.labelled.index(name) for name in ("0mm/r03", "0mm/r05")}
    together = [set(judged) for _, judged in capsule.folds(archive).split() if pair & set(judged)]
    assert together == [pair]
    alone = archive.select(["0mm/r03", "3mm/r01"])
    assert alone.recordings["near_copies"].isna().all()


def test_where_no_rejected_one_is_allowed_loading_stops(spoilt):
    with pytest.raises(capsule.CapsuleError, match=r"on_rejected is fail(.|\n)*3mm/r02: line 1"):
        capsule.load(spoilt, on_rejected="fail")


def test_the_paper_s_steps_work_on_what_is_loaded(archive):
    name = "3mm/r01"
    matrix = capsule.preprocess(archive.readings[name], **archive.preprocess_options)
    np.testing.assert_array_equal(matrix, archive.matrices[name])
    fit = capsule.fit_particle(matrix, archive.generator(name), **archive.fit_options)
    assert (fit.rmse, fit.lag) == (archive.fit(name).rmse, archive.fit(name).lag)
    templates = capsule.build_templates(archive.particles(), **archive.template_options)
    for ours, theirs in zip(templates.matrices, archive.templates.matrices, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    samples = archive.readings[name].shape[1]
    np.testing.assert_allclose(archive.time_s(name), 0.1 * np.arange(samples))


def test_rows_for_estimators_hold_the_readings(archive):
    np.testing.assert_array_equal(archive.X, archive.rows(archive.labelled))
    for name, values in archive.readings.items():
        (row,) = archive.rows([name])
        padded = np.pad(values, ((0, 0), (0, 1000 - values.shape[1])), constant_values=np.nan)
        np.testing.assert_array_equal(row.reshape(1000, 4).T, padded)
    assert archive.y.tolist() == [0.0] * 4 + [1.5] * 4 + [3.0] * 4


def test_the_settings_beside_the_folder_count(raw, tmp_path):
    folder = shutil.copytree(raw, tmp_path / "raw")
    text = (ROOT / "config/config.yaml").read_text(encoding="utf-8")
    (tmp_path / "config").mkdir()
    path = tmp_path / "config/config.yaml"
    path.write_text(text.replace("window: 84 ", "window: 80 "))
    assert capsule.load(folder).settings["preprocessing"]["window"] == 80
    named = capsule.load(folder, config=ROOT / "config/config.yaml")
    assert named.settings["preprocessing"]["window"] == 84


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"fits": {"seed": 2}}, "fits: there is no such key; did you mean fit?"),
        ({"fit": {"seeds": 2}}, "changes: fit.seeds: there is no such key; did you mean seed?"),
        ({"fit": 3}, "changes: fit: 3 is not allowed"),
    ],
)
def test_a_wrong_setting_is_refused_as_in_the_file(raw, changes, told):
    with pytest.raises(capsule.CapsuleError) as refused:
        capsule.load(raw, **changes)
    assert told in str(refused.value)


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        (lambda archive: archive.fit("9mm/r01"), "9mm/r01: this archive has no such accepted"),
        (lambda archive: archive.select(["9mm/r01"]), "9mm/r01: this archive has no such"),
    ],
)
def test_a_name_that_is_not_there_is_refused(archive, ask, told):
    with pytest.raises(capsule.CapsuleError, match=told):
        ask(archive)


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(capsule.CapsuleError, match="does not exist; create it"):
        capsule.load(tmp_path / "nowhere")


def python(program):
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(SCRIPTS)!r})\n{program}"]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_importing_the_library_imports_nothing_else():
    program = "before = set(sys.modules); import capsule; print(*set(sys.modules) - before)"
    assert python(program).split() == ["capsule"]


def test_every_public_name_is_there_and_others_are_not():
    program = (
        "import capsule\nfor name in dir(capsule): assert getattr(capsule, name) is not None\n"
    )
    program += "from capsule import *\nprint(load.__module__, hasattr(capsule, 'loaded'))"
    assert python(program).split() == ["capsule.interface.library", "False"]


def test_every_public_name_says_what_it_is():
    for name in capsule.__all__:
        assert getattr(capsule, name).__doc__, name


def test_what_the_page_on_the_library_names_is_there(archive):
    page = (ROOT / "docs/library.md").read_text(encoding="utf-8")
    for owner, named in ((archive, r"`archive\.(\w+)"), (capsule, r"\bcapsule\.(\w+)")):
        names = set(re.findall(named, page))
        assert len(names) > 8
        assert all(hasattr(owner, name) for name in names)


def test_without_scikit_learn_the_estimators_name_the_extra_and_the_rest_works():
    program = "sys.modules['sklearn'] = None\nimport capsule\n"
    program += "try:\n    capsule.DiagonalEstimator\nexcept capsule.CapsuleError as error:\n"
    program += "    print(error)\nassert capsule.judge and capsule.folds and capsule.load"
    said = 'the estimators need scikit-learn: pip install "origami-capsule[learn]"\n'
    assert python(program) == said
