"""The workflow runs on small data."""

import json
import math
import shutil
import subprocess
import sys
import zipfile
from itertools import product

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from capsule import DetectorEstimator, judge, load, words
from capsule.detectors.registry import DETECTORS, PAPER
from capsule.engine.configuration import read_config_file
from capsule.figures.registry import FIGURES
from capsule.judging.judged import as_plain_values, judge_file, taught_recordings
from capsule.judging.verdict import FinalVerdict
from support.plain_figures import draw_plain_figures
from support.project import Project
from support.same_table import assert_same_table
from support.synthetic import write_archive

pytestmark = pytest.mark.workflow

# Without one of four healthy recordings three are left, the least that every detector learns from.
HEALTHY = [f"0mm/r{run:02d}" for run in (1, 2, 3, 4)]
RECORDINGS = [*HEALTHY, *(f"{size}mm/r{run:02d}" for size in (1, 2.5) for run in (1, 2))]
# What a run makes before the figures, which take most of the time and depend on all of it.
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
# What a run makes but for the page, which holds the date.
ALL_BUT_PAGE = [*TABLES, "results/sites.csv"]
ALL_BUT_PAGE += [f"results/figures/{name}.svg" for name in FIGURES]
RECORDINGS.append("unlabelled/patient")
FOLDERS = {name.partition("/")[0] for name in RECORDINGS}
ALL_BUT_PAGE += [f"results/plot_data/{folder}/batch.json" for folder in sorted(FOLDERS)]
NODULES = [name for name in RECORDINGS if name.startswith(("1mm", "2.5mm"))]


@pytest.fixture(scope="module")
def new(tmp_path_factory):
    """Return a project with recordings and without results."""
    folder = tmp_path_factory.mktemp("new") / "project"
    return Project.create(folder, RECORDINGS, particles=20, iterations=20)


@pytest.fixture(scope="module")
def finished(new, tmp_path_factory):
    """Return the project after one run; tests copy it and do not change it."""
    project = new.copy(tmp_path_factory.mktemp("finished") / "project")
    run = project.snakemake()
    assert run.status == 0, run.output
    assert run.jobs["preprocess"] == len(RECORDINGS)
    assert run.jobs["fit"] == len(NODULES)
    return project


@pytest.fixture
def project(finished, tmp_path):
    return finished.copy(tmp_path / "project")


def test_every_recording_is_listed_as_accepted(finished):
    status = {row["recording"]: row["status"] for row in finished.table("recordings.csv")}
    assert status == dict.fromkeys(RECORDINGS, "accepted")


def test_every_recording_has_a_matrix(finished):
    for name in RECORDINGS:
        assert np.load(finished.results / "matrices" / f"{name}.npy").shape == (4, 1000)


def test_an_archive_without_a_labelled_recording_is_refused_in_one_line(tmp_path):
    project = Project.create(tmp_path / "project", ["unlabelled/patient"])
    run = project.snakemake("--keep-going")
    assert run.status == 1
    log = (project.results / "logs/templates.log").read_text(encoding="utf-8")
    assert log.startswith("error: no recording of a nodule can be used")
    assert log.count("\n") == 1


def test_a_fit_is_no_worse_than_the_particle_it_began_with(finished):
    for name in NODULES:
        fit = json.loads((finished.results / "fits" / f"{name}.json").read_text())
        assert fit["rmse"] <= fit["rmse_initial"]


def test_every_size_has_a_template(finished):
    with np.load(finished.results / "templates.npz") as templates:
        assert list(templates) == ["0mm", "1mm", "2.5mm"]


def test_every_detector_judges_every_labelled_recording_under_every_scheme(finished):
    predictions = finished.table("evaluation/predictions.csv")
    labelled = [name for name in RECORDINGS if not name.startswith("unlabelled")]
    judged = [(row["detector"], row["recording"], row["scheme"]) for row in predictions]
    assert judged == list(product(DETECTORS, labelled, ["leave_one_out", "resubstitution"]))
    assert {"rmse_0mm", "rmse_1mm", "rmse_2.5mm"} <= set(predictions[0])


