"""All that the page says of a small archive and of an empty one, filled into the real template."""

import datetime
import re

import pytest

from capsule.engine import run as folder
from capsule.engine.project import ProjectState
from capsule.page import files as page_files
from capsule.page import provenance, surveys
from capsule.page.recordings import FIRST_ROWS
from capsule.page.render import render_page
from support.evaluated import UNKNOWN, evaluated
from support.sections import REPORT, compiled, page_of, section

# As long as the keys of `capsule.engine.keys`.
KEY = "0123456789" * 2
EVIL = "bench <script>alert(1)</script>"


@pytest.fixture(autouse=True, scope="module")
def compiled_once():
    """Compile each template once for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("capsule.page.render.environment", lambda _: compiled())
        yield


def filled(page):
    """Fill in the template that the report has; figures are left blank."""
    moment = datetime.datetime(2024, 6, 3, 12, 30, tzinfo=datetime.UTC)
    state, versions = ProjectState("1.2.0", "ab" * 20, True), [("Python", "3.11")]
    made = provenance.how_made({"report.py": "00"}, versions, moment, state)
    made |= dict.fromkeys(("figure", "shipped_figure"), lambda name: "data:,")
    made |= {"key": KEY, "surveys": surveys.page_values([], {})}
    return "".join(render_page(*page_files.read_frame(REPORT), page | made))


@pytest.fixture(scope="module")
def small():
    return page_of(
        evaluated([("0mm/a", 0.0, 0.0), ("2mm/a", 2.0, 3.0)], scheme="held_out"),
        ["0mm/a", 0.0, "accepted", UNKNOWN, EVIL, "aa", 70.0],
        ["2mm/a", 2.0, "accepted", UNKNOWN, EVIL, "bb", 70.0],
        ["2mm/bad", 2.0, "rejected", "the file is empty", UNKNOWN, UNKNOWN, UNKNOWN],
    )


def test_every_accepted_recording_is_listed_and_carried(small):
    listed = {row["recording"]: row["predicted_mm"] for row in small["recordings"]}
    assert listed == {"0mm/a": 0.0, "2mm/a": 3.0, "2mm/bad": None}
    assert [name for name, _ in small["evidence"]] == ["0mm/a", "2mm/a"]
    assert small["figure_series"] == "template (held-out sessions) and the paper"
    # A nodule says more at first sight.
    assert small["first_shown"] == "2mm/a"
    assert small["outcomes"] == ["within tolerance", "rightly none", "rejected"]
    # Kills: scores of nodules for those of healthy ones; nodules of 2 mm counted as small ones.
    assert [card["strip"]["above"] for card in small["cards"]] == [0, 0]
    counts = [(each["what"], each["ours"].count()) for each in small["first"]["counts"]]
    assert counts == [("large", "1 of 1"), ("alarms", "0 of 1")]


def test_the_page_escapes_what_a_recording_says_and_names_its_making_and_its_key(small, tmp_path):
    text, page = filled(small), tmp_path / "report.html"
    page.write_text(text, encoding="utf-8")
    assert EVIL not in text and EVIL.replace("<", "&lt;").replace(">", "&gt;") in text
    assert "<strong>1 of 1</strong> nodules of 2 mm found" in text
    assert "<code>2mm/bad</code> the file is empty" in text
    assert "Made on 2024-06-03 12:30 UTC." in text
    assert "made by origami-capsule 1.2.0, commit abababababab (modified), with Python 3.11" in text
    assert folder.is_made_from(page, KEY)
    assert not folder.is_made_from(page, KEY[::-1])


def test_fabric_as_healthy_and_simulated_nodules_are_warned_of_before_any_rate():
    archive = [(f"{size}mm/{n}", float(size), float(size)) for size in (0, 1) for n in range(60)]
    evaluation = evaluated(archive, (0.0, 1.0))

    def page_with(healthy):
        sources = {0.0: healthy, 1.0: "phantom"}
        usual = [
            [name, mm, "accepted", UNKNOWN, sources[mm], name, 70.0] for name, mm, _ in archive
        ]
        return filled(page_of(evaluation, *usual))

    sound, confounded = page_with("phantom"), page_with(f"fabric {EVIL}")
    assert 'id="confounded"' not in sound and "Reliably found" in sound
    # The table of a large archive begins with some of its rows.
    listed = re.findall(r'<tr data-recording="[^"]+"( hidden)?>', sound)
    assert (len(listed), listed.count("")) == (120, FIRST_ROWS)
    told = "whether there is a nodule follows from the source."
    # It stands before the verdicts and all rates, and none of these is shown.
    warning = confounded.partition('id="confounded"')[2].partition('id="verdicts"')[0]
    assert f"Among the recordings that teach, {told}" in warning
    cells = re.findall(r"<td\b[^>]*>(\d+)</td>", warning)
    assert cells == ["60", "0", "0", "60"]
    panels = confounded.partition('id="answer"')[2].partition('id="detection"')[0]
    assert f"among those that teach, {told}" in panels and "of 60" not in panels
    assert 'id="reliable"' in sound and 'id="reliable"' not in confounded


def test_of_an_empty_archive_the_page_says_so():
    page = page_of(evaluated([], (0.0,)))
    assert page["evidence"] == page["recordings"] == []
    text = filled(page)
    assert "There are no recordings under <code>raw/</code>." in text
    assert "No labelled recording was judged yet." in text and "No verdict yet" in text
    # Without a recording there is no viewer, without a survey no section on surveys.
    assert not any(part in text for part in ('id="viewer"', 'id="surveys"', 'href="#surveys"'))


def test_without_a_healthy_recording_no_false_alarm_is_counted():
    index = ["1mm/a", 1.0, "accepted", UNKNOWN, "bench", "aa", 70.0]
    text = section("panels", **page_of(evaluated([("1mm/a", 1.0, 1.0)], (0.0, 1.0)), index))
    assert "No healthy recording, so no false alarm can occur." in text
