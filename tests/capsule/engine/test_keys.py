"""The key of a job changes with what its result depends on, and with nothing else."""

import os
from pathlib import Path

import pytest

from capsule.engine import keys as keys_module
from capsule.engine.keys import Step, checksum_of_code, files_of_code, imported_files

SCRIPTS = Path(__file__).parents[3] / "workflow" / "scripts"


def step(name="fit", path="fit.py", settings="{}", code="fit.py 00", inputs=("a", "b")):
    """Return what the jobs of a rule are made from; without inputs, each batch is its own."""
    return Step(name, Path(path), settings, code, lambda batch: inputs or [batch])


def test_a_key_changes_with_name_settings_code_and_inputs_and_nothing_else():
    changes = [{}, {"name": "describe"}, {"settings": '{"seed": 2}'}, {"code": "fit.py 01"}]
    changes += [{"inputs": inputs} for inputs in (("a",), ("b", "a"), ("ab",))]
    assert len({step(**changed).key() for changed in changes}) == 7
    # The name of a batch is in its key only through its inputs.
    assert step(path="elsewhere/fit.py").key("3mm/r01") == step().key("3mm/r02")
    assert step(inputs=()).key("3mm/r01") != step(inputs=()).key("3mm/r02")


def write(folder, contents):
    """Write files below a folder, and let code be read anew, which each process reads once."""
    for name, text in contents.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    for cached in ("read_code", "_imports", "_module_files", "_files_of"):
        getattr(keys_module, cached).cache_clear()


BEHIND = ("script.py", "lib/__init__.py", "lib/a.py", "lib/registered.py", "table.yaml")


@pytest.mark.parametrize("file", [*BEHIND, "other.py"])
def test_the_checksum_of_the_code_is_that_of_all_files_behind_a_script(tmp_path, file):
    contents = dict.fromkeys([*BEHIND, "other.py"], "") | {"script.py": "import lib.a\n"}
    told = []
    # The date does not count.
    for edit in ({}, {file: contents[file] + "# a comment\n"}, {}):
        write(tmp_path, contents | edit)
        os.utime(tmp_path / "script.py", (len(told), 1))
        files = files_of_code(tmp_path / "script.py", ["lib.registered"], [tmp_path / "table.yaml"])
        told.append(checksum_of_code(files))
    assert told[0].startswith("script.py ")
    assert (told[0] != told[1], told[0] == told[2]) == (file in BEHIND, True)


def test_the_library_counts_also_where_it_is_installed_away_from_the_scripts(tmp_path):
    (tmp_path / "fit.py").write_text("from capsule.method import particle\nimport numpy\n")
    found = imported_files(tmp_path / "fit.py")
    assert SCRIPTS / "capsule/method/particle.py" in found
    assert all(path.is_relative_to(SCRIPTS / "capsule") for path in found)


# Wherever it stands, and in any layout.
SCRIPT = """
if a: import one, two as t; import three  # and unused
class C:
    async def f(self):
        from lib import (
            a,  # a comment (in brackets)
            b as c,
        )
from lib import d, \\
    e
import own
"""
FOLLOWED = {"lib": "abde", "own": "abcg", "own/deep": "def"}
FOLLOWED = [f"{at}/{name}" for at, names in FOLLOWED.items() for name in ("__init__", *names)]
FOLLOWED += ["one", "two", "three"]


def test_an_import_is_followed(tmp_path):
    texts = {
        "script": SCRIPT,
        # From the own package.
        "own/__init__": "from . import a",
        "own/a": "from .b import x",
        "own/b": "from.deep import d, \\\n  e",
        "own/deep/d": "from ..c import (x, y)\nfrom . import f",
        "own/deep/e": "from .. import g",
        "own/deep/f": "from .e import x",
        "own/g": "from .nothing import x",
    }
    contents = dict.fromkeys([*FOLLOWED, "lib/unused", "unused", "x"], "") | texts
    write(tmp_path, {f"{name}.py": f"{text}\n" for name, text in contents.items()})
    found = imported_files(tmp_path / "script.py")
    assert {path.relative_to(tmp_path).with_suffix("").as_posix() for path in found} == {*FOLLOWED}
