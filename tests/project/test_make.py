"""What make does before the tools start."""

import os
import shutil
import subprocess

import pytest

from support.project import ROOT

pytestmark = pytest.mark.skipif(not shutil.which("make"), reason="make is not installed")


@pytest.fixture
def checkout(tmp_path):
    """Make a folder with the Makefile and a ready environment whose snakemake tells its cache."""
    folder = tmp_path / "checkout"
    (folder / ".venv" / "bin").mkdir(parents=True)
    shutil.copy2(ROOT / "Makefile", folder)
    (folder / "requirements.lock").touch()
    (folder / ".venv" / "ready").touch()
    snakemake = folder / ".venv" / "bin" / "snakemake"
    snakemake.write_text('#!/bin/sh\necho "cache: $XDG_CACHE_HOME"\n')
    snakemake.chmod(0o755)
    return folder


def make(folder, home):
    environment = {key: value for key, value in os.environ.items() if key != "XDG_CACHE_HOME"}
    return subprocess.run(
        ["make", "report"],
        cwd=folder,
        env=environment | {"HOME": str(home)},
        capture_output=True,
        text=True,
        check=True,
    ).stdout


def test_where_the_home_cannot_be_written_caches_lie_in_the_project_and_one_line_says_so(checkout):
    # A file in its place keeps even the administrator from writing there.
    home = checkout.parent / "home"
    home.touch()
    output = make(checkout, home)
    assert f"cache: {checkout}/.snakemake/cache\n" in output
    assert output.count("the home folder cannot be written") == 1


def test_a_home_that_can_be_written_is_used(checkout):
    home = checkout.parent / "home"
    home.mkdir()
    output = make(checkout, home)
    assert "cache: \n" in output
    assert "cannot be written" not in output
