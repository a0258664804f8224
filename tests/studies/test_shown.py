"""Numbers of README and manual are those of results/, figures of the report those of the design."""

import re

import pytest
import show_numbers
from draw_design import figures

from support.documents import documents
from support.project import ROOT


def test_a_number_is_replaced_and_an_unknown_name_is_refused():
    text = "It finds <!-- large -->9 of 9<!-- . --> of all."
    assert show_numbers.filled(text, {"large": "79 of 80"}) == text.replace("9 of 9", "79 of 80")
    with pytest.raises(KeyError):
        show_numbers.filled(text, {})


def test_readme_and_tutorial_take_their_numbers_from_the_script():
    readme, *others = (path.read_text(encoding="utf-8") for path in documents())
    shown = dict(show_numbers._NUMBER.findall(readme))
    assert shown.keys() >= {"large", "small", "alarms", "right", "paper_large", "held_out"}
    # One document says of a name what every other one says.
    for text in others:
        told = dict(show_numbers._NUMBER.findall(text))
        assert {name: told[name] for name in told.keys() & shown.keys()}.items() <= shown.items()
    # A number across two lines is not filled. One that begins a line stands in HTML, and the
    # line's links are shown as they are written.
    for text in (readme, *others):
        assert len(show_numbers._NUMBER.findall(text)) == text.count("<!-- . -->")
        assert not re.search(r"^\s*<!-- \w+ -->\d", text, re.MULTILINE)
    bare = re.sub(r"<!-- \w+ -->.*?<!-- \. -->", "", readme)
    assert not re.search(r"\d+ of \d+ ", bare)


@pytest.mark.slow
@pytest.mark.takes(60)
def test_the_documents_have_the_numbers_of_the_results(monkeypatch, capsys):
    """Of those that `make report` left in this folder."""
    if not (ROOT / "results/report.html").exists():
        pytest.skip("make report has not run")
    monkeypatch.setattr("sys.argv", ["show_numbers.py", "--check"])
    assert show_numbers.main() == 0, capsys.readouterr().out


def test_the_report_shows_the_figures_of_the_design():
    folder = ROOT / "workflow" / "report" / "figures"
    assert {path.stem: path.read_bytes() for path in folder.iterdir()} == figures()
