"""The report contains every file of the template; each script comes after those that it uses."""

import hashlib
import re

from capsule.page import files as page_files
from support.project import ROOT

REPORT = ROOT / "workflow" / "report"


def test_no_script_and_no_style_is_left_out():
    own = {path.relative_to(REPORT).as_posix() for path in REPORT.glob("scripts/*.js")}
    assert own == {name for name in page_files.SCRIPTS if not name.startswith("vendor/")}
    assert {path.name for path in REPORT.glob("*.css")} < set(page_files.STYLES)


def test_the_frame_holds_every_template_but_no_hidden_file(tmp_path):
    for name in ("report.html.j2", "macros.html.j2", "sections/answer.html.j2"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(name, encoding="utf-8")
    # Such files lie in every folder that has been on a Mac.
    (tmp_path / "sections" / "._answer.html.j2").write_bytes(b"\0\xff")
    for name in (*page_files.STYLES, *page_files.SCRIPTS):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(f"/* {name} */", encoding="utf-8")
    templates, style, script = page_files.read_frame(tmp_path)
    assert templates == {
        name: name for name in ("macros.html.j2", "report.html.j2", "sections/answer.html.j2")
    }
    assert style.splitlines() == [f"/* {name} */" for name in page_files.STYLES]
    assert script.splitlines() == [f"/* {name} */" for name in page_files.SCRIPTS]


def test_every_template_is_included_or_imported():
    templates, _, _ = page_files.read_frame(REPORT)
    named = {name for text in templates.values() for name in re.findall(r'"(\S+\.j2)"', text)}
    assert named | {"report.html.j2"} == set(templates)


def test_the_code_of_every_rule_is_named_with_its_checksum():
    checksums = page_files.code_checksums()
    rules = {f"workflow/scripts/{name}.py" for name in page_files.RULE_SCRIPTS}
    named = ("store/files", "figures/draw_curves")
    modules = {f"workflow/scripts/capsule/{name}.py" for name in named}
    assert rules | modules <= checksums.keys()
    content = (ROOT / "workflow/scripts/fit.py").read_bytes()
    assert checksums["workflow/scripts/fit.py"] == hashlib.sha256(content).hexdigest()


def test_the_rules_have_these_scripts():
    rules = "".join(
        path.read_text(encoding="utf-8") for path in (ROOT / "workflow/rules").iterdir()
    )
    steps = re.findall(r'= step\(\s*"(\w+)"', rules)
    scripts = re.findall(r'script="(\w+)\.py"', rules)
    assert {*steps, *scripts} - {"survey"} == set(page_files.RULE_SCRIPTS)


def test_versions_are_those_of_the_installed_packages():
    versions = dict(page_files.read_versions(ROOT / "workflow" / "report"))
    assert list(versions) == ["Python", *page_files.PACKAGES, "uPlot"]
    assert all(re.match(r"\d+\.\d+", version) for version in versions.values())
