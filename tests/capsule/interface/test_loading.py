"""An archive in memory: what is accepted, what is not, and what is refused."""

import re
import shutil
import sys
from operator import attrgetter

import numpy as np
import pytest

import capsule
from support.command import output_of
from support.project import ROOT

pytestmark = pytest.mark.takes(0.2)


def test_a_rejected_recording_is_listed_with_its_reason_and_nowhere_else(raw, tmp_path):
    folder = shutil.copytree(raw, tmp_path / "raw")
    (folder / "3mm/r02.csv").write_text("no recording\n")
    shutil.copy(folder / "3mm/r03.csv", folder / "3mm/r03-copy.csv")
    lines = (folder / "0mm/r03.csv").read_text(encoding="utf-8").splitlines(keepends=True)
    (folder / "0mm/r05.csv").write_text("".join(lines[:-20]))
    (folder / "notes.txt").write_text("a note")
    archive = capsule.load(folder)
    rejected = archive.recordings[archive.recordings["status"] == "rejected"]["reason"]
    assert sorted(rejected.index) == ["3mm/r02", "3mm/r03-copy"]
    assert rejected["3mm/r02"].startswith("line 1: the column 'time_s' is missing")
    assert rejected["3mm/r03-copy"] == "the same content as 3mm/r03"
    held = [archive.readings, archive.matrices, archive.headers, archive.labelled]
    assert not {*rejected.index} & set().union(*held)
    accepted = "13 recordings accepted (0mm, 0.5mm, 3mm, unlabelled)"
    assert repr(archive) == f"<LoadedArchive: {accepted}, 2 rejected>"
    assert archive.passed_over["path"].tolist() == ["notes.txt"]
    assert archive.unlabelled == ["unlabelled/patient"]
    # The largest of these recordings has some 12 kB.
    assert len(capsule.load(folder, recording={"max_megabytes": 0.02})) == 13
    with pytest.raises(capsule.CapsuleError, match=r"on_rejected is fail(.|\n)*3mm/r02: line 1"):
        capsule.load(folder, on_rejected="fail")
    # Recordings that are nearly the same are one place, of nine.
    pair = ["0mm/r03", "0mm/r05"]
    assert archive.recordings["near_copies"].dropna().index.tolist() == pair
    assert len(capsule.folds(archive)) == 9
    assert archive.select(["0mm/r03", "3mm/r01"]).recordings["near_copies"].isna().all()


