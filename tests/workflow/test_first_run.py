"""The first run makes every result, and the library makes the same; a second run has no work."""

import io
import json
import os
import re
import shlex
import shutil
import sys
import zipfile
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from threadpoolctl import threadpool_limits

from capsule import judge, load
from capsule.detectors.registry import DETECTORS
from capsule.detectors.unlike import because
from capsule.figures.registry import FIGURES
from capsule.recordings.recording import format_recording
from capsule.store.results import BATCH_COLUMNS
from support.command import output_of
from support.synthetic import make_recording

pytestmark = pytest.mark.workflow


# Inputs of which a job reads some: near copies are compared if their marks are alike, two
# recordings stand for all in a figure, passes of one place are combined if there are any, and a
# page shows nothing of a figure's data.
IN_PART = {
    "list": ("results/signals/",),
    "list_labelled": ("results/signals/",),
    "draw": ("results/signals/", "results/evaluation/"),
    "detect": ("results/matrices/", "results/evaluation/predictions.csv"),
    "report": ("results/matrices/", "results/figures/", "results/surveys/"),
}


def recordings_of(project):
    """Return the names of a project's recordings."""
    return [f"{path.parent.name}/{path.stem}" for path in sorted(project.raw.glob("*/*.csv"))]


def test_every_recording_is_accepted_and_judged_by_every_detector_under_its_schemes(finished):
    names = recordings_of(finished)
    status = {row["recording"]: row["status"] for row in finished.table("recordings.csv")}
    assert status == dict.fromkeys(names, "accepted")
    predictions = finished.table("evaluation/predictions.csv")
    judged = [(row["detector"], row["recording"], row["scheme"]) for row in predictions]
    # The session of one is held out: it judges, and teaches nothing.
    held_out, schemes = "2.5mm/h01", dict.fromkeys(names, ("leave_one_out", "resubstitution"))
    schemes |= {held_out: ("held_out",), "unlabelled/patient": ()}
    assert judged == [(by, name, of) for by in DETECTORS for name in names for of in schemes[name]]
    assert not (finished.results / f"fits/{held_out}.json").exists()
    # The run has locked the folder and signed its results.
    assert (finished.folder / ".snakemake/run.lock").read_text().startswith("process ")
    assert (finished.results / "run.txt").is_file()


def test_what_is_handed_on_judges_a_recording_as_the_workflow_did(finished):
    call = ["workflow/scripts/capsule", "judge", "--json", "raw/unlabelled/patient.csv"]
    (values,) = json.loads(output_of(sys.executable, *call, cwd=finished.folder))
    rows = finished.table("detections.csv")
    # This archive is too small to teach what is familiar.
    assert {row["familiar"] for row in rows} == {""}
    told = rows[0] | {name: float(rows[0][name]) for name in ("unlike_value", "unlike_least")}
    assert (values["familiar"], values["unfamiliar_because"]) == (None, because(told))
    assert (values["status"], values["taught_as"]) == ("accepted", "")
    for row, (detector, verdict) in zip(rows, values["verdicts"].items(), strict=True):
        shared = verdict.keys() & row.keys() - {"reason"}
        assert (detector, len(shared)) == (row["detector"], 9)
        for name in shared:
            expected = float(row[name]) if row[name] else None
            assert verdict[name] == (expected and pytest.approx(expected, rel=1e-12)), name
        distances = [float(row[name]) for name in row if name.startswith("rmse_") and row[name]]
        assert verdict["distances"] == pytest.approx(distances, rel=1e-12)


def assert_same_table(table, path):
    """Check that a table and a file have the same columns, rows in the same order, and cells.

    The file may also say where the results of a recording stand.
    """
    # A header line's number is a text in the library.
    made = pd.read_csv(io.StringIO(table.to_csv(index=False)))
    stored = pd.read_csv(path).drop(columns=[*BATCH_COLUMNS], errors="ignore")
    pd.testing.assert_frame_equal(made, stored, check_dtype=False, check_exact=True)


@pytest.fixture(scope="module")
def loaded(finished):
    """Load the same recordings with the library, which uses the settings beside them."""
    return load(finished.raw)


def test_the_library_gives_the_workflows_recordings_fits_and_templates_to_the_bit(finished, loaded):
    assert_same_table(loaded.recordings.reset_index(), finished.results / "recordings.csv")
    assert list(loaded.readings) == recordings_of(finished)
    for kind, made in (("signals", loaded.readings), ("matrices", loaded.matrices)):
        for name, values in made.items():
            stored = np.load(finished.results / kind / f"{name}.npy")
            np.testing.assert_array_equal(values, stored)
    for name in ("1mm/r01", "1mm/r02", "2.5mm/r01"):
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


# What the jobs have read.


@pytest.fixture(scope="module")
def jobs(finished):
    """Return rule, declared inputs and read files of each job of the first run."""
    read = {}
    for line in finished.folder.with_name("traced").read_text(encoding="utf-8").splitlines():
        words, path = json.loads(line)
        read.setdefault(tuple(words), set()).add(path)
    made = {}
    for path in (finished.folder / ".snakemake/metadata").iterdir():
        job = json.loads(path.read_text(encoding="utf-8"))
        words = tuple(shlex.split(job["shellcmd"].partition(" > ")[0])[1:])
        # What is no input because its content alone decides is named in the command.
        named = {word.partition("=")[0] for word in words}
        named = {word for word in named if word.startswith(("raw/", "sessions/"))}
        made[words] = job["rule"], {*job["input"], *named}, read[words]
    return list(made.values())


