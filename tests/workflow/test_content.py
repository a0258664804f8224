"""A changed file makes its results again, whatever its time stamp."""

import os

import pytest

from capsule.recordings.recording import format_recording
from support.project import Project
from support.synthetic import make_recording

pytestmark = [pytest.mark.slow, pytest.mark.workflow]

TABLES = ["results/evaluation/detection.csv", "results/detections.csv"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished") / "project"
    names = ["0mm/r01", "1mm/r01", "3mm/r01", "3mm/r02"]
    project = Project.create(folder, names, samples=400, particles=10, iterations=10)
    run = project.snakemake(*TABLES)
    assert run.status == 0, run.output
    return project


@pytest.fixture
def project(finished, tmp_path):
    return finished.copy(tmp_path / "project")


def write_as_old(path, content):
    """Replace a file's content, and keep its time stamp."""
    times = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))


def test_two_recordings_whose_names_are_swapped_are_made_again(project):
    one, other, aside = (project.raw / name for name in ("1mm/r01.csv", "3mm/r01.csv", "aside"))
    one.rename(aside)
    other.rename(one)
    aside.rename(other)
    before = project.result_bytes()
    run = project.snakemake(*TABLES)
    assert run.jobs == {
        **dict.fromkeys(("preprocess", "fit", "describe"), 2),
        **dict.fromkeys(("list", "list_labelled", "templates", "evaluate", "detect"), 1),
    }
    after = project.result_bytes()
    assert after["matrices/1mm/r01.npy"] == before["matrices/3mm/r01.npy"]
    assert after["matrices/3mm/r01.npy"] == before["matrices/1mm/r01.npy"]
    assert after["templates.json"] != before["templates.json"]


def test_a_corrected_recording_with_an_old_time_stamp_is_made_again(project):
    corrected = format_recording(make_recording(3.0, "3mm/corrected", samples=400))
    write_as_old(project.raw / "3mm/r02.csv", corrected)
    run = project.snakemake(*TABLES)
    assert (run.jobs["preprocess"], run.jobs["fit"]) == (1, 1)
    assert project.snakemake(*TABLES).did_nothing


def test_another_version_of_the_code_with_old_time_stamps_makes_again_what_it_touches(project):
    module = project.folder / "workflow/scripts/capsule/method/templates.py"
    write_as_old(module, module.read_bytes() + b"\n# another version\n")
    run = project.snakemake(*TABLES)
    assert run.jobs == {"templates": 1, "evaluate": 1, "detect": 1}
    assert project.snakemake(*TABLES).did_nothing
