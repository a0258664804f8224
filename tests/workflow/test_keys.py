"""A job runs again exactly if its code, its settings or its inputs have changed."""

import os
import re
import shutil

import pytest

from capsule.detectors.registry import DETECTORS
from capsule.engine.keys import imported_files
from capsule.figures.registry import FIGURES
from capsule.recordings.recording import format_recording
from support.project import ROOT
from support.synthetic import make_recording, write_archive

pytestmark = pytest.mark.workflow

SCRIPTS = ROOT / "workflow/scripts"
TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
LISTS = ("list", "list_labelled")
# The rules behind `evaluate`, and behind `templates`, each with a single job.
RATED = ("evaluate", "detect", "draw", "report")
LEARNED = ("templates", *RATED)
DRAWN = {"describe": 4, "plot": 4}


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
    return format_recording(make_recording(3.0, "3mm/other"))


def fail(project, script):
    """Let a script fail, and return its path and its code before."""
    path = project.folder / f"workflow/scripts/{script}"
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"def main() -> None:\n", b"def main() -> None:\n    1 / 0\n"))
    return path, whole


# What has changed.


DETECTING = {row.module for row in DETECTORS.values()}
DRAWING = {row.module for row in FIGURES.values()}
# What scripts import by a name in a registry.
REGISTERED = {
    "evaluate": DETECTING,
    "detect": DETECTING,
    "draw": DRAWING,
    "report": DETECTING | DRAWING,
}
EVERY = {"preprocess", "list", "fit", "describe", "plot", "templates", *REGISTERED}


@pytest.mark.parametrize(
    ("module", "of"),
    [
        ("store/files", EVERY),
        ("recordings/listing", {"list"}),
        ("method/templates", {"templates", "evaluate", "detect", "draw", "report"}),
        ("detectors/diagonal", {"evaluate", "detect", "report"}),
        ("figures/draw_rates", {"draw", "report"}),
        ("parts/drawings", {"draw", "report"}),
        ("page/plot_data", {"plot", "report"}),
        ("page/overview", {"report"}),
    ],
)
def test_the_code_of_a_step_is_what_its_script_imports(module, of):
    path = SCRIPTS / f"capsule/{module}.py"
    assert path.is_file()
    found = {
        rule
        for rule in EVERY
        if path in imported_files(SCRIPTS / f"{rule}.py", sorted(REGISTERED.get(rule, ())))
    }
    assert found == of


@pytest.mark.parametrize(
    ("file", "expected"),
    [
        ("scripts/capsule/method/particle.py", once(*LEARNED, fit=4)),
        ("report/report.css", once("report")),
        ("weights/scorer.npz", once(*RATED, **DRAWN)),
    ],
)
def test_an_edit_of_the_code_makes_again_exactly_what_it_touches(project, file, expected):
    # No file has to be right for a dry run.
    project.append(f"workflow/{file}", "\n# an edit\n")
    assert planned(project) == expected


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"fit": {"seed": 2}}, once(*LEARNED, fit=4)),
        ({"evaluation": {"tolerance_mm": 2.0}}, once(*RATED)),
        ({"report": {"lead": "template"}}, once("draw", "report")),
        ({"on_rejected": "fail"}, once(*LISTS, *LEARNED)),
    ],
    ids=str,
)
def test_a_changed_setting_makes_again_only_what_uses_it(project, changes, expected):
    project.configure(**changes)
    assert planned(project) == expected


@pytest.mark.slow
def test_recordings_that_come_change_and_go_cost_their_own_jobs(project, finished):
    """The story of an edit: another content with an old date, one more, and both taken back."""
    edited = project.raw / "2.5mm/r02.csv"
    whole = edited.read_bytes()
    edited.write_bytes(other_recording())
    os.utime(edited, (1e9, 1e9))
    write_archive(project.raw, ["1mm/r03", "unlabelled/other"])
    single = once(*LISTS, "templates", "evaluate", "detect")
    assert project.snakemake(*TABLES).jobs == single | {"preprocess": 3, "fit": 2, "describe": 3}
    assert project.snakemake(*TABLES).did_nothing
    before, changed = finished.result_bytes(), project.result_bytes()
    assert changed["fits/2.5mm/r02.json"] != before["fits/2.5mm/r02.json"]
    assert changed["fits/1mm/r01.json"] == before["fits/1mm/r01.json"]

    edited.write_bytes(whole)
    for name in ("1mm/r03", "unlabelled/other"):
        (project.raw / f"{name}.csv").unlink()
    run = project.snakemake(*TABLES)
    assert run.jobs == single | {"preprocess": 1, "fit": 1, "describe": 3}
    assert "files are of recordings or batches that are gone" in run.output
    after = project.result_bytes()
    assert (project.results / "fits/1mm/r03.json").exists()
    assert [name for name in before if after[name] != before[name]] == []


# What has not changed.


def test_an_edit_that_is_undone_makes_nothing_again_nor_do_dates(project):
    edited = [
        project.folder / "config/config.yaml",
        project.folder / "workflow/scripts/capsule/method/particle.py",
        project.raw / "2.5mm/r02.csv",
    ]
    contents = [path.read_bytes() for path in edited]
    for path, whole in zip(edited, contents, strict=True):
        path.write_bytes(whole.replace(b"seed: 1", b"seed: 2") + b"\n")
    assert planned(project)["fit"]
    for path, whole in zip(edited, contents, strict=True):
        path.write_bytes(whole)
    os.utime(project.raw / "1mm/r01.csv", (4e9, 4e9))
    os.utime(project.raw / "1mm/r02.csv", (1e9, 1e9))
    assert project.snakemake().did_nothing


