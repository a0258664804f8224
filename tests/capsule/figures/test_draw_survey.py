"""The space-time picture of a survey holds the numbers of the survey's files."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.colors import to_hex
from matplotlib.text import Text

from capsule.figures.draw_survey import draw_survey, frame_of, spread_out, track_table
from capsule.figures.style import BLUE, INK, ORANGE, render_figure
from capsule.survey.files import parse_session
from capsule.survey.track import crest_at_mm, pins_of, track_of
from support.surveys import CREST_MM, DETECTOR, WAVE_MM_S, WAVELENGTH_MM, head_mm, session_contents


@pytest.fixture(scope="module")
def session():
    return parse_session("demo", session_contents())


@pytest.fixture(scope="module")
def figure(session):
    wave = WAVELENGTH_MM, crest_at_mm(session, DETECTOR)
    return draw_survey(session, "demo, simulated", track_of(session), pins_of(session), wave)


def lines_of(axes, colour, dashed):
    """Return the stretches of the path of a colour, as [distance, time] points."""
    path = [each for each in axes.get_lines() if each.get_zorder() == 3]
    chosen = [
        each for each in path if (to_hex(each.get_color()), each.is_dashed()) == (colour, dashed)
    ]
    return [np.column_stack(line.get_data()) for line in chosen]


def test_the_table_is_the_stream_from_judgement_to_judgement(session):
    table, judged = track_table(track_of(session)), ~np.isnan(session.threshold)
    measured = ~np.isnan(session.head_mm[judged])
    assert table["measured"].tolist() == measured.tolist()
    for name in ("time_s", "head_mm", "score"):
        known = getattr(session, name)[judged][measured]
        assert table.loc[measured, name].tolist() == known.tolist()


def test_the_path_lies_where_the_head_was_and_the_evidence_beside_it(session, figure):
    space, evidence = figure.axes[:2]
    assert space.get_xlim() == pytest.approx((-2, 102))
    explored, (again,) = lines_of(space, BLUE, False), lines_of(space, INK, False)
    assert len(explored) == 2
    for line in (*explored, again):
        np.testing.assert_allclose(line[:, 0], head_mm(60 * line[:, 1]), atol=0.1)
    assert again[-1, 1] == pytest.approx(280 / 60)
    # The way back was not measured: it is dashed, from where it was left to where it was found.
    (back,), (found,) = lines_of(space, ORANGE, True), lines_of(space, INK, True)
    assert back[0] == pytest.approx([60, 2.0])
    assert back[-1] == pytest.approx(found[0])
    assert found[-1] == pytest.approx(again[0])
    # The legend shows a measured line of each group that has one.
    shown = zip(figure.legends[0].get_texts(), figure.legends[0].legend_handles, strict=True)
    dashed = {text.get_text() for text, line in shown if line.is_dashed()}
    assert "position not measured" in dashed and "finds its position, passes again" not in dashed
    assert evidence.get_ylim() == space.get_ylim() == (344 / 60, 0)
    (threshold,) = evidence.get_lines()
    assert set(threshold.get_xdata()) == {0.15}
    assert evidence.get_xlim()[1] > np.nanmax(session.score)


def test_crests_run_forward_at_the_speed_of_the_wave(figure):
    (crests,) = figure.axes[2].collections
    ends = np.array([path.vertices[[0, -1]] for path in crests.get_paths()])
    at_mm, time_s = ends[..., 0], 60 * ends[..., 1]
    assert len(ends) > 5
    np.testing.assert_allclose(np.diff(at_mm) / np.diff(time_s), WAVE_MM_S, rtol=1e-3)
    # The panel of a place begins 0.4 min before it is suspected, and ends behind its verdict.
    assert figure.axes[2].get_ylim() == pytest.approx((280 / 60 + 0.33, 96 / 60 - 0.4))
    assert figure.axes[3].get_xlim() == pytest.approx((71 - 22, 71 + 30))
    stood_mm = (at_mm - WAVE_MM_S * time_s - CREST_MM) / WAVELENGTH_MM
    assert np.abs(stood_mm - np.rint(stood_mm)).max() < 0.02


def test_verdicts_sizes_and_simulated_are_written_and_the_frame_tells_where_places_are(figure):
    texts = {text.get_text() for text in figure.findobj(Text)}
    assert {"demo, simulated", "1 nodule, 3.1 mm (2.4 to 3.9)", "2 uncertain: pass again"} <= texts
    assert {"time (min)", "distance along the gut (mm)", "score"} <= texts
    # Labels stand beside their places, in the midst of the time that was taken for each.
    first, second = figure.axes[0].texts
    assert (*first.xy, *first.get_position()) == pytest.approx((36.4, 188 / 60, 43.9, 188 / 60))
    assert (*second.xy, *second.get_position()) == pytest.approx((71.0, 5.5, 63.5, 5.5))
    assert render_figure(figure, "svg", "demo")
    told = frame_of(figure)
    left, top, width, height = told["map"]["box"]
    low, high = told["map"]["x"]
    end, start = told["map"]["y"]
    dots = figure.axes[0].transData.transform([[50.0, 3.0]])[0] * 72 / figure.dpi
    assert dots[0] == pytest.approx(left + (50 - low) / (high - low) * width, abs=0.05)
    down = top + (3 - start) / (end - start) * height
    assert told["size"][1] - dots[1] == pytest.approx(down, abs=0.05)


def test_a_survey_that_never_knew_its_position_says_so(session):
    track = track_of(session)
    lost = replace(track, known=np.zeros_like(track.known))
    figure = draw_survey(session, "demo", lost, pins_of(session), (WAVELENGTH_MM, np.nan))
    assert any("never knew where" in text.get_text() for text in figure.findobj(Text))
    assert list(frame_of(figure)) == ["size"]


@given(st.lists(st.floats(0, 100), max_size=10).map(sorted))
def test_labels_are_moved_apart_and_stay_in_the_map(places):
    moved = spread_out(places, 9.0, 100.0)
    assert all(0 <= place <= 100 for place in moved)
    assert all(there - here >= 9 - 1e-9 for here, there in pairwise(moved))
