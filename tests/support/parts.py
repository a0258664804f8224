"""Make the printable parts inside the tests' process."""

import pytest

from capsule.parts import files
from support.command import run_command


def make_into(folder, *options, drawings=True):
    """Make all parts, and return the folder; without drawings, this takes half the time."""
    with pytest.MonkeyPatch.context() as patch:
        if not drawings:
            patch.setattr(files, "sheets", lambda _: [])
        run_command("parts", "--out", folder, *options)
    return folder
