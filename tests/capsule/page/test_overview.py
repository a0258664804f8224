"""Tests of the numbers of recordings, and of the warning that nodules follow from the header."""

from collections import Counter

import pandas as pd
import pytest

from capsule.evaluation.confounded import OWN, Confounded
from capsule.page import overview
from capsule.page.overview import LONGEST
from support.evaluated import UNKNOWN
from support.sections import section

SIZES_MM = (0.0, 1.0, 3.0)
CELLS = ("size_mm", "reason", "no_verdict", "near_copies", "session")
PHANTOM = "simulated phantom, version 5, seed 1"


def overview_of(*rows, held_out=()):
    """Return what the page says of recordings, each with the cells of an index that it names."""
    usual = {"status": "accepted", "source": "bench 2"} | dict.fromkeys(CELLS, UNKNOWN)
    index = pd.DataFrame([usual | row for row in rows]).astype({"reason": object})
    passed_over = pd.DataFrame({"path": ["notes.txt"], "reason": ["not a .csv file"]})
    return overview.overview(index, passed_over, held_out)


def test_the_overview_lists_what_was_not_used():
    bad = {"recording": "2.5mm/bad", "size_mm": 2.5, "status": "rejected"}
    values = overview_of(
        {"recording": "0mm/a", "size_mm": 0.0},
        {"recording": "2.5mm/b", "size_mm": 2.5, "near_copies": "unlabelled/c"},
        bad | {"reason": "the file is empty", "source": UNKNOWN},
        {"recording": "3mm/d", "size_mm": 3.0, "near_copies": "4mm/e"},
        {"recording": "4mm/e", "size_mm": 4.0, "near_copies": "3mm/d"},
        {"recording": "unlabelled/c", "near_copies": "2.5mm/b", "no_verdict": "no wave"},
    )
    assert values["origin"].kind == "recorded"
    assert (values["accepted"], values["unlabelled"]) == (5, 1)
    assert values["by_size"] == dict.fromkeys((0.0, 2.5, 3.0, 4.0), 1)
    # Each group is named once; two sizes of the same readings contradict each other.
    assert values["near_copies"] == [
        {"recordings": ["2.5mm/b", "unlabelled/c"], "contradict": False},
        {"recordings": ["3mm/d", "4mm/e"], "contradict": True},
    ]
    assert values["not_judged"] == [{"recording": "unlabelled/c", "no_verdict": "no wave"}]
    assert values["rejected"] == [{"recording": "2.5mm/bad", "reason": "the file is empty"}]
    said = section("used", **values)
    for told in ("Rejected: 1", "Not judged: 1", "Nearly the same: 2", "Passed over: 1"):
        assert f"<h3>{told}</h3>" in said


@pytest.mark.parametrize(
    ("sources", "name"),
    [
        ([PHANTOM, "simulated phantom, version 5, seed 2"], "Simulated phantom"),
        (["imported from monday.csv", "imported from tuesday, 2.csv"], "Imported recordings"),
        (["bench 2", "imported from monday.csv", "slide"], "Bench 2, imported recordings, …"),
        ([UNKNOWN], "Origami capsule"),
    ],
)
def test_the_archive_is_called_by_its_sources_and_not_by_the_names_of_files(sources, name):
    assert overview.archive_name(pd.DataFrame({"source": sources}, dtype="str")) == name


def test_a_held_out_session_that_no_recording_carries_is_told():
    rows = [
        {"recording": "0mm/a", "size_mm": 0.0, "session": "spring"},
        {"recording": "2mm/b", "size_mm": 2.0},
        {"recording": "unlabelled/c", "session": "autumn"},
        {"recording": "2mm/d", "size_mm": 2.0, "session": "winter", "status": "rejected"},
    ]
    found = overview_of(*rows, held_out=["spring", "autumn", "summer"])
    assert found["not_held_out"] == ["autumn", "summer"]
    assert "1 of these is held out (session spring)" in section("used", **found)
    assert "held out" not in section("used", **overview_of(*rows))


BENCH, OF_HEALTHY = {"bench": [0, 20, 20]}, [1, 0, 0]


@pytest.mark.parametrize(
    ("key", "counts", "shown"),
    [
        ("rate_hz", {"10": [0, 20, 20], "": OF_HEALTHY}, ["10 Hz", "not said"]),
        ("session", BENCH | {OWN: OF_HEALTHY}, ["bench", "another value at each place"]),
        ("source", {"b" * 10_000: [0, 20, 20]}, ["b" * (LONGEST - 1) + "…"]),
        # Kills: a row of rarer values that stands for a single one.
        ("session", BENCH | dict.fromkeys("abcde", OF_HEALTHY), ["bench", *"abcde"]),
        ("session", BENCH | dict.fromkeys("abcdefgh", OF_HEALTHY), ["bench", *"abcd"]),
    ],
)
def test_a_value_has_its_row_of_counts_and_the_rarer_ones_of_many_share_one(key, counts, shown):
    sizes = {value: Counter(dict(zip(SIZES_MM, of, strict=True))) for value, of in counts.items()}
    values = overview.confounded_values([Confounded(key, True, (), sizes)])
    assert values["sizes"] == ["no nodule", "1 mm", "3 mm"]
    expected = dict(zip(shown, counts.values(), strict=False))
    if len(counts) > len(shown):
        expected["4 rarer values"] = [4, 0, 0]
    assert {row["value"]: row["counts"] for row in values["rows"]} == expected
    assert {row["name"] for row in values["rows"]} == {overview.KEYS[key]}
