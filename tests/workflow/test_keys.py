"""A job runs again exactly if its code, its settings or its inputs have changed."""

import os
import re
import shutil

import pytest

from capsule.recordings.recording import format_recording
from support.plain_figures import draw_plain_figures
from support.project import Project
from support.surveys import write_session
from support.synthetic import make_recording, write_archive

pytestmark = pytest.mark.workflow

SAMPLES = 400
RECORDINGS = ["0mm/r01", "1mm/r01", "3mm/r01", "3mm/r02", "unlabelled/patient"]
FOLDERS = 4
DRAWN = {"describe": FOLDERS, "plot": FOLDERS}
EACH = {"preprocess": len(RECORDINGS), "fit": 3, **DRAWN}
LISTS = ("list", "list_labelled")
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
# The rules behind `evaluate`, and behind `templates`, each with a single job.
RATED = ("evaluate", "detect", "draw", "report")
LEARNED = ("templates", *RATED)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """Return a project after one run; tests copy it and do not change it."""
    folder = tmp_path_factory.mktemp("finished") / "project"
    project = Project.create(folder, RECORDINGS, samples=SAMPLES, particles=10, iterations=10)
    write_session(folder / "sessions/first")
    draw_plain_figures(folder)
    run = project.snakemake()
    assert run.status == 0, run.output
    return project


@pytest.fixture
def project(finished, tmp_path):
    return finished.copy(tmp_path / "project")


def planned(project, *targets):
    """Return the number of jobs of each rule that a run would start."""
    run = project.snakemake("--dry-run", *targets)
    assert run.status == 0, run.output
    return run.jobs


def once(*rules, **others):
    """Return the number of jobs of each rule, one of those that are only named."""
    return dict.fromkeys(rules, 1) | others


def other_recording():
    """Return another recording of a nodule."""
    return format_recording(make_recording(3.0, "3mm/other", samples=SAMPLES))


def fail(project, script):
    """Let a script fail, and return its path and its code before."""
    path = project.folder / f"workflow/scripts/{script}"
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"def main() -> None:\n", b"def main() -> None:\n    1 / 0\n"))
    return path, whole


# What has changed.


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("scripts/capsule/method/preprocessing.py", once(*LISTS, *LEARNED, **EACH)),
        ("scripts/capsule/recordings/listing.py", once(*LISTS, *LEARNED)),
        ("scripts/capsule/method/particle.py", once(*LEARNED, fit=3)),
        ("scripts/capsule/method/templates.py", once(*LEARNED)),
        ("scripts/capsule/detectors/search.py", once(*RATED, **DRAWN)),
        ("scripts/capsule/detectors/diagonal.py", once(*RATED)),
        ("scripts/capsule/detectors/calibrate.py", once(*RATED)),
        ("scripts/capsule/evaluation/rates.py", once(*RATED)),
        ("scripts/capsule/evaluation/intervals.py", once(*RATED)),
        ("scripts/detect.py", once("detect", "report")),
        ("scripts/capsule/figures/draw_rates.py", once("draw", "report")),
        ("scripts/capsule/parts/drawings.py", once("draw", "report")),
        ("scripts/capsule/page/plot_data.py", once("report", plot=FOLDERS)),
        ("scripts/capsule/page/overview.py", once("report")),
        ("report/report.css", once("report")),
        ("report/scripts/charts.js", once("report")),
        ("report/sections/answer.html.j2", once("report")),
        ("weights/scorer.npz", once(*RATED, **DRAWN)),
    ],
)
def test_an_edit_of_the_code_makes_again_exactly_what_it_touches(project, file, expected):
    # No file has to be right for a dry run.
    project.append(f"workflow/{file}", "\n# an edit\n")
    assert planned(project) == expected


def test_what_an_edit_has_made_again_is_not_made_a_third_time(project):
    project.append("workflow/scripts/capsule/method/particle.py", "\n# an edit\n")
    assert project.snakemake(*TABLES).jobs == once("templates", "evaluate", "detect", fit=3)
    assert project.snakemake(*TABLES).did_nothing


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"fit": {"seed": 2}}, once(*LEARNED, fit=3)),
        ({"evaluation": {"tolerance_mm": 2.0}}, once(*RATED)),
        ({"report": {"lead": "template"}}, once("draw", "report")),
        ({"report": {"reliable_rate": 0.9}}, once("report")),
        ({"on_rejected": "fail"}, once(*LISTS, *LEARNED)),
    ],
    ids=str,
)
def test_a_changed_setting_makes_again_only_what_uses_it(project, changes, expected):
    project.configure(**changes)
    assert planned(project) == expected


def test_an_unlabelled_recording_more_is_judged_and_teaches_nothing(project):
    write_archive(project.raw, ["unlabelled/other"], samples=SAMPLES)
    assert planned(project) == once("preprocess", "list", "describe", "plot", "detect", "report")