def test_the_paper_s_steps_work_on_what_is_loaded(archive):
    name = "3mm/r01"
    matrix = capsule.preprocess(archive.readings[name], **archive.preprocess_options)
    np.testing.assert_array_equal(matrix, archive.matrices[name])
    fit = capsule.fit_particle(matrix, archive.generator(name), **archive.fit_options)
    assert (fit.rmse, fit.lag) == (archive.fit(name).rmse, archive.fit(name).lag)
    templates = capsule.build_templates(archive.particles(), **archive.template_options)
    for ours, theirs in zip(templates.matrices, archive.templates.matrices, strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_rows_for_estimators_hold_the_readings(archive):
    np.testing.assert_array_equal(archive.X, archive.rows(archive.labelled))
    (row,), values = archive.rows("3mm/r01"), archive.readings["3mm/r01"]
    padded = np.pad(values, ((0, 0), (0, 1000 - values.shape[1])), constant_values=np.nan)
    np.testing.assert_array_equal(row.reshape(1000, 4).T, padded)
    assert archive.select("3mm/r01").labelled == ["3mm/r01"]
    assert archive.y.tolist() == [0.0] * 4 + [0.5] * 4 + [3.0] * 4


def test_the_settings_beside_the_folder_count(raw, tmp_path):
    folder = tmp_path / "raw"
    shutil.copytree(raw / "unlabelled", folder / "unlabelled")
    text = (ROOT / "config/config.yaml").read_text(encoding="utf-8")
    (tmp_path / "config").mkdir()
    (tmp_path / "config/config.yaml").write_text(text.replace("window: 84 ", "window: 80 "))
    assert capsule.load(folder).settings["preprocessing"]["window"] == 80
    named = capsule.load(folder, config=ROOT / "config/config.yaml")
    assert named.settings["preprocessing"]["window"] == 84
    with pytest.raises(capsule.CapsuleError, match=r"changes: fit\.seeds: there is no such"):
        capsule.load(folder, fit={"seeds": 2})
    with pytest.raises(capsule.CapsuleError, match="does not exist; create it"):
        capsule.load(folder / "nowhere")


def test_a_name_that_is_not_there_is_refused_with_the_nearest_one(archive):
    told = r"^there is no recording 3mm/r11; did you mean 3mm/r01\? archive.recordings lists all"
    for ask in ("fit", "plot", "rows", "select", "to_dataframe", "readings.__getitem__"):
        with pytest.raises(capsule.CapsuleError, match=told) as refused:
            attrgetter(ask)(archive)("3mm/r11")
        assert isinstance(refused.value, KeyError)
    with pytest.raises(KeyError, match="there is no recording session; archive"):
        archive.fit("session")


def test_a_table_has_a_row_for_each_sample(archive):
    table = archive.to_dataframe(["3mm/r01", "unlabelled/patient"])
    sensors = [f"sensor_{number}" for number in (1, 2, 3, 4)]
    assert list(table) == ["recording", "size_mm", "time_s", *sensors]
    assert list(table.index) == list(range(len(table)))
    for name, of_one in table.groupby("recording"):
        np.testing.assert_array_equal(of_one[sensors].to_numpy().T, archive.readings[name])
        np.testing.assert_allclose(of_one["time_s"], 0.1 * np.arange(len(of_one)))
    sizes_mm = table.groupby("recording")["size_mm"].first()
    np.testing.assert_array_equal(sizes_mm, [3.0, np.nan])
    assert archive.to_dataframe("3mm/r01").equals(table[table["recording"] == "3mm/r01"])
    assert set(archive.to_dataframe()["recording"]) == set(archive.readings)
    assert list(archive.to_dataframe([])) == list(table)


def test_a_recording_is_drawn_with_its_true_size_and_the_best_place(archive):
    name = "unlabelled/patient"
    signal, *_ = axes = archive.plot(name).axes[:3]
    assert signal.get_title(loc="left") == f"{name}, true size: not known"
    drawn = [len(line.get_xdata()) for line in signal.get_lines()]
    assert drawn.count(archive.readings[name].shape[1]) == 4
    place_s = archive._described[name].passage.location_samples / 10
    assert all({place_s} in [set(line.get_xdata()) for line in each.get_lines()] for each in axes)


def test_every_public_name_is_there_and_what_the_page_on_the_library_names(archive):
    for name in (*dir(capsule), *capsule.__all__):
        assert getattr(capsule, name).__doc__ or name.startswith("__"), name
    assert not hasattr(capsule, "loaded")
    page = (ROOT / "docs/library.md").read_text(encoding="utf-8")
    for owner, named in ((archive, r"`archive\.(\w+)"), (capsule, r"\bcapsule\.(\w+)")):
        names = set(re.findall(named, page))
        assert len(names) > 8
        assert all(hasattr(owner, name) for name in names)


def test_importing_imports_nothing_else_loading_no_matplotlib_and_scikit_learn_may_be_missing():
    program = f"import sys; sys.path.insert(0, {str(ROOT / 'workflow/scripts')!r})\n"
    program += "before = set(sys.modules); import capsule; print(*set(sys.modules) - before)\n"
    program += "sys.modules['sklearn'] = None\n"
    program += f"capsule.load({str(ROOT / 'tests/data')!r}); print('matplotlib' in sys.modules)\n"
    program += "try:\n    capsule.DetectorEstimator\nexcept capsule.CapsuleError as error:\n"
    program += "    print(error)\nassert capsule.judge and capsule.folds"
    told = f"the estimators need scikit-learn, which is not installed; run in {ROOT}: pip install"
    assert output_of(sys.executable, "-c", program) == f'capsule\nFalse\n{told} -e ".[learn]"\n'
