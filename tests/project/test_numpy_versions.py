"""The method and the check of a recording pass their tests with the oldest numpy that is allowed.

Run it alone: pytest tests/project/test_numpy_versions.py (a download of 20 MB, then some seconds).
"""

import re
import sys
import tomllib

import pytest
from packaging.requirements import Requirement

from support.command import output_of
from support.environments import environment_with
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
    wanted = ["--only-binary", ":all:", "--no-deps", "--ignore-installed", f"numpy=={oldest}"]
    python = environment_with(tmp_path / "environment", *wanted)
    program = "import numpy, pytest; print(numpy.__version__); pytest.main()"
    tests = ["tests/capsule/method", "tests/capsule/recordings/test_acceptance.py"]
    call = [python, "-c", program, "-q", "-n0", "-p", "no:cacheprovider", *tests]
    told = output_of(*call, cwd=ROOT)
    assert told.startswith(f"{oldest}\n")
    assert re.search(r"^\d{3,} passed in", told, re.MULTILINE), told
