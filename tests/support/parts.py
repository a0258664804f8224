"""The parts as `make_parts.py` makes them, in this process."""

import sys

import pytest

import make_parts


def make_into(folder, *options, drawings=True):
    """Make all parts; without drawings it takes half the time. Gives the folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["make_parts.py", "--out", str(folder), *options])
        if not drawings:
            patch.setattr(make_parts, "sheets", lambda *_: [])
        make_parts.main()
    return folder
