"""The oldest numpy that the project allows gives the same numbers as the installed one.

Run it alone: pytest tests/project/test_numpy_versions.py (a download of 20 MB, then some seconds).
"""

import json
import os
import subprocess
import sys
import tomllib

import numpy as np
import pytest
import yaml
from packaging.requirements import Requirement

from support.project import ROOT

pytestmark = pytest.mark.slow

CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
# The first numpy that was built for a Python, where the project's oldest came before it.
FIRST_FOR_PYTHON = {(3, 13): "2.1.0", (3, 14): "2.3.2"}


def oldest_numpy():
    """Return the lower bound in pyproject.toml, or the nearest version for this Python."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (numpy,) = (r for r in map(Requirement, project["dependencies"]) if r.name == "numpy")
    (bound,) = (s.version for s in numpy.specifier if s.operator == ">=")
    complete = bound + ".0" * (2 - bound.count("."))
    return FIRST_FOR_PYTHON.get(sys.version_info[:2], complete)


def compute(target, *path):
    """Return the results with the numpy in a folder; warnings are errors."""
    search = os.pathsep.join([*map(str, path), str(ROOT / "workflow/scripts")])
    command = [sys.executable, "-W", "error", str(ROOT / "tests/project/numpy_results.py")]
    subprocess.run(
        [*command, str(target), json.dumps(CONFIG)],
        env={**os.environ, "PYTHONPATH": search},
        check=True,
    )
    with np.load(target) as stored:
        return dict(stored)


@pytest.mark.packages
def test_the_oldest_and_the_installed_numpy_give_the_same_numbers(tmp_path):
    oldest = oldest_numpy()
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--only-binary", ":all:", "--no-deps", "--target", str(tmp_path / "packages")]
    subprocess.run([*command, f"numpy=={oldest}"], check=True)
    old = compute(tmp_path / "old.npz", tmp_path / "packages")
    new = compute(tmp_path / "new.npz")
    assert str(old.pop("version")) == oldest
    assert str(new.pop("version")) == np.__version__ != oldest
    assert set(old) == set(new)
    for name, values in new.items():
        np.testing.assert_allclose(old[name], values, rtol=0, atol=1e-9, err_msg=name)