def test_a_recording_that_is_edited_with_an_old_date_is_made_again(project, finished):
    recording = project.raw / "3mm/r02.csv"
    recording.write_bytes(other_recording())
    os.utime(recording, (1e9, 1e9))
    assert planned(project) == once(*LISTS, *LEARNED, "preprocess", "fit", "describe", "plot")
    run = project.snakemake(*TABLES)
    expected = once(*LISTS, "templates", "evaluate", "detect")
    assert run.jobs == expected | once("preprocess", "fit", "describe")
    fit = "fits/3mm/r02.json"
    assert project.result_bytes()[fit] != finished.result_bytes()[fit]
    assert project.snakemake(*TABLES).did_nothing


# What has not changed.


@pytest.mark.parametrize("between", [False, True], ids=["at once", "after a dry run"])
def test_an_edit_that_is_undone_makes_nothing_again(project, between):
    edited = [
        project.folder / "config/config.yaml",
        project.folder / "workflow/scripts/capsule/method/particle.py",
        project.raw / "3mm/r02.csv",
    ]
    for path in edited:
        whole = path.read_bytes()
        path.write_bytes(whole.replace(b"seed: 1", b"seed: 2") + b"\n")
        if between:
            assert planned(project)["fit"]
        path.write_bytes(whole)
    assert project.snakemake().did_nothing


def test_after_an_edit_that_failed_and_is_undone_only_the_lost_result_is_made_again(project):
    path, whole = fail(project, "detect.py")
    assert project.snakemake(*TABLES).status != 0
    path.write_bytes(whole)
    assert project.snakemake(*TABLES).jobs == {"detect": 1}
    assert project.snakemake(*TABLES).did_nothing


def test_dates_alone_make_nothing_again(project):
    ahead = project.raw / "3mm/r01.csv"
    os.utime(ahead, (4e9, 4e9))
    os.utime(project.raw / "3mm/r02.csv", (1e9, 1e9))
    assert project.snakemake().did_nothing


def test_after_a_clock_was_set_back_a_run_with_work_ends_well(project):
    for path in (*project.results.rglob("*.*"), project.folder / "workflow/scripts/fit.py"):
        os.utime(path, (4e9, 4e9))
    (project.raw / "3mm/r02.csv").write_bytes(other_recording())
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 1
    assert project.snakemake(*TABLES).did_nothing


# What has gone wrong.


def test_after_a_failed_job_the_next_call_makes_it_and_all_behind_it(project, finished):
    (project.raw / "3mm/r02.csv").write_bytes(other_recording())
    path, whole = fail(project, "evaluate.py")
    failed = project.snakemake("results/detections.csv")
    assert failed.status != 0
    assert failed.jobs["evaluate"] and not failed.jobs["detect"]
    path.write_bytes(whole)
    run = project.snakemake("results/detections.csv")
    assert run.jobs == once("evaluate", "detect"), run.output
    assert project.snakemake("results/detections.csv").did_nothing
    before, after = finished.result_bytes(), project.result_bytes()
    assert after["detections.csv"] != before["detections.csv"]


@pytest.mark.parametrize("lost", [".snakemake", ".snakemake/metadata"])
def test_without_snakemakes_notes_a_run_says_what_to_do(project, lost):
    shutil.rmtree(project.folder / lost)
    run = project.snakemake()
    assert run.status != 0
    told = [line for line in run.output.splitlines() if line.startswith("Snakemake's notes")]
    assert told == [
        "Snakemake's notes on results/, in .snakemake/metadata/, are gone, so nobody knows whether "
        "these results fit the recordings; remove results/ and run again"
    ]
    assert "Traceback" not in run.output
    shutil.rmtree(project.results)
    assert planned(project)["preprocess"] == len(RECORDINGS)


def test_a_recording_that_is_away_while_the_list_is_made_is_in_the_list(project):
    # The list must be what its key says: no later run would make it again.
    script, away = project.folder / "workflow/scripts/list.py", project.folder / "away.csv"
    recording = project.raw / "3mm/r02.csv"
    move = f"    import atexit\n    Path({str(recording)!r}).rename({str(away)!r})\n"
    move += f"    atexit.register(Path({str(away)!r}).rename, {str(recording)!r})\n"
    whole = script.read_text(encoding="utf-8")
    before = (
        '    """Write the list of the recordings; with on_rejected: fail, stop at a rejection."""\n'
    )
    assert before in whole
    script.write_text(whole.replace(before, before + move), encoding="utf-8")
    run = project.snakemake("results/recordings.csv")
    assert (run.status, run.jobs) == (0, once("list")), run.output
    assert recording.exists()
    assert "3mm/r02" in {row["recording"] for row in project.table("recordings.csv")}


# Results, and a rule that reads each.
READ_BY = {
    "signals/3mm/r01.npy": "fit",
    "matrices/3mm/r01.npy": "fit",
    "checks/3mm/r01.json": "list",
    "fits/3mm/r01.json": "templates",
    "features/3mm/batch.npz": "evaluate",
    "plot_data/3mm/batch.json": "report",
}


