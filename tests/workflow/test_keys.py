"""A job runs again exactly if its code, its settings or its inputs have changed."""

import json
import os
import re

import pytest

from capsule.recordings.recording import format_recording
from support.project import Project
from support.surveys import write_session
from support.synthetic import make_recording, write_archive

pytestmark = pytest.mark.workflow

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]
# At the end of the Snakefile: tells what each rule has, and whose keys change with the code of one
# or with the content of a recording or a survey.
TELL = """
import json
BATCHES_OF = {"preprocess": BATCHES, "fit": NODULES, "describe": DESCRIBED, "plot": DESCRIBED}
BATCHES_OF["survey"] = SURVEYS.names
STEPS = {name.lower(): each for name, each in globals().items() if isinstance(each, Step)}
def all_keys():
    Step.key.cache_clear()
    return {name: [*map(each.key, BATCHES_OF.get(name, [""]))] for name, each in STEPS.items()}
before = all_keys()
def changed_with(step, part, value):
    kept = getattr(step, part)
    object.__setattr__(step, part, value)
    changed = [name for name, keys in all_keys().items() if keys != before[name]]
    object.__setattr__(step, part, kept)
    return changed
def contents_but(edited):
    return lambda batch: ["edited"] if batch == edited else contents_of(batch)
told = {name: {"changed": changed_with(each, "code", "edited")} for name, each in STEPS.items()}
for name, each in STEPS.items():
    code = STATES_OF_CODE[str(each.script.resolve())]
    told[name]["uses"] = [*json.loads(each.settings), *code]
of_recordings = {
    name: changed_with(PREPROCESS, "inputs", contents_but(name)) for name in ARCHIVE.recordings
}
CONTENT_OF_SURVEY = dict.fromkeys(CONTENT_OF_SURVEY, "edited")
of_recordings["sessions/first"] = changed_with(SURVEY, "name", SURVEY.name)
Path("told.json").write_text(json.dumps([told, of_recordings]))
"""

EVERY = {"preprocess", "list", "list_labelled", "fit", "describe", "plot", "templates", "survey"}
EVERY |= {"evaluate", "detect", "draw", "report"}
# Another recording of a nodule.
OTHER = format_recording(make_recording(3.0, "3mm/other"))


# What the key of a rule covers.


@pytest.fixture(scope="module")
def rules(tmp_path_factory):
    """Return the edges of the graph of rules, what each has, and what a recording changes."""
    folder = tmp_path_factory.mktemp("told") / "project"
    project = Project.create(folder, ["0mm/r01", "1mm/r01", "1mm/r02", "unlabelled/p"])
    write_session(folder / "sessions/first")
    project.append("Snakefile", TELL)
    run = project.snakemake("--rulegraph")
    assert run.status == 0, run.output
    names = dict(re.findall(r'(\d+)\[label = "(\w+)"', run.output))
    found = re.findall(r"(\d+) -> (\d+)", run.output)
    told, of_recordings = json.loads((folder / "told.json").read_text(encoding="utf-8"))
    for each in told.values():
        each["uses"] = {re.split("/workflow/(?:scripts/)?", used)[-1] for used in each["uses"]}
    return {(names[one], names[other]) for one, other in found}, told, of_recordings


def behind(rule, edges):
    """Return all rules that depend on a rule, directly or not."""
    after = {second for first, second in edges if first == rule}
    return after.union(*(behind(each, edges) for each in after))


def test_the_keys_follow_every_edge_of_the_graph_of_rules(rules):
    edges, told, _ = rules
    assert len(told) == 12
    for rule, each in told.items():
        assert set(each["changed"]) == {rule, *behind(rule, edges) - {"everything"}}, rule
    # What is missing is made again by the plain command.
    assert {first for first, second in edges if second == "everything"} == told.keys()


