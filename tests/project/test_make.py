"""make prepares the environment before the tools start."""

import os
import shutil
import subprocess
import sys

import pytest

from support.command import output_of
from support.marks import needs_programs
from support.project import ROOT

pytestmark = needs_programs("make", packages="make")


def write_program(path, line):
    path.write_text(f"#!/bin/sh\n{line}\n")
    path.chmod(0o755)
    return path


@pytest.fixture
def checkout(tmp_path):
    """Return a folder with the Makefile and an environment whose snakemake prints its cache."""
    folder = tmp_path / "checkout"
    (folder / ".venv" / "bin").mkdir(parents=True)
    shutil.copy2(ROOT / "Makefile", folder)
    for name in ("requirements-pip.lock", "requirements.lock", "pyproject.toml", ".venv/ready"):
        (folder / name).touch()
    write_program(folder / ".venv/bin/snakemake", 'echo "cache: $XDG_CACHE_HOME"')
    write_program(folder / ".venv/bin/python", 'echo "python $*"')
    return folder


def test_caches_lie_in_the_project_where_the_home_cannot_be_written(checkout):
    # A file in its place keeps even the administrator from writing there.
    home = checkout.parent / "home"
    home.touch()
    environment = {key: value for key, value in os.environ.items() if key != "XDG_CACHE_HOME"}
    output = output_of("make", "report", cwd=checkout, env=environment | {"HOME": str(home)})
    assert f"cache: {checkout}/.snakemake/cache\n" in output
    assert "the home folder cannot be written" in output
    # The project is installed so that its own folder is used.
    assert "python -m pip install --quiet --no-deps --no-build-isolation --editable .\n" in output


@pytest.mark.parametrize(("version", "allowed"), [("3.10", False), ("3.11", True), ("3.14", False)])
def test_a_python_that_the_lock_lacks_is_refused_in_one_line(checkout, version, allowed):
    (checkout / ".venv" / "ready").unlink()
    # It says of itself that it is of that version, and makes no environment.
    own = f"import sys; sys.version_info = {tuple(map(int, version.split('.')))}; exec(sys.argv[1])"
    python = write_program(
        checkout / "python",
        f"case $1 in -V) echo Python {version}.0;; -m) exit 7;; "
        f"*) exec {sys.executable} -c '{own}' \"$2\";; esac",
    )
    command = ["make", "report", f"PYTHON={python}"]
    done = subprocess.run(command, cwd=checkout, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    refusal = f"error: this is Python {version}.0, Python 3.11, 3.12 or 3.13 is needed"
    assert (refusal in done.stderr) is not allowed
