"""Run `make_parts.py` in this process."""

import sys

import pytest

import make_parts


def make_into(folder, *options, drawings=True):
    """Make all parts, and return the folder; without drawings, this takes half the time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["make_parts.py", "--out", str(folder), *options])
        if not drawings:
            patch.setattr(make_parts, "sheets", lambda *_: [])
        make_parts.main()
    return folder