@pytest.mark.slow
def test_after_a_clock_was_set_back_a_run_with_work_ends_well(project):
    for path in (*project.results.rglob("*.*"), project.folder / "workflow/scripts/fit.py"):
        os.utime(path, (4e9, 4e9))
    (project.raw / "2.5mm/r02.csv").write_bytes(other_recording())
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    assert run.jobs["fit"] == 1
    assert project.snakemake(*TABLES).did_nothing


# What has gone wrong.


@pytest.mark.slow
def test_after_a_failed_job_the_next_call_makes_it_and_all_behind_it(project, finished):
    (project.raw / "2.5mm/r02.csv").write_bytes(other_recording())
    path, whole = fail(project, "evaluate.py")
    failed = project.snakemake("results/detections.csv")
    assert failed.status != 0
    assert failed.jobs["evaluate"] and not failed.jobs["detect"]
    page = (project.results / "report.html").read_text(encoding="utf-8")
    assert '<p class="outdated" role="alert">This report is out of date' in page
    path.write_bytes(whole)
    run = project.snakemake("results/detections.csv")
    assert run.jobs == once("evaluate", "detect"), run.output
    assert project.snakemake("results/detections.csv").did_nothing
    before, after = finished.result_bytes(), project.result_bytes()
    assert after["detections.csv"] != before["detections.csv"]


def test_without_snakemakes_notes_a_run_says_what_to_do(project):
    shutil.rmtree(project.folder / ".snakemake/metadata")
    run = project.snakemake()
    assert run.status != 0
    told = [line for line in run.output.splitlines() if line.startswith("Snakemake's notes")]
    assert told == [
        "Snakemake's notes on results/, in .snakemake/metadata/, are gone, so nobody knows whether "
        "these results fit the recordings; remove results/ and run again"
    ]
    assert "Traceback" not in run.output


@pytest.mark.slow
def test_a_recording_that_is_away_while_the_list_is_made_is_in_the_list(project):
    # The list must be what its key says: no later run would make it again.
    script, away = project.folder / "workflow/scripts/list.py", project.folder / "away.csv"
    recording = project.raw / "2.5mm/r02.csv"
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
    assert "2.5mm/r02" in {row["recording"] for row in project.table("recordings.csv")}


# Results, and a rule that reads each: the last rule first, since one that fails loses its results.
READ_BY = {
    "plot_data/1mm/batch.json": "report",
    "features/1mm/batch.npz": "evaluate",
    "fits/1mm/r01.json": "templates",
    "checks/1mm/r01.json": "list",
    "signals/1mm/r01.npy": "fit",
}


@pytest.mark.slow
def test_a_damaged_result_is_named_by_the_job_that_reads_it(project, finished):
    for name, rule in READ_BY.items():
        path = project.results / name
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
        run = project.snakemake("--forcerun", rule, "--until", rule)
        assert run.status != 0
        assert f"results/{name} is damaged" in run.output
        assert "delete it, and make it again: snakemake -c2" in run.output
        assert "Traceback" not in run.output
        path.unlink()
        assert project.snakemake(f"results/{name}").status == 0
        assert path.read_bytes() == (finished.results / name).read_bytes()


@pytest.mark.slow
def test_the_plain_command_makes_what_was_deleted_again(project, finished):
    deleted = ["signals/unlabelled/patient.npy", "plot_data/unlabelled/batch.json", "sites.csv"]
    # Nothing but its own absence tells of each of these.
    deleted += ["surveys/first/survey.json", "evaluation/roc.csv", "figures/roc.svg"]
    for name in deleted:
        (project.results / name).unlink()
    page = project.results / "report.html"
    made_ns = page.stat().st_mtime_ns
    run = project.snakemake()
    made = once("preprocess", "list", "describe", "plot", "survey", *RATED)
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


def test_the_reason_shows_a_setting_a_recording_and_a_script_before_and_now(project):
    project.configure(fit={"seed": 2})
    project.append("workflow/scripts/capsule/method/particle.py", "\n# an edit\n")
    (project.raw / "2.5mm/r01.csv").write_bytes(other_recording())
    output = project.snakemake("--dry-run").output
    reasons = dict(re.findall(r"^Job \d+: (.+)\nReason: (.+)", output, re.MULTILINE))
    before, now = reasons["fit 1mm/r01"].split(" now: ")
    assert '"seed": 1' in before and '"seed": 2' in now
    assert "'fit.py " in before and "'fit.py " in now
    for told in reasons["preprocess 2.5mm/r01"].split(" now: "):
        assert "raw/2.5mm/r01.csv=" in told


# The chain of keys.


def behind(rule, edges):
    """Return all rules that depend on a rule, directly or not."""
    after = {second for first, second in edges if first == rule}
    return after.union(*(behind(each, edges) for each in after))


@pytest.mark.slow
@pytest.mark.takes(30)
def test_the_keys_follow_every_edge_of_the_graph_of_rules(project):
    graph = project.snakemake("--rulegraph").output
    names = dict(re.findall(r'(\d+)\[label = "(\w+)"', graph))
    edges = [(names[one], names[other]) for one, other in re.findall(r"(\d+) -> (\d+)", graph)]
    summary = project.snakemake("--summary").output
    made_by = dict(re.findall(r"^(results/\S+)\t[^\t]+\t(\w+)\t", summary, re.MULTILINE))
    rules = set(names.values()) - {"everything"}
    assert set(made_by.values()) == rules
    assert len(rules) == 12
    for rule in rules - {"list_labelled"}:
        name = {"survey": "chart_survey"}.get(rule, rule)
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
