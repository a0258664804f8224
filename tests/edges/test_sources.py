from pathlib import Path

from capsule.keys import imported_files

SCRIPTS = Path(__file__).parents[2] / "workflow" / "scripts"


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


def test_a_fit_depends_on_the_maths_it_uses_and_on_nothing_else():
    fit = names("fit.py")
    assert {"capsule/fitting.py", "capsule/sliding.py", "capsule/particles.py"} <= fit
    assert not {"capsule/preprocessing.py", "capsule/evaluation/rates.py", "fit.py"} & fit
    assert "capsule/preprocessing.py" in names("preprocess.py")


def test_modules_that_a_registry_names_are_followed_too():
    with_diagonal = {
        path.relative_to(SCRIPTS).as_posix()
        for path in imported_files(SCRIPTS / "evaluate.py", ["capsule.detectors.diagonal"])
    }
    assert with_diagonal - names("evaluate.py") == {
        f"capsule/detectors/{name}.py"
        for name in (
            "diagonal",
            "intervals",
            "leaving_out",
            "operating_point",
            "plain",
            "probability",
            "sizing",
        )
    }
