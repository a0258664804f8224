"""The first run makes every result, and the library makes the same; a second run has no work."""

import json
import math
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
from support.same_table import assert_same_table

pytestmark = pytest.mark.workflow


def is_nodule(name):
    return not name.startswith(("0mm", "unlabelled"))


def recordings_of(project):
    """Return the names of a project's recordings."""
    return [f"{path.parent.name}/{path.stem}" for path in sorted(project.raw.glob("*/*.csv"))]


def test_every_recording_is_accepted_and_judged_by_every_detector_under_every_scheme(finished):
    names = recordings_of(finished)
    status = {row["recording"]: row["status"] for row in finished.table("recordings.csv")}
    assert status == dict.fromkeys(names, "accepted")
    labelled = [name for name in names if not name.startswith("unlabelled")]
    predictions = finished.table("evaluation/predictions.csv")
    judged = [(row["detector"], row["recording"], row["scheme"]) for row in predictions]
    assert judged == list(product(DETECTORS, labelled, ["leave_one_out", "resubstitution"]))
    for table in ("detection", "specificity", "sizing", "confusion", "summary", "auc"):
        detectors = [row["detector"] for row in finished.table(f"evaluation/{table}.csv")]
        assert detectors[0] == PAPER
        assert set(DETECTORS) <= set(detectors)
    for name in filter(is_nodule, names):
        fit = json.loads((finished.results / "fits" / f"{name}.json").read_text())
        assert fit["rmse"] <= fit["rmse_initial"]


def test_every_detector_judges_the_unlabelled_recording(finished):
    verdicts = {row["detector"]: row for row in finished.table("detections.csv")}
    assert list(verdicts) == list(DETECTORS)
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
        if row["detector"] == "diagonal" and row["estimate_mm"]
    ]
    assert rows
    for row in rows:
        low, estimate, high = (float(row[f"estimate{end}_mm"]) for end in ("_low", "", "_high"))
        # Nothing is known of nodules above the largest size of the archive: no end there.
        assert 1 <= low <= estimate <= 2.5
        assert estimate <= high <= 2.5 or high == math.inf


def test_what_is_handed_on_judges_a_recording_as_the_workflow_did(finished):
    settings = read_config_file(finished.folder / "config/config.yaml")
    final = FinalVerdict(
        finished.results / "templates.npz", finished.results / "detectors.json", settings
    )
    rows = finished.table("detections.csv")
    values = np.load(finished.results / "signals/unlabelled/patient.npy")
    unknown, *said = final.judge(values)
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

    taught = taught_recordings(finished.results / "recordings.csv")
    judged = judge_file(finished.raw / "unlabelled/patient.csv", final, settings, taught)
    values = as_plain_values(judged, settings["recording"]["rate_hz"])
    assert (values["status"], values["taught_as"]) == ("accepted", "")
    assert list(values["verdicts"]) == [row["detector"] for row in rows]
    for row in rows:
        verdict = values["verdicts"][row["detector"]]
        shared = verdict.keys() & row.keys() - {"reason"}
        assert len(shared) == 9
        for name in shared:
            expected = float(row[name]) if row[name] else None
            assert verdict[name] == (expected and pytest.approx(expected, rel=1e-12)), name
        distances = [float(row[name]) for name in row if name.startswith("rmse_") and row[name]]
        assert verdict["distances"] == pytest.approx(distances, rel=1e-12)
    labelled = finished.raw / "0mm/r01.csv"
    assert judge_file(labelled, final, settings, taught).taught_as == "0mm/r01"


@pytest.fixture(scope="module")
def loaded(finished):
    """Load the same recordings with the library, which uses the settings beside them."""
    return load(finished.raw)


def test_the_library_gives_the_workflows_recordings_fits_and_templates_to_the_bit(finished, loaded):
    names = recordings_of(finished)
    assert_same_table(loaded.recordings.reset_index(), finished.results / "recordings.csv")
    assert list(loaded.readings) == names
    for name in names:
        signal, matrix = (
            np.load(finished.results / kind / f"{name}.npy") for kind in ("signals", "matrices")
        )
        assert matrix.shape == (4, 1000)
        np.testing.assert_array_equal(loaded.readings[name], signal)
        np.testing.assert_array_equal(loaded.matrices[name], matrix)
    for name in filter(is_nodule, names):
        stored = json.loads((finished.results / "fits" / f"{name}.json").read_text())
        fit = loaded.fit(name)
        made = {key: value.tolist() for key, value in vars(fit.particle).items()}
        assert (made, fit.rmse, fit.lag) == (stored["parameters"], stored["rmse"], stored["lag"])
    with np.load(finished.results / "templates.npz") as templates:
        assert list(templates) == ["0mm", "1mm", "2.5mm"]
        for name, matrix in zip(templates, loaded.templates.matrices, strict=True):
            np.testing.assert_array_equal(matrix, templates[name])


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


def test_a_fresh_checkout_with_new_dates_runs_nothing_again(finished, tmp_path):
    assert finished.copy(tmp_path / "checkout", keep_times=False).snakemake().did_nothing


@pytest.mark.slow
def test_an_archive_too_small_for_rates_has_its_report(new, tmp_path):
    """One healthy recording and one nodule give verdicts; the page says how far to trust them."""
    project = new.copy(tmp_path / "few")
    for name in recordings_of(project):
        if name not in ("0mm/r01", "1mm/r01", "unlabelled/patient"):
            (project.raw / f"{name}.csv").unlink()
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
    (project.raw / "0mm/r01.csv").unlink()
    run = project.snakemake()
    assert run.status == 0, run.output
    page = (project.results / "report.html").read_text(encoding="utf-8")
    assert "No healthy recording, so no false alarm can occur." in page
    (row,) = [r for r in project.table("evaluation/specificity.csv") if "leave" in r["scheme"]]
    assert (row["healthy"], row["specificity"]) == ("0", "")


@pytest.mark.slow
def test_snakemakes_own_report_and_the_figures_for_print_are_made_on_request(project):
    # Snakemake's own use of docutils warns.
    run = project.snakemake("--report", "own.zip", environment={"PYTHONWARNINGS": ""})
    assert run.status == 0, run.output
    with zipfile.ZipFile(project.folder / "own.zip") as archive:
        shown = {name.rpartition("/")[2] for name in archive.namelist()}
    assert {"report.html", "detections.csv", "recordings.csv", "detection.csv"} <= shown
    assert {f"{name}.svg" for name in FIGURES} <= shown
    assert project.snakemake("figures").jobs == {"figures": 1}
    for row in FIGURES.values():
        shown, printed = (project.results / folder for folder in ("figures", "print"))
        data = f"{row.name}.csv"
        assert (printed / data).read_bytes() == (shown / data).read_bytes()
        for width in ("", "_column"):
            assert (printed / f"{row.name}{width}.pdf").read_bytes().startswith(b"%PDF")
    assert project.snakemake().did_nothing
