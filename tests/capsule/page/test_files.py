"""The report contains every file of the template, and nothing on it can run but its own script."""

import hashlib
import re
import shutil

import pytest

from capsule.page import files as page_files
from capsule.page.render import render_page
from support.project import ROOT

REPORT = ROOT / "workflow" / "report"


def test_the_frame_holds_every_script_style_and_template_but_no_hidden_file(tmp_path):
    own = {path.relative_to(REPORT).as_posix() for path in REPORT.glob("scripts/*.js")}
    assert own == {name for name in page_files.SCRIPTS if not name.startswith("vendor/")}
    assert {path.name for path in REPORT.glob("*.css")} < set(page_files.STYLES)
    folder = shutil.copytree(REPORT, tmp_path / "report")
    # Such files lie in every folder that has been on a Mac.
    (folder / "sections" / "._answer.html.j2").write_bytes(b"\0\xff")
    templates, style, script = page_files.read_frame(folder)
    assert set(templates) == {path.relative_to(REPORT).as_posix() for path in REPORT.rglob("*.j2")}
    named = {name for text in templates.values() for name in re.findall(r'"(\S+\.j2)"', text)}
    assert named | {"report.html.j2"} == set(templates)
    for whole, names in ((style, page_files.STYLES), (script, page_files.SCRIPTS)):
        places = [whole.index((REPORT / name).read_text(encoding="utf-8")) for name in names]
        assert places == sorted(places)


def test_the_code_of_every_rule_is_named_with_its_checksum():
    checksums = page_files.code_checksums()
    named = {"report", "capsule/store/files", "capsule/figures/draw_rates"}
    assert {f"workflow/scripts/{name}.py" for name in named} <= checksums.keys()
    content = (ROOT / "workflow/scripts/fit.py").read_bytes()
    assert checksums["workflow/scripts/fit.py"] == hashlib.sha256(content).hexdigest()


def test_the_policy_allows_this_script_and_no_other():
    template = {"report.html.j2": '<meta content="{{ policy }}"><script>{{ script }}</script>'}
    page = "".join(render_page(template, "p {}", "a < b && c", {}))
    assert "<script>a < b && c</script>" in page
    assert "default-src 'none'" in page and "unsafe" not in page
    assert page.count("'sha256-") == 2
    # An end tag in the script would end it.
    with pytest.raises(ValueError, match="end tag"):
        list(render_page(template, "", "x = '</script>'", {}))
