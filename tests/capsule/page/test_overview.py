"""Tests of the numbers of recordings, and of the warning that nodules follow from the header."""

from collections import Counter

import pandas as pd
import pytest

from capsule.evaluation.confounded import of_values
from capsule.page import overview
from capsule.page.overview import LONGEST, MOST_VALUES
from support.evaluated import UNKNOWN, evaluated, index_of, rates_of
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
        {"recording": "unlabelled/c", "near_copies": "2.5mm/b", "no_verdict": "no wave"},
    )
    assert values["origin"].kind == "recorded"
    assert (values["accepted"], values["unlabelled"]) == (3, 1)
    assert values["by_size"] == {0.0: 1, 2.5: 1}
    alike = {"recordings": ["2.5mm/b", "unlabelled/c"], "contradict": False}
    assert values["near_copies"] == [alike]
    assert values["not_judged"] == [{"recording": "unlabelled/c", "no_verdict": "no wave"}]
    assert values["rejected"] == [{"recording": "2.5mm/bad", "reason": "the file is empty"}]
    said = section("used", **values)
    for told in ("Rejected: 1", "Not judged: 1", "Nearly the same: 1", "Passed over: 1"):
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


def test_recordings_that_are_nearly_the_same_are_named_once_with_what_their_labels_say():
    values = overview_of(
        {"recording": "0mm/a", "size_mm": 0.0},
        {"recording": "3mm/b", "size_mm": 3.0, "near_copies": "4mm/c"},
        {"recording": "4mm/c", "size_mm": 4.0, "near_copies": "3mm/b"},
        {"recording": "4mm/d", "size_mm": 4.0},
    )
    assert values["near_copies"] == [{"recordings": ["3mm/b", "4mm/c"], "contradict": True}]


def test_a_held_out_session_that_no_recording_carries_is_told():
    rows = [
        {"recording": "0mm/a", "size_mm": 0.0, "session": "spring"},
        {"recording": "2mm/b", "size_mm": 2.0},
        {"recording": "unlabelled/c", "session": "autumn"},
        {"recording": "2mm/d", "size_mm": 2.0, "session": "winter", "status": "rejected"},
    ]
    said = "1 of these is held out (session spring): they judge, and teach nothing."
    assert said in section("used", **overview_of(*rows, held_out=["spring"]))
    assert "held out" not in section("used", **overview_of(*rows))
    assert overview_of(*rows, held_out=["spring"])["not_held_out"] == []
    wanted = ["spring", "autumn", "summer"]
    assert overview_of(*rows, held_out=wanted)["not_held_out"] == ["autumn", "summer"]


def told(key, pairs):
    """Return what the values of a key tell, from pairs of a value and a size."""
    values, sizes_mm = (dict(enumerate(each)) for each in zip(*pairs, strict=True))
    return of_values(key, values, sizes_mm, {name: name for name in values})


def nodules(value, each=20):
    return [(value, size) for size in SIZES_MM[1:] for _ in range(each)]


def test_the_warning_says_what_follows_and_what_to_do():
    values = overview.confounded_values(
        [
            told("source", [*nodules("phantom"), *[("fabric", 0.0)] * 20]),
            told("rate_hz", [*nodules("10"), *[("", 0.0)] * 20]),
        ]
    )
    said = section("confounded", confounded=values)
    assert "A detector may have learned the source instead of the nodule</strong></p>" in said
    assert (
        "Among the recordings that teach, whether there is a nodule follows from the source and "
        "from the sampling rate. So the rates below do not show that a detector finds nodules. "
        "Record healthy places and nodules of every size with the same source and sampling "
        "rate.</p>"
    ) in said
    assert values["sizes"] == ["no nodule", "1 mm", "3 mm"]
    assert values["keys"] == [
        {
            "name": "source",
            "rows": [
                {"value": "phantom", "counts": [0, 20, 20]},
                {"value": "fabric", "counts": [20, 0, 0]},
            ],
        },
        {
            "name": "sampling rate",
            "rows": [
                {"value": "10 Hz", "counts": [0, 20, 20]},
                {"value": "not said", "counts": [20, 0, 0]},
            ],
        },
    ]


def test_if_the_size_alone_follows_the_warning_speaks_of_sizes():
    pairs = [
        (f"day {size}", kind) for size in SIZES_MM[1:] for kind in (0.0, size) for _ in "x" * 9
    ]
    values = overview.confounded_values([told("session", pairs)])
    said = section("confounded", confounded=values)
    assert "A detector may have learned the session instead of the size</strong></p>" in said
    assert (
        "Among the recordings that teach, the size of nodules of 1 and 3 mm follows from the "
        "session. So the rates below do not show that a detector tells their sizes. Record healthy "
        "places and nodules of every size with the same session.</p>"
    ) in said


def test_many_values_share_a_row_and_values_of_single_places_do_so_always():
    pairs = nodules("bench") + [(f"day {day}", 0.0) for day in range(9) for _ in range(9 - day)]
    (key,) = overview.confounded_values([told("session", pairs)])["keys"]
    assert [row["value"] for row in key["rows"]] == [
        "bench",
        *(f"day {day}" for day in range(4)),
        "5 rarer values",
    ]
    assert len(key["rows"]) == MOST_VALUES
    assert sum(sum(row["counts"]) for row in key["rows"]) == len(pairs)
    pairs = nodules("bench") + [(f"day {day}", 0.0) for day in range(9)]
    (key,) = overview.confounded_values([told("session", pairs)])["keys"]
    assert [row["value"] for row in key["rows"]] == ["bench", "another value at each place"]


def test_a_long_value_is_cut_and_without_a_key_there_is_no_warning():
    pairs = nodules("b" * 10_000) + [("bench", 0.0)] * 20
    (key,) = overview.confounded_values([told("source", pairs)])["keys"]
    assert [row["value"] for row in key["rows"]] == ["b" * (LONGEST - 1) + "…", "bench"]
    assert overview.confounded_values([]) is None


def rates_with(source_of_healthy, **columns):
    """Return the rates of detectors that are always right, with the healthy recordings' source."""
    verdicts = [(f"{size:g}mm/{n}", size, size) for size in SIZES_MM for n in range(60)]
    rows = [
        [name, size, "accepted", UNKNOWN, PHANTOM if size else source_of_healthy, "aa", 70.0]
        for name, size, _ in verdicts
    ]
    index = index_of(*rows).assign(**columns)
    return rates_of(evaluated(verdicts, SIZES_MM, ("template", "taught")), index=index)


def test_held_out_recordings_and_an_index_without_the_columns_warn_of_nothing():
    rates = rates_with(PHANTOM)
    assert rates.confounded == []
    assert not {"unit", "rate_hz"} & set(rates.index)
    (found,) = rates_with(PHANTOM, unit=["counts"] * 60 + ["V"] * 120).confounded
    assert (found.key, found.counts["counts"]) == ("unit", Counter({0.0: 60}))