def test_every_detector_judges_the_unlabelled_recording(finished):
    verdicts = {row["detector"]: row for row in finished.table("detections.csv")}
    assert list(verdicts) == list(DETECTORS)
    assert {row["recording"] for row in verdicts.values()} == {"unlabelled/patient"}
    by_rule, by_diagonal = verdicts["template"], verdicts["diagonal"]
    nearest = min(("0mm", "1mm", "2.5mm"), key=lambda size: float(by_rule[f"rmse_{size}"]))
    assert f"{float(by_rule['predicted_mm']):g}mm" == nearest
    assert float(by_diagonal["score"]) != float(by_diagonal["threshold"])
    assert 0 < float(by_diagonal["probability"]) < 1


def test_every_size_that_is_a_number_of_mm_has_its_interval(finished):
    rows = [
        row
        for name in ("evaluation/predictions.csv", "detections.csv")
        for row in finished.table(name)
        if row["detector"] in ("diagonal", "taught") and row["estimate_mm"]
    ]
    # The taught detector finds none of these: bumps on the level are no beats.
    assert {row["detector"] for row in rows} >= {"diagonal"}
    for row in rows:
        low, estimate, high = (float(row[f"estimate{end}_mm"]) for end in ("_low", "", "_high"))
        # Nothing is known of nodules above the largest size of the archive: no end there.
        assert 1 <= low <= estimate <= 2.5
        assert estimate <= high <= 2.5 or high == math.inf


@pytest.mark.parametrize(
    "name", ["detection", "specificity", "sizing", "confusion", "summary", "auc"]
)
def test_every_table_has_every_detector_the_papers_first(finished, name):
    detectors = [row["detector"] for row in finished.table(f"evaluation/{name}.csv")]
    assert detectors[0] == PAPER
    assert set(DETECTORS) <= set(detectors)


def test_what_is_handed_on_judges_a_recording_as_the_workflow_did(finished):
    settings = read_config_file(finished.folder / "config/config.yaml")
    files = finished.results / "templates.npz", finished.results / "detectors.json"
    values = np.load(finished.results / "signals/unlabelled/patient.npy")
    unknown, *said = FinalVerdict(*files, settings).judge(values)
    rows = finished.table("detections.csv")
    # This archive is too small to teach what is familiar.
    assert {row["familiar"] for row in rows} == {""}
    assert unknown.endswith(f" is not known: {rows[0]['unfamiliar_because']}")
    for line, row in zip(said, rows, strict=True):
        sized = {name: float(row[name] or "nan") for name in row if name.startswith("estimate_")}
        verdict = row["verdict"]
        verdict += f", {words.estimated_size(sized)}" if row["estimate_mm"] else ""
        assert line.startswith(f"verdict of {row['detector']}: {verdict}")
        assert not row["probability"] or words.percent(float(row["probability"])) in line
        assert not row["location_s"] or words.place(float(row["location_s"]), None) in line


def test_a_file_is_judged_as_the_workflow_judges_it(finished):
    settings = read_config_file(finished.folder / "config/config.yaml")
    files = finished.results / "templates.npz", finished.results / "detectors.json"
    taught = taught_recordings(finished.results / "recordings.csv")
    judged = judge_file(
        finished.raw / "unlabelled/patient.csv", FinalVerdict(*files, settings), settings, taught
    )
    said = as_plain_values(judged, settings["recording"]["rate_hz"])
    assert (said["status"], said["taught_as"]) == ("accepted", "")
    rows = finished.table("detections.csv")
    assert list(said["verdicts"]) == [row["detector"] for row in rows]
    names = said["verdicts"]["diagonal"].keys() - {"reason", "distances"}
    assert len(names) == 9
    for row in rows:
        verdict = said["verdicts"][row["detector"]]
        assert {name for name in names if verdict[name] is None} == {
            name for name in names if not row[name]
        }
        known = {name: float(row[name]) for name in names if row[name]}
        assert {name: verdict[name] for name in known} == pytest.approx(known, rel=1e-12)
        distances = [float(row[name]) for name in row if name.startswith("rmse_") and row[name]]
        assert verdict["distances"] == pytest.approx(distances, rel=1e-12)
    labelled = finished.raw / f"{RECORDINGS[0]}.csv"
    judged = judge_file(labelled, FinalVerdict(*files, settings), settings, taught)
    assert judged.taught_as == RECORDINGS[0]