@pytest.mark.parametrize(
    ("recording", "others"),
    [
        ("0mm/r01", {"survey", "fit"}),
        ("1mm/r01", {"survey"}),
        ("unlabelled/p", {"survey", "fit", "list_labelled", "templates", "evaluate", "draw"}),
        ("sessions/first", EVERY - {"survey", "report"}),
    ],
)
def test_a_recording_or_survey_changes_the_keys_of_all_that_rests_on_it_and_no_others(
    rules, recording, others
):
    assert set(rules[2][recording]) == EVERY - others


@pytest.mark.parametrize(
    ("part", "of"),
    [
        ("fit", {"fit", "evaluate", "detect", "report"}),
        ("on_rejected", {"list", "list_labelled", "report"}),
        ("recordings_per_job", set()),
        ("capsule/store/files.py", EVERY),
        ("capsule/recordings/listing.py", {"list", "list_labelled"}),
        ("capsule/method/templates.py", {"templates", "evaluate", "detect", "draw", "report"}),
        ("capsule/detectors/shipped.py", {"evaluate", "detect", "report"}),
        ("capsule/figures/draw_rates.py", {"draw", "report"}),
        ("capsule/page/plot_data.py", {"plot"}),
        ("report/report.css", {"report"}),
        ("weights/scorer.npz", {"describe", "plot", "detect"}),
    ],
)
def test_a_rule_has_the_settings_and_the_code_that_it_uses_and_no_others(rules, part, of):
    assert {rule for rule, each in rules[1].items() if part in each["uses"]} == of


# What has changed.


@pytest.mark.slow
def test_recordings_that_come_change_and_go_cost_their_own_jobs(project, finished):
    """The story of an edit: another content with an old date, one more, and both taken back."""
    # The clock was set back since the results were made.
    for path in (*project.results.rglob("*.*"), project.folder / "workflow/scripts/fit.py"):
        os.utime(path, (4e9, 4e9))
    edited = project.raw / "2.5mm/r01.csv"
    whole = edited.read_bytes()
    edited.write_bytes(OTHER)
    os.utime(edited, (1e9, 1e9))
    write_archive(project.raw, ["1mm/r03", "unlabelled/other"])
    single = dict.fromkeys(("list", "list_labelled", "templates", "evaluate", "detect"), 1)
    run = project.snakemake(*TABLES)
    assert run.jobs == single | {"preprocess": 3, "fit": 2, "describe": 3}, run.output
    before, changed = finished.result_bytes(), project.result_bytes()
    assert changed["fits/2.5mm/r01.json"] != before["fits/2.5mm/r01.json"]

    edited.write_bytes(whole)
    for name in ("1mm/r03", "unlabelled/other"):
        (project.raw / f"{name}.csv").unlink()
    run = project.snakemake(*TABLES)
    assert run.jobs == single | {"preprocess": 1, "fit": 1, "describe": 3}, run.output
    assert "files are of recordings, batches or tables that are gone" in run.output
    after = project.result_bytes()
    assert (project.results / "fits/1mm/r03.json").exists()
    assert [name for name in before if after[name] != before[name]] == []


# What has gone wrong.


@pytest.mark.slow
def test_after_a_failed_job_the_next_call_makes_it_and_all_behind_it(project):
    (project.raw / "2.5mm/r01.csv").write_bytes(OTHER)
    path = project.folder / "workflow/scripts/evaluate.py"
    whole = path.read_bytes()
    path.write_bytes(whole.replace(b"def main() -> None:\n", b"def main() -> None:\n    1 / 0\n"))
    failed = project.snakemake("results/detections.csv")
    assert failed.status != 0
    assert failed.jobs["evaluate"] and not failed.jobs["detect"]
    page = (project.results / "report.html").read_text(encoding="utf-8")
    assert '<p class="outdated" role="alert">This report is out of date' in page
    path.write_bytes(whole)
    run = project.snakemake("results/detections.csv")
    assert run.jobs == {"evaluate": 1, "detect": 1}, run.output
