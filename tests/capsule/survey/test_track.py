"""The track: positions of the head as the survey knew them."""

import numpy as np
import pytest

from capsule.survey.files import parse_session
from capsule.survey.track import crest_at_mm, pins_of, track_of
from support.surveys import CREST_MM, DETECTOR, head_mm, session_contents, stream_rows, table


@pytest.fixture(scope="module")
def session():
    return parse_session("demo", session_contents())


def test_the_path_holds_what_the_survey_knew_and_joins_it_by_straight_lines(session):
    track = track_of(session)
    assert np.all(np.diff(track.time_s) == pytest.approx(0.8))
    np.testing.assert_allclose(
        track.head_mm[track.known], head_mm(track.time_s[track.known]), atol=0.006
    )
    unknown = track.time_s[~track.known]
    assert (unknown[0], unknown[-1]) == (pytest.approx(120.8), pytest.approx(211.2))
    between = track.head_mm[(track.time_s >= 120) & (track.time_s <= 212)]
    assert np.allclose(np.diff(between, 2), 0, atol=1e-9)


def test_a_survey_that_never_knew_its_position_has_no_path():
    head, rows = stream_rows()
    at = head.index("head_mm")
    unknown = table(head, [[*row[:at], "", *row[at + 1 :]] for row in rows])
    lost = parse_session("lost", session_contents() | {"stream.csv": unknown})
    assert not track_of(lost).known.any()
    assert np.isnan(crest_at_mm(lost, DETECTOR))


def test_a_place_is_pinned_from_its_suspicion_to_its_verdict_and_crests_where_they_were_felt(
    session,
):
    assert pins_of(session) == [(96.0, 280.0), (320.0, 340.0)]
    assert crest_at_mm(session, DETECTOR) == pytest.approx(CREST_MM, abs=0.5)