@pytest.mark.parametrize("name", READ_BY)
def test_a_damaged_result_is_named_by_the_job_that_reads_it(project, finished, name):
    path = project.results / name
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    run = project.snakemake("--forcerun", READ_BY[name], "--until", READ_BY[name])
    assert run.status != 0
    assert f"results/{name} is damaged" in run.output
    assert "delete it, and make it again: snakemake -c2" in run.output
    assert "Traceback" not in run.output
    path.unlink()
    assert project.snakemake(f"results/{name}").status == 0
    assert path.read_bytes() == (finished.results / name).read_bytes()


# In each row, no result is made from another, so that nothing but its own absence tells of one.
DELETED = [
    ["signals/3mm/r01.npy", "matrices/1mm/r01.npy", "checks/3mm/r02.json"],
    ["fits/3mm/r01.json", "features/3mm/batch.npz", "plot_data/1mm/batch.json", "passed_over.csv"],
    ["labelled.csv", "surveys/first/survey.json"],
    ["templates.npz"],
    ["evaluation/roc.csv"],
    ["detectors.json"],
    ["sites.csv", "figures/roc.svg"],
]


def test_the_plain_command_would_make_each_deleted_result_again(project):
    for names in DELETED:
        aside = {project.results / name: project.folder / name.replace("/", "-") for name in names}
        for path, kept in aside.items():
            path.rename(kept)
        said = project.snakemake("--dry-run").output
        for name in names:
            assert f"Missing output files: results/{name}" in said
        for path, kept in aside.items():
            kept.rename(path)
    assert project.snakemake().did_nothing


def test_the_plain_command_makes_what_was_deleted_again(project, finished):
    deleted = ["signals/unlabelled/patient.npy", "plot_data/unlabelled/batch.json", "sites.csv"]
    for name in deleted:
        (project.results / name).unlink()
    page = project.results / "report.html"
    made_ns = page.stat().st_mtime_ns
    run = project.snakemake()
    made = once("preprocess", "list", "describe", "plot", "detect", "report")
    assert run.jobs == made, run.output
    assert page.stat().st_mtime_ns > made_ns
    before, after = finished.result_bytes(), project.result_bytes()
    # The page tells the minute in which it was made; all else is the same.
    for results in (before, after):
        date = rb"[0-9]{4}-[0-9]{2}-[0-9]{2} [0-9]{2}:[0-9]{2} UTC"
        results["report.html"], dates = re.subn(date, b"", results["report.html"])
        assert dates == 1
    assert [name for name in before if after[name] != before[name]] == []
    assert project.snakemake().did_nothing


# What Snakemake says.


def reasons(project):
    """Return the reason that a dry run gives for each job, by its message."""
    output = project.snakemake("--dry-run").output
    return dict(re.findall(r"^Job \d+: (.+)\nReason: (.+)", output, re.MULTILINE))


def test_the_reason_shows_a_changed_setting_before_and_now(project):
    project.configure(fit={"seed": 2})
    before, now = reasons(project)["fit 3mm/r01"].split(" now: ")
    assert '"seed": 1' in before
    assert '"seed": 2' in now


def test_the_reason_names_the_changed_recording(project):
    (project.raw / "3mm/r01.csv").write_bytes(other_recording())
    before, now = reasons(project)["preprocess 3mm/r01"].split(" now: ")
    assert "raw/3mm/r01.csv=" in before
    assert "raw/3mm/r01.csv=" in now


def test_the_reason_names_the_script_whose_code_has_changed(project):
    project.append("workflow/scripts/capsule/method/particle.py", "\n# an edit\n")
    assert "'fit.py " in reasons(project)["fit 3mm/r01"]


# The chain of keys.


def behind(rule, edges):
    """Return all rules that depend on a rule, directly or not."""
    after = {second for first, second in edges if first == rule}
    return after.union(*(behind(each, edges) for each in after))


def test_the_keys_follow_every_edge_of_the_graph_of_rules(project):
    graph = project.snakemake("--rulegraph").output
    names = dict(re.findall(r'(\d+)\[label = "(\w+)"', graph))
    edges = [(names[one], names[other]) for one, other in re.findall(r"(\d+) -> (\d+)", graph)]
    summary = project.snakemake("--summary").output
    made_by = dict(re.findall(r"^(results/\S+)\t[^\t]+\t(\w+)\t", summary, re.MULTILINE))
    rules = set(names.values()) - {"everything"}
    assert set(made_by.values()) == rules
    assert len(rules) == 12
    for rule in rules:
        name = {"survey": "chart_survey", "list_labelled": "list"}.get(rule, rule)
        script = project.folder / f"workflow/scripts/{name}.py"
        whole = script.read_bytes()
        script.write_bytes(whole + b"# an edit\n")
        # This lists the results whose own key has changed, and not what depends on them.
        listed = project.snakemake("--list-changes", "params").output.splitlines()
        changed = {made_by[line] for line in listed if line in made_by}
        edited = {"list", "list_labelled"} if name == "list" else {rule}
        expected = edited.union(*(behind(each, edges) for each in edited)) - {"everything"}
        assert changed == expected, rule
        script.write_bytes(whole)
