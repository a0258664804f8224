"""Marks of tests that need something which not every system has."""

import sys

import pytest

needs_forks = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")
needs_process_groups = pytest.mark.skipif(
    sys.platform == "win32", reason="Windows has no process groups to kill"
)
