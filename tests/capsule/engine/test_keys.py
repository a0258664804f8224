"""The key of a job changes with what its result depends on, and with nothing else."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.engine.keys import Step, combined, files_of_code, imported_files

SCRIPTS = Path(__file__).parents[3] / "workflow" / "scripts"
TEXTS = st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))


def step(name="fit", settings="{}", code="fit.py 00", inputs=("a", "b")):
    """Return what the jobs of a rule are made from."""
    return Step(name, Path("fit.py"), settings, code, lambda batch: inputs)


@pytest.mark.parametrize(
    "changed",
    [
        {"name": "describe"},
        {"settings": '{"seed": 2}'},
        {"code": "fit.py 01"},
        {"inputs": ("a", "c")},
        {"inputs": ("a",)},
        {"inputs": ("b", "a")},
        {"inputs": ("ab",)},
    ],
    ids=str,
)
def test_a_key_changes_with_name_settings_code_and_inputs(changed):
    assert step(**changed).key() != step().key()


def test_a_key_changes_with_nothing_else():
    moved = Step("fit", Path("elsewhere/fit.py"), "{}", "fit.py 00", lambda _: iter(["a", "b"]))
    assert moved.key() == step().key()
    # Each batch has its own inputs; its name is in the key only through them.
    assert step().key("3mm/r01") == step().key("3mm/r02")


def test_a_key_is_the_same_in_another_process():
    program = "from pathlib import Path; from capsule.engine.keys import Step; "
    program += "print(Step('fit', Path('fit.py'), '{}', 'fit.py 00', lambda _: ('a', 'b')).key())"
    for seed in ("1", "2"):
        environment = {**os.environ, "PYTHONPATH": str(SCRIPTS), "PYTHONHASHSEED": seed}
        told = subprocess.run(
            [sys.executable, "-c", program], env=environment, capture_output=True, text=True
        )
        assert told.stdout.split() == [step().key()]


def chain(contents, settings="{}"):
    """Return three steps from recordings to a page, and count how often a content is read."""
    read = []

    def content_of(batch):
        read.append(batch)
        return [contents[batch]]

    first = Step("preprocess", Path("preprocess.py"), settings, "00", content_of)
    second = Step("fit", Path("fit.py"), "{}", "00", lambda batch: [first.key(batch)])
    last = Step("report", Path("report.py"), "{}", "00", lambda _: map(second.key, contents))
    return (first, second, last), read


def keys(steps):
    first, second, last = steps
    return {
        f"{each.name} {batch}": each.key(batch) for each in (first, second) for batch in "ab"
    } | {"report": last.key()}


def test_a_change_reaches_the_steps_behind_it_and_no_others():
    before = keys(chain({"a": "1", "b": "2"})[0])
    changed = keys(chain({"a": "1", "b": "3"})[0])
    assert {name for name in before if before[name] != changed[name]} == {
        "preprocess b",
        "fit b",
        "report",
    }
    settings = keys(chain({"a": "1", "b": "2"}, settings="{1}")[0])
    assert not set(before.values()) & set(settings.values())


def test_a_chain_reads_each_content_once():
    steps, read = chain({"a": "1", "b": "2"})
    keys(steps)
    keys(steps)
    assert sorted(read) == ["a", "b"]


@given(TEXTS, TEXTS)
def test_different_parts_have_different_checksums(one, other):
    # A list of no part and one of an empty part are the same text.
    assert (combined(one) == combined(other)) == ((one or [""]) == (other or [""]))


@given(TEXTS)
def test_a_checksum_is_short_and_plain(parts):
    # It goes onto a line of Snakemake's log and into the head of the page.
    assert len(combined(parts)) == 20
    assert set(combined(parts)) <= set("0123456789abcdef")


@pytest.fixture
def project(tmp_path):
    """Return a script that imports a module, and a table beside it."""
    (tmp_path / "lib").mkdir()
    (tmp_path / "script.py").write_text("import lib.a\n")
    (tmp_path / "lib" / "__init__.py").touch()
    (tmp_path / "lib" / "a.py").write_text("x = 1\n")
    (tmp_path / "lib" / "registered.py").write_text("x = 1\n")
    (tmp_path / "table.yaml").write_text("x: 1\n")
    (tmp_path / "other.py").write_text("x = 1\n")
    return tmp_path


def code_of(folder):
    return files_of_code(folder / "script.py", ["lib.registered"], [folder / "table.yaml"])


def checksum(folder):
    """Return the checksum in a new process, since code is read only once in each."""
    program = "import sys; from pathlib import Path; from capsule.engine.keys import "
    program += "checksum_of_code; print(checksum_of_code(map(Path, sys.argv[1:])))"
    told = subprocess.run(
        [sys.executable, "-c", program, *code_of(folder)],
        env={**os.environ, "PYTHONPATH": str(SCRIPTS)},
        capture_output=True,
        text=True,
        check=True,
    )
    return told.stdout.strip()


@pytest.mark.parametrize(
    ("file", "changes"),
    [
        ("script.py", True),
        ("lib/a.py", True),
        ("lib/__init__.py", True),
        ("lib/registered.py", True),
        ("table.yaml", True),
        ("other.py", False),
    ],
)
def test_the_checksum_of_the_code_is_that_of_all_files_behind_a_script(project, file, changes):
    before = checksum(project)
    assert before.startswith("script.py ")
    with (project / file).open("a") as stream:
        stream.write("# a comment\n")
    after = checksum(project)
    assert (after != before) == changes
    # The date does not count.
    os.utime(project / "script.py", (1, 1))
    assert checksum(project) == after


def test_the_library_counts_also_where_it_is_installed_away_from_the_scripts(tmp_path):
    (tmp_path / "fit.py").write_text("from capsule.method import particle\nimport numpy\n")
    found = imported_files(tmp_path / "fit.py")
    assert SCRIPTS / "capsule/method/particle.py" in found
    assert all(path.is_relative_to(SCRIPTS / "capsule") for path in found)


def names(script):
    return {path.relative_to(SCRIPTS).as_posix() for path in imported_files(SCRIPTS / script)}


def test_imports_are_followed_from_module_to_module(tmp_path):
    package = tmp_path / "lib"
    package.mkdir()
    (tmp_path / "script.py").write_text("import numpy\nfrom lib import a\n")
    (package / "__init__.py").write_text("")
    (package / "a.py").write_text("import lib.b\n")
    (package / "b.py").write_text("from lib.a import x\n")
    (package / "unused.py").write_text("")
    found = {path.name for path in imported_files(tmp_path / "script.py")}
    assert found == {"__init__.py", "a.py", "b.py"}


def test_an_import_counts_wherever_it_stands(tmp_path):
    (tmp_path / "script.py").write_text(
        "if a:\n    import one\nelse:\n    import two\n"
        "try:\n    import three\nexcept ImportError:\n    import four\n"
        "else:\n    import five\nfinally:\n    import six\n"
        "class C:\n    async def f(self):\n        with b:\n            import seven\n"
        "match c:\n    case 1:\n        for d in e:\n            import eight\n"
        "        while f:\n            from nine import g\n"
    )
    modules = ["one", "two", "three", "four", "five", "six", "seven", "eight", "nine"]
    for name in modules:
        (tmp_path / f"{name}.py").write_text("")
    found = {path.stem for path in imported_files(tmp_path / "script.py")}
    assert found == set(modules)


def test_an_import_counts_in_any_layout(tmp_path):
    (tmp_path / "script.py").write_text(
        "from lib import (\n    a,  # with a comment (in brackets)\n    b as c,\n)\n"
        "import one, two as t; import three\n"
        "if x: import four  # and five\n"
        "from lib import d, \\\n    e\n"
    )
    modules = ["one", "two", "three", "four"]
    (tmp_path / "lib").mkdir()
    for name in [*modules, "lib/__init__", "lib/a", "lib/b", "lib/d", "lib/e", "five", "x"]:
        (tmp_path / f"{name}.py").write_text("")
    found = {path.stem for path in imported_files(tmp_path / "script.py")}
    assert found == {*modules, "__init__", "a", "b", "d", "e"}


def test_an_import_from_the_own_package_is_followed(tmp_path):
    lib = {
        "__init__": "from . import a",
        "a": "from .b import x",
        "b": "from.deep import d, \\\n  e",
        "deep/__init__": "",
        "deep/d": "from ..c import (x, y)\nfrom . import f",
        "deep/e": "from .. import g",
        "deep/f": "from .e import x",
        "c": "",
        "g": "from .nothing import x",
        "unused": "",
    }
    (tmp_path / "lib/deep").mkdir(parents=True)
    (tmp_path / "script.py").write_text("import lib\n")
    for name, text in lib.items():
        (tmp_path / f"lib/{name}.py").write_text(f"{text}\n")
    found = {
        path.relative_to(tmp_path / "lib").with_suffix("").as_posix()
        for path in imported_files(tmp_path / "script.py")
    }
    assert found == lib.keys() - {"unused"}


def test_a_fit_depends_on_the_maths_it_uses_and_on_nothing_else():
    fit = names("fit.py")
    assert {"capsule/method/particle.py", "capsule/method/sliding.py"} <= fit
    assert not {"capsule/method/preprocessing.py", "capsule/evaluation/rates.py", "fit.py"} & fit
    assert "capsule/method/preprocessing.py" in names("preprocess.py")


def test_modules_that_a_registry_names_are_followed_too():
    with_diagonal = {
        path.relative_to(SCRIPTS).as_posix()
        for path in imported_files(SCRIPTS / "evaluate.py", ["capsule.detectors.diagonal"])
    }
    assert with_diagonal - names("evaluate.py") == {"capsule/detectors/diagonal.py"}
