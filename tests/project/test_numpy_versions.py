"""The method and the check of a recording pass their tests with the oldest numpy that is allowed.

Run it alone: pytest tests/project/test_numpy_versions.py (a download of 20 MB, then some seconds).
"""

import os
import re
import subprocess
import sys
import tomllib

import pytest
from packaging.requirements import Requirement

from support.project import ROOT

# The first numpy that was built for a Python, where the project's oldest came before it.
FIRST_FOR_PYTHON = {(3, 13): "2.1.0", (3, 14): "2.3.2"}


def oldest_numpy():
    """Return the lower bound in pyproject.toml, or the nearest version for this Python."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (numpy,) = (r for r in map(Requirement, project["dependencies"]) if r.name == "numpy")
    (bound,) = (s.version for s in numpy.specifier if s.operator == ">=")
    complete = bound + ".0" * (2 - bound.count("."))
    return FIRST_FOR_PYTHON.get(sys.version_info[:2], complete)


@pytest.mark.packages
def test_the_oldest_numpy_gives_the_numbers_of_the_literal_formulas(tmp_path):
    oldest = oldest_numpy()
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--only-binary", ":all:", "--no-deps", "--target", str(tmp_path)]
    subprocess.run([*command, f"numpy=={oldest}"], check=True)
    program = "import numpy, pytest; print(numpy.__version__); pytest.main()"
    tests = ["tests/capsule/method", "tests/capsule/recordings/test_acceptance.py"]
    done = subprocess.run(
        [sys.executable, "-c", program, "-q", "-n0", "-p", "no:cacheprovider", *tests],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.startswith(f"{oldest}\n")
    assert re.search(r"^\d{3,} passed in", done.stdout, re.MULTILINE), done.stdout