def below(path, names):
    """Return whether a path is one of some names, or lies below one."""
    return any(path == name or path.startswith(f"{name.rstrip('/')}/") for name in names)


def test_a_job_reads_what_its_rule_declares_and_nothing_else(jobs):
    for rule, declared, read in jobs:
        ours = {path for path in read if path.startswith(("results/", "raw/", "sessions/"))}
        assert not {path for path in ours if not below(path, declared)}, rule
        in_part = "sessions", *IN_PART.get(rule, ())
        assert not {path for path in declared - read if not below(path, in_part)}, rule
    assert len({rule for rule, *_ in jobs}) == 12


def test_a_job_that_needs_no_table_imports_no_package_but_numpy(jobs):
    """Imports take most of the time of such a job."""
    package = re.compile(r".*site-packages/(?:__pycache__/)?([A-Za-z]\w*)(?:/|\.py|\.cpython)")
    for rule, _, read in jobs:
        used = {each[1] for each in map(package.match, read) if each} - {"coverage"}
        if rule in ("preprocess", "fit", "describe", "plot", "list", "templates", "detect"):
            assert used == {"numpy"}, rule
        assert rule != "evaluate" or "pandas" in used


# What a further call does.


def test_a_recording_that_is_away_while_the_list_is_made_is_in_the_list(project):
    # The list must be what its key says: no later run would make it again.
    notes = (project.folder / ".snakemake/metadata").iterdir()
    jobs = [json.loads(path.read_text(encoding="utf-8")) for path in notes]
    (call,) = {job["shellcmd"] for job in jobs if job["rule"] == "list"}
    before = project.table("recordings.csv")
    (project.raw / "2.5mm/r01.csv").unlink()
    (project.results / "recordings.csv").unlink()
    output_of("sh", "-c", call, cwd=project.folder)
    assert project.table("recordings.csv") == before


def test_the_reason_shows_a_setting_a_recording_and_a_script_before_and_now(project):
    project.configure(fit={"seed": 2})
    project.append("workflow/scripts/capsule/method/particle.py", "\n# an edit\n")
    other = format_recording(make_recording(3.0, "3mm/other"))
    (project.raw / "2.5mm/r01.csv").write_bytes(other)
    run = project.snakemake("--dry-run")
    single = ("list", "list_labelled", "templates", "evaluate", "detect", "draw", "report")
    expected = dict.fromkeys(single, 1) | {"preprocess": 1, "fit": 3, "describe": 1, "plot": 1}
    assert run.jobs == expected
    reasons = dict(re.findall(r"^Job \d+: (.+)\nReason: (.+)", run.output, re.MULTILINE))
    before, now = reasons["fit 1mm/r01"].split(" now: ")
    assert '"seed": 1' in before and '"seed": 2' in now
    assert "'fit.py " in before and "'fit.py " in now
    for told in reasons["preprocess 2.5mm/r01"].split(" now: "):
        assert "raw/2.5mm/r01.csv=" in told


def test_a_fresh_checkout_with_new_dates_makes_nothing_again(finished, tmp_path):
    checkout = finished.copy(tmp_path / "checkout", keep_times=False)
    os.utime(checkout.raw / "1mm/r01.csv", (4e9, 4e9))
    assert checkout.snakemake().did_nothing


# What is refused.


def test_a_mistake_in_the_configuration_is_told_before_anything_runs(new):
    (new.folder / "mine.yaml").write_text("fit: {particles: many}\n", encoding="utf-8")
    run = new.snakemake("--configfile", "mine.yaml", "--config", "on_rejected=stop")
    assert run.status != 0
    source = "--config or --configfile"
    assert f"{source}: on_rejected: 'stop' is not allowed; must be one of report, f" in run.output
    assert f"{source}: fit.particles: 'many' is not allowed" in run.output
    assert "Traceback" not in run.output
    assert not new.results.exists()


@pytest.mark.slow
@pytest.mark.takes(40)
def test_an_archive_without_a_healthy_recording_has_its_report(new):
    """One nodule gives verdicts and a page, and the page claims no rate that needs others."""
    for name in set(recordings_of(new)) - {"1mm/r01", "unlabelled/patient"}:
        (new.raw / f"{name}.csv").unlink()
    shutil.rmtree(new.folder / "sessions")
    run = new.snakemake()
    assert run.status == 0, run.output
    said = new.table("detections.csv")
    assert [row["detector"] for row in said] == list(DETECTORS)
    page = (new.results / "report.html").read_text(encoding="utf-8")
    assert "No healthy recording, so no false alarm can occur." in page


@pytest.mark.slow
def test_snakemakes_own_report_is_made_on_request_and_figures_for_print_are_planned(project):
    # Snakemake's own use of docutils warns.
    run = project.snakemake("--report", "own.zip", environment={"PYTHONWARNINGS": ""})
    assert run.status == 0, run.output
    shown = {Path(name).name for name in zipfile.ZipFile(project.folder / "own.zip").namelist()}
    assert {"report.html", "detections.csv", *(f"{name}.svg" for name in FIGURES)} <= shown
    assert project.snakemake("figures", "-n").jobs == {"figures": 1}
