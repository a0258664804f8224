"""A job for one recording imports only numpy and the library, since imports take its time."""

import hashlib
import json
import re
import subprocess
import sys

import pytest
import yaml

from support.project import ROOT

pytestmark = pytest.mark.takes(0.4)

SCRIPTS = ROOT / "workflow" / "scripts"


def job_commands(recording, folder):
    """Return the commands of the recording's jobs; they write to the folder."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
    name = f"{recording.parent.name}/{recording.stem}"
    checksum = hashlib.sha256(recording.read_bytes()).hexdigest()
    written = ("signal.npy", "matrix.npy", "check.json", "fit.json")
    signal, matrix, check, fit = (str(folder / file) for file in written)
    common = ["--batch", name, "--settings", json.dumps(config)]
    common += ["--signals", signal, "--matrices", matrix]
    told = ["--contents", f"{recording}={checksum}", "--checks", check]
    return {
        "preprocess": [str(SCRIPTS / "preprocess.py"), name, *common, *told],
        "fit": [str(SCRIPTS / "fit.py"), name, *common, "--output", fit],
    }


def loaded_modules(*command):
    """Run Python, and return all modules that it loads."""
    ended = subprocess.run(
        [sys.executable, "-X", "importtime", *command], capture_output=True, text=True, check=True
    )
    return set(re.findall(r"^import time: .*\| *(\S+)$", ended.stderr, re.MULTILINE))


def packages(modules):
    """Return the packages among modules that belong neither to Python nor to the project."""
    project = {path.stem for path in SCRIPTS.iterdir()}
    return {name.partition(".")[0] for name in modules} - set(sys.stdlib_module_names) - project


@pytest.fixture(scope="module")
def with_numpy_alone():
    """Return the packages that numpy loads, or that this installation loads at every start."""
    return loaded_modules("-c", "import numpy, numpy.fft, numpy.linalg, numpy.random")


def test_jobs_of_one_recording_load_numpy_alone(tmp_path, with_numpy_alone):
    for name, command in job_commands(ROOT / "raw/3mm/r07.csv", tmp_path).items():
        modules = loaded_modules(*command)
        assert {"numpy", "capsule.store.files", "capsule.recordings.names"} <= modules
        assert packages(modules) <= packages(with_numpy_alone), name
        assert not {"pandas", "matplotlib", "scipy"} & modules, name


@pytest.mark.parametrize("script", ["list.py", "templates.py", "describe.py", "detect.py"])
def test_jobs_of_an_archive_that_need_no_table_load_numpy_at_most(script, with_numpy_alone):
    modules = loaded_modules(str(SCRIPTS / script), "--help")
    assert "capsule.store.files" in modules
    assert packages(modules) <= packages(with_numpy_alone)
