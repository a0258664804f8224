"""Tests of the page's texts on surveys, and of its data to move a mark through them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from capsule.page import surveys
from capsule.page.packing import unpack
from capsule.survey.cycle import STATES
from capsule.survey.files import parse_session
from capsule.survey.track import pins_of, track_of
from support.surveys import head_mm, session_contents


@pytest.fixture(scope="module")
def session():
    return parse_session("demo", session_contents())


def unpacked(packed):
    (row,) = unpack(packed)
    return row


def test_a_simulated_survey_is_called_simulated(session):
    told = {"source": "simulated survey"}, {"header": {"source": "recorded by the board"}}, {}
    titles = [surveys.title_of(replace(session, about={"source": ""} | each)) for each in told]
    assert titles == ["demo, simulated", "demo", "demo, of unknown origin"]


def values_of(session):
    return surveys.survey_values(session, track_of(session), pins_of(session))


def test_the_places_are_those_of_the_file_in_words(session):
    values = values_of(session)
    first, second = values["places"]
    assert (first["status"], first["where"]) == ("nodule", "36.4 mm")
    assert first["size"] == "3.1 mm (2.4 to 3.9)"
    assert (first["passes"], first["height"]) == (2, "6.00")
    assert (second["status"], second["size"]) == ("uncertain: pass again", "n/a")
    assert "2 suspected places: 1 nodule and 1 uncertain: pass again" in values["summary"]
    assert values["simulated"] is True
    json.dumps(values, allow_nan=False)
    # A strange one says so before its size, and one that may be off where else it may be.
    unlike = {"familiar": "no", "unfamiliar_because": "noise", "may_be_off_mm": 80.0}
    strange = replace(session, places=[replace(session.places[0], **unlike)])
    (first,) = values_of(strange)["places"]
    assert first["size"] == "unlike the recordings that teach (noise); 3.1 mm (2.4 to 3.9)"
    assert first["where"] == "36.4 mm, or off by 80 mm"


@pytest.mark.parametrize(
    ("about", "told"),
    [
        ({"goto": [500.0, 140.5]}, "it was told to go to 500 mm, then 140.5 mm."),
        ({}, "; no suspected place."),
    ],
)
def test_of_a_survey_without_places_the_page_says_where_it_went(about, told):
    session = replace(parse_session("there", session_contents(**about)), places=[])
    assert values_of(session)["summary"].endswith(told)


def test_the_player_knows_where_the_head_was_and_when_nobody_knew(session):
    played = surveys.player(session, track_of(session))
    at_mm, measured = unpacked(played["head"]), unpacked(played["measured"])
    time_s = played["from_s"] + played["every_s"] * np.arange(at_mm.size)
    known = (time_s > 10) & (time_s < 120)
    np.testing.assert_allclose(at_mm[known], head_mm(time_s[known]), atol=0.5)
    unknown = time_s[measured == 0]
    assert (unknown[0], unknown[-1]) == (pytest.approx(120.8), pytest.approx(211.2))
    assert np.isin(measured, (0, 1)).all() and unknown.size == pytest.approx(90.4 / 0.8 + 1)
    assert [96.0, STATES["finishing"], "suspected, since suspected"] in played["states"]
    assert np.nanmax(unpacked(played["score"])) == pytest.approx(np.nanmax(session.score), rel=0.01)


def test_the_signals_of_the_player_are_those_of_the_stream_with_its_gap(session):
    lost = (session.time_s >= 50) & (session.time_s < 56)
    gap = replace(session, values=np.where(lost, np.nan, session.values))
    signals = surveys.player(gap, track_of(gap))["signals"]
    assert signals["every_s"] == pytest.approx(0.2)
    for packed, row in zip(signals["rows"], gap.values, strict=True):
        pairs = row[: row.size // 2 * 2].reshape(-1, 2).mean(axis=1)
        np.testing.assert_allclose(unpacked(packed)[: pairs.size], pairs, atol=0.5)
    missing = signals["every_s"] * np.flatnonzero(np.isnan(unpacked(signals["rows"][0])))
    assert (missing[0], missing[-1]) == (pytest.approx(50), pytest.approx(55.8))
    # Rows of a wave are hardly farther apart than the wave is high.
    assert signals["distance"] == pytest.approx(1.1 * np.ptp(session.values, axis=1).max(), rel=0.1)


def test_what_is_not_shown_is_named():
    broken = {"name": "broken", "problem": "places.csv: line 2", "frame": {}}
    values = surveys.page_values([broken], {"a b": "rename"})
    assert values["shown"] == []
    assert values["problems"] == [("broken", "places.csv: line 2"), ("a b", "rename")]
