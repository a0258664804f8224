"""Marks of tests that need something which not every system has."""

import os
import shutil
import sys

import pytest

needs_forks = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")
needs_terminals = pytest.mark.skipif(
    not hasattr(os, "openpty"), reason="this system has no pseudo-terminals"
)


def missing_program(*programs: str, packages: str) -> str:
    """Return a message that names a program that is not installed; empty if all are."""
    for program in programs:
        if shutil.which(program) is None:
            return f"{program} is not installed (Debian: apt install {packages})"
    return ""


def needs(missing: str) -> pytest.MarkDecorator:
    """Return the mark of tests that need what a message says is missing; empty if nothing is."""
    return pytest.mark.skipif(bool(missing), reason=missing or "installed")


def needs_programs(*programs: str, packages: str) -> pytest.MarkDecorator:
    """Return the mark of tests that call programs, with the packages that hold these."""
    return needs(missing_program(*programs, packages=packages))