def test_a_second_call_has_nothing_to_do(project):
    assert project.snakemake().did_nothing


def test_a_call_that_only_lists_needs_no_number_of_cores(new):
    command = [sys.executable, "-m", "snakemake", "--dry-run"]
    done = subprocess.run(command, cwd=new.folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "evaluate" in done.stdout + done.stderr


def test_touch_runs_nothing_again(project):
    for path in project.folder.rglob("*"):
        if path.is_file() and project.results not in path.parents:
            path.touch()
    assert project.snakemake().did_nothing


def test_a_fresh_checkout_runs_nothing_again(finished, tmp_path):
    assert finished.copy(tmp_path / "checkout", keep_times=False).snakemake().did_nothing


@pytest.fixture(scope="module")
def one_more(finished, tmp_path_factory):
    """Return a copy with a recording more, and the run that made its tables."""
    project = finished.copy(tmp_path_factory.mktemp("one_more") / "project")
    write_archive(project.raw, ["1mm/r03"])
    # Of the figures, the data are compared.
    draw_plain_figures(project.folder)
    return project, project.snakemake(*TABLES)


def test_one_recording_more_costs_one_job_a_stage(one_more, finished):
    project, run = one_more
    lists = ("list", "list_labelled")
    stages = ("preprocess", *lists, "fit", "describe", "templates", "evaluate", "detect")
    assert run.jobs == dict.fromkeys(stages, 1)
    before = finished.result_bytes()
    after = project.result_bytes()
    assert len(project.table("recordings.csv")) == len(RECORDINGS) + 1
    assert all(after[name] == before[name] for name in before if name.startswith("fits/"))


def test_a_removed_recording_leaves_the_result_as_if_it_had_never_been(
    one_more, finished, tmp_path
):
    project = one_more[0].copy(tmp_path / "project")
    (project.raw / "1mm/r03.csv").unlink()
    run = project.snakemake(*ALL_BUT_PAGE)
    assert run.status == 0, run.output
    assert not run.jobs["preprocess"] + run.jobs["fit"]
    before, after = finished.result_bytes(), project.result_bytes()
    assert (project.results / "fits/1mm/r03.json").exists()
    same = [name for name in before if not name.startswith("report") and ".svg" not in name]
    assert {f"figures/{name}.csv" for name in FIGURES} <= set(same)
    assert [name for name in same if after[name] != before[name]] == []


@pytest.mark.slow
def test_results_do_not_depend_on_the_number_or_order_of_jobs(new, finished, tmp_path):
    single = new.copy(tmp_path / "single")
    last_first = [f"results/fits/{name}.json" for name in reversed(NODULES)]
    assert single.snakemake(*last_first, cores=1).status == 0
    assert single.snakemake(*ALL_BUT_PAGE, cores=1).status == 0
    expected, actual = finished.result_bytes(), single.result_bytes()
    same = [name for name in expected if not name.startswith("report")]
    assert [name for name in same if actual[name] != expected[name]] == []


def test_a_rejected_recording_does_not_stop_the_others(project, finished):
    bad = project.raw / "1mm/bad.csv"
    bad.write_text("time_s,sensor_1,sensor_2,sensor_3,sensor_4\n0,1,2,3,x\n", encoding="utf-8")
    (project.raw / "1mm/r01-copy.csv").write_bytes((project.raw / "1mm/r01.csv").read_bytes())
    (project.raw / "1mm/two words.csv").write_bytes(bad.read_bytes())
    (project.raw / "2cm").mkdir()
    # Figures and page beside rejected recordings: test_bad_recordings.py.
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    rejected = {
        row["recording"]: row["reason"]
        for row in project.table("recordings.csv")
        if row["status"] == "rejected"
    }
    assert rejected["1mm/bad"] == "line 2: 'x' is not a number"
    assert rejected["1mm/r01-copy"] == "the same content as 1mm/r01"
    assert rejected["1mm/two words.csv"].startswith("rename the file")
    assert "rejected: raw/1mm/bad: line 2: 'x' is not a number" in run.output
    assert "passed over: raw/2cm/" in run.output
    assert np.isnan(np.load(project.results / "matrices/1mm/bad.npy")).all()
    bad_fit = json.loads((project.results / "fits/1mm/bad.json").read_text())
    assert bad_fit["parameters"] is None
    before, after = finished.result_bytes(), project.result_bytes()
    templates = [name for name in before if name.startswith("templates")]
    assert all(after[name] == before[name] for name in [*templates, "evaluation/detection.csv"])


def test_on_request_a_rejected_recording_stops_before_any_fit(tmp_path):
    names = ["0mm/r01", "1mm/r01", "1mm/r02"]
    project = Project.create(tmp_path / "strict", names, particles=10, iterations=10)
    project.configure(on_rejected="fail")
    (project.raw / "1mm/bad.csv").write_bytes(b"")
    # With two cores, a fit may start beside the last check.
    run = project.snakemake(*TABLES, cores=1)
    assert run.status != 0
    assert run.jobs["preprocess"] == len(names) + 1
    assert run.jobs["fit"] == 0
    assert "1mm/bad: the file is empty" in run.output
    (project.raw / "1mm/bad.csv").unlink()
    assert project.snakemake(*TABLES).status == 0
    write_archive(project.raw, ["1mm/r03"])
    assert project.snakemake("--dry-run", *TABLES).jobs["fit"] == 1


def test_a_fault_in_the_configuration_is_told_before_anything_runs(new, tmp_path):
    project = new.copy(tmp_path / "misspelt")
    project.configure(preprocessing={"windw": 84})
    run = project.snakemake()
    assert run.status != 0
    assert "preprocessing.windw: there is no such key; did you mean window?" in run.output
    assert not project.results.exists()


def test_snakemakes_own_report_shows_tables_figures_and_the_page(project, tmp_path):
    # Snakemake's own use of docutils warns.
    run = project.snakemake("--report", "own.zip", environment={"PYTHONWARNINGS": ""})
    assert run.status == 0, run.output
    with zipfile.ZipFile(project.folder / "own.zip") as archive:
        shown = {name.rpartition("/")[2] for name in archive.namelist()}
        results = "".join(
            archive.read(name).decode() for name in archive.namelist() if name.endswith(".html")
        )
    assert {"report.html", "detections.csv", "recordings.csv", "detection.csv"} <= shown
    assert {f"{name}.svg" for name in FIGURES} <= shown
    assert all(category in results for category in ("Verdicts", "Rates", "Figures"))


@pytest.mark.slow
def test_the_figures_for_print_are_made_on_request(project):
    assert project.snakemake("figures").jobs == {"figures": 1}
    for row in FIGURES.values():
        shown, printed = (project.results / folder for folder in ("figures", "print"))
        data = f"{row.name}.csv"
        assert (printed / data).read_bytes() == (shown / data).read_bytes()
        for width in ("", "_column"):
            assert (printed / f"{row.name}{width}.pdf").read_bytes().startswith(b"%PDF")
    assert project.snakemake().did_nothing


def test_an_archive_of_nodules_alone_has_its_figures_and_report_too(new, tmp_path):
    project = new.copy(tmp_path / "nodules")
    for folder in ("0mm", "unlabelled"):
        shutil.rmtree(project.raw / folder)
    # What the figures show of such an archive: test_figures.py.
    draw_plain_figures(project.folder)
    run = project.snakemake()
    assert run.status == 0, run.output
    page = (project.results / "report.html").read_text(encoding="utf-8")
    assert "There is no recording without a nodule." in page
    silent = "diagonal and taught have given no verdict"
    assert f"{silent} on a labelled recording." in page
    assert "To get a verdict on a recording whose nodule is not known" in page
    (row,) = [r for r in project.table("evaluation/specificity.csv") if "leave" in r["scheme"]]
    assert (row["healthy"], row["specificity"]) == ("0", "")


def test_two_labelled_recordings_are_enough_for_verdicts_and_the_page_says_how_far_to_trust_them(
    new, tmp_path
):
    project = new.copy(tmp_path / "few")
    for name in (*HEALTHY[1:], "1mm/r02", "2.5mm/r01", "2.5mm/r02"):
        (project.raw / f"{name}.csv").unlink()
    draw_plain_figures(project.folder)
    run = project.snakemake()
    assert run.status == 0, run.output
    said = project.table("detections.csv")
    assert [row["detector"] for row in said] == list(DETECTORS)
    # The only healthy score is the threshold.
    assert all(row["predicted_mm"] for row in said)
    page = (project.results / "report.html").read_text(encoding="utf-8")
    assert "this takes 19 healthy places, and this archive has 1." in page
    # Without the one healthy recording there is none to learn a threshold from.
    assert "taught has given no verdict" in page


@pytest.fixture(scope="module")
def loaded(finished):
    """Load the same recordings with the library, which uses the settings beside them."""
    return load(finished.raw)


def test_the_library_gives_the_workflows_recordings_to_the_bit(finished, loaded):
    assert_same_table(loaded.recordings.reset_index(), finished.results / "recordings.csv")
    assert list(loaded.readings) == RECORDINGS
    for name in RECORDINGS:
        stored = {kind: finished.results / kind / f"{name}.npy" for kind in ("signals", "matrices")}
        np.testing.assert_array_equal(loaded.readings[name], np.load(stored["signals"]))
        np.testing.assert_array_equal(loaded.matrices[name], np.load(stored["matrices"]))


def test_the_library_gives_the_workflows_fits_and_templates_to_the_bit(finished, loaded):
    for name in NODULES:
        stored = json.loads((finished.results / "fits" / f"{name}.json").read_text())
        fit = loaded.fit(name)
        made = {key: value.tolist() for key, value in vars(fit.particle).items()}
        assert (made, fit.rmse, fit.lag) == (stored["parameters"], stored["rmse"], stored["lag"])
    with np.load(finished.results / "templates.npz") as templates:
        for size_mm, matrix in zip((0, 1, 2.5), loaded.templates.matrices, strict=True):
            np.testing.assert_array_equal(matrix, templates[f"{size_mm:g}mm"])


def test_the_library_gives_the_workflows_verdicts_and_tables_to_the_bit(finished, loaded):
    # As in the jobs: more threads add up in another order.
    with threadpool_limits(1):
        judged = judge(loaded)
    evaluation = finished.results / "evaluation"
    assert_same_table(judged.predictions, evaluation / "predictions.csv")
    assert {path.stem for path in evaluation.glob("*.csv")} == {"predictions", *judged.tables}
    for name, table in judged.tables.items():
        assert_same_table(table, evaluation / f"{name}.csv")
    assert_same_table(judged.detections, finished.results / "detections.csv")


@pytest.mark.parametrize("detector", DETECTORS)
def test_a_detector_as_an_estimator_gives_the_workflows_verdicts(finished, loaded, detector):
    estimator = DetectorEstimator(detector, loaded.settings)
    made = judge(loaded, estimator).predictions.set_index("recording")
    rows = {
        row["recording"]: row
        for row in finished.table("evaluation/predictions.csv")
        if (row["detector"], row["scheme"]) == (detector, "leave_one_out")
    }
    assert list(made.index) == list(rows)
    columns = ["predicted_mm", "score", "threshold", "probability", "estimate_mm", "location_s"]
    for column in columns:
        stored = [float(row[column] or "nan") for row in rows.values()]
        # The workflow leaves recordings out of sums; an estimator adds the others up anew.
        np.testing.assert_allclose(made[column], stored, rtol=1e-9, err_msg=column)
