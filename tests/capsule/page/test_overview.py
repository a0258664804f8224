"""Tests of the numbers of recordings, used and not used."""

import pandas as pd

from capsule.page import overview

UNKNOWN = float("nan")


def test_the_overview_lists_what_was_not_used():
    index = pd.DataFrame(
        {
            "recording": ["0mm/a", "2.5mm/b", "2.5mm/bad", "unlabelled/c"],
            "size_mm": [0.0, 2.5, 2.5, UNKNOWN],
            "status": ["accepted", "accepted", "rejected", "accepted"],
            "reason": [UNKNOWN, UNKNOWN, "the file is empty", UNKNOWN],
            "no_verdict": [UNKNOWN, UNKNOWN, UNKNOWN, "no wave on sensor_2"],
            "source": ["bench 2", "bench 2", UNKNOWN, "bench 2"],
            "near_copies": [UNKNOWN, "unlabelled/c", UNKNOWN, "2.5mm/b"],
        }
    )
    passed_over = pd.DataFrame({"path": ["notes.txt"], "reason": ["not a .csv file"]})
    values = overview.overview(index, passed_over, [])
    assert values["origin"]["kind"] == "recorded"
    assert (values["accepted"], values["unlabelled"]) == (3, 1)
    assert values["by_size"] == [{"size": "no nodule", "count": 1}, {"size": "2.5 mm", "count": 1}]
    alike = {"recordings": ["2.5mm/b", "unlabelled/c"], "contradict": False}
    assert values["near_copies"] == [alike]
    unlabelled = {"recording": "unlabelled/c", "no_verdict": "no wave on sensor_2"}
    assert values["not_judged"] == [unlabelled]
    assert values["rejected"] == [{"recording": "2.5mm/bad", "reason": "the file is empty"}]


def test_recordings_that_are_nearly_the_same_are_named_once_with_what_their_labels_say():
    index = pd.DataFrame(
        {
            "recording": ["0mm/a", "3mm/b", "4mm/c", "4mm/d"],
            "size_mm": [0.0, 3.0, 4.0, 4.0],
            "status": "accepted",
            "reason": UNKNOWN,
            "no_verdict": UNKNOWN,
            "source": "bench 2",
            "near_copies": [UNKNOWN, "4mm/c", "3mm/b", UNKNOWN],
        }
    )
    values = overview.overview(index, pd.DataFrame({"path": [], "reason": []}), [])
    assert values["near_copies"] == [{"recordings": ["3mm/b", "4mm/c"], "contradict": True}]


def test_a_held_out_session_that_no_recording_carries_is_told():
    index = pd.DataFrame(
        {
            "recording": ["0mm/a", "2mm/b", "unlabelled/c", "2mm/d"],
            "size_mm": [0.0, 2.0, UNKNOWN, 2.0],
            "status": ["accepted", "accepted", "accepted", "rejected"],
            "reason": None,
            "no_verdict": UNKNOWN,
            "source": "bench 2",
            "near_copies": UNKNOWN,
            "session": ["spring", UNKNOWN, "autumn", "winter"],
        }
    )
    none = pd.DataFrame({"path": [], "reason": []})
    spring = overview.overview(index, none, ["spring"])
    assert spring["held_out_words"] == (
        "1 of these is held out (session spring): they judge, and teach nothing."
    )
    assert overview.overview(index, none, [])["held_out_words"] == ""
    assert overview.overview(index, none, ["spring"])["not_held_out"] == ""
    said = overview.overview(index, none, ["spring", "autumn", "summer"])["not_held_out"]
    assert said == (
        "evaluation.held_out names autumn and summer, but no recording of known size carries these "
        "sessions."
    )
