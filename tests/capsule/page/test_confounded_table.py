"""The page's warning that nodules follow from the header, in words and with its table."""

from collections import Counter

import pytest

from capsule.evaluation.confounded import of_values
from capsule.evaluation.lead import Lead
from capsule.page import cards, confounded_table, detector_sections, trust
from capsule.page.confounded_table import LONGEST, MOST_VALUES
from support.evaluated import UNKNOWN, evaluated, index_of, rates_of

SIZES_MM = (0.0, 1.0, 3.0)
FABRIC, PHANTOM = "finger on fabric", "simulated phantom, version 5, seed 1"


def told(key, pairs):
    """Return what the values of a key tell, from pairs of a value and a size."""
    values, sizes_mm = (dict(enumerate(each)) for each in zip(*pairs, strict=True))
    return of_values(key, values, sizes_mm, {name: name for name in values})


def nodules(value, each=20):
    return [(value, size) for size in SIZES_MM[1:] for _ in range(each)]


def test_the_warning_says_what_follows_and_what_to_do():
    values = confounded_table.page_values(
        [
            told("source", [*nodules("phantom"), *[("fabric", 0.0)] * 20]),
            told("rate_hz", [*nodules("10"), *[("", 0.0)] * 20]),
        ]
    )
    assert values["headline"] == "A detector may have learned the source instead of the nodule"
    assert values["text"] == (
        "Among the recordings that teach, whether there is a nodule follows from the source and "
        "from the sampling rate. Whoever knows nothing but the source finds 40 of 40 nodules, and "
        "calls 20 of 20 healthy places healthy. So the rates below do not show that a detector "
        "finds nodules. Record healthy places and nodules of every size with the same source and "
        "sampling rate."
    )
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
    values = confounded_table.page_values([told("session", pairs)])
    assert values["headline"] == "A detector may have learned the session instead of the size"
    assert values["text"] == (
        "Among the recordings that teach, the size of nodules of 1 and 3 mm follows from the "
        "session. So the rates below do not show that a detector tells their sizes. Record healthy "
        "places and nodules of every size with the same session."
    )


def test_many_values_share_a_row_and_values_of_single_places_do_so_always():
    pairs = nodules("bench") + [(f"day {day}", 0.0) for day in range(9) for _ in range(9 - day)]
    (key,) = confounded_table.page_values([told("session", pairs)])["keys"]
    assert [row["value"] for row in key["rows"]] == [
        "bench",
        *(f"day {day}" for day in range(4)),
        "5 rarer values",
    ]
    assert len(key["rows"]) == MOST_VALUES
    assert sum(sum(row["counts"]) for row in key["rows"]) == len(pairs)
    pairs = nodules("bench") + [(f"day {day}", 0.0) for day in range(9)]
    (key,) = confounded_table.page_values([told("session", pairs)])["keys"]
    assert [row["value"] for row in key["rows"]] == ["bench", "another value at each place"]


def test_a_long_value_is_cut():
    pairs = nodules("b" * 10_000) + [("bench", 0.0)] * 20
    (key,) = confounded_table.page_values([told("source", pairs)])["keys"]
    assert [row["value"] for row in key["rows"]] == ["b" * (LONGEST - 1) + "…", "bench"]


def test_without_such_a_key_there_is_no_warning():
    assert confounded_table.page_values([]) is None


def rates_with(source_of_healthy, **columns):
    """Return the rates of detectors that are always right, with the healthy recordings' source."""
    verdicts = [(f"{size:g}mm/{n}", size, size) for size in SIZES_MM for n in range(60)]
    rows = [
        [name, size, "accepted", UNKNOWN, PHANTOM if size else source_of_healthy, "aa", 70.0]
        for name, size, _ in verdicts
    ]
    index = index_of(*rows).assign(**columns)
    return rates_of(evaluated(verdicts, SIZES_MM, ("template", "taught")), index=index)


@pytest.mark.parametrize("detector", ["template", "taught"])
def test_no_detector_is_called_reliable_on_the_first_screen(detector):
    said = {}
    for source in (PHANTOM, FABRIC):
        rates = rates_with(source)
        result = detector_sections.result_of(rates, detector, Lead(detector, True, 1.0, 1), 1)
        ours = detector_sections.answers_of(rates, detector, "leave_one_out")
        texts = [str(card) for card in result["cards"]]
        texts += [cards.summary("mixed", ours, detector), trust.trust_words(ours)]
        said[source] = " ".join(texts)
        if source == FABRIC:
            assert {card["answer"] for card in result["cards"]} == {"not shown"}
            assert {card["value"] for card in result["cards"]} == {None}
            assert "whether there is a nodule follows from the source" in texts[-2]
            assert texts[-1] == (
                "These recordings cannot show how far to trust a verdict: among those that teach, "
                "whether there is a nodule follows from the source."
            )
            # The counts stay.
            assert "1 mm: 100 % (94 to 100 %), 60 of 60" in said[source]
    assert "reliably" in said[PHANTOM] and "1 mm and larger" in said[PHANTOM]
    assert "reliab" not in said[FABRIC].casefold() and "and larger" not in said[FABRIC]


def test_held_out_recordings_and_an_index_without_the_columns_warn_of_nothing():
    rates = rates_with(PHANTOM)
    assert rates.confounded == []
    assert not {"unit", "rate_hz"} & set(rates.index)
    (found,) = rates_with(PHANTOM, unit=["counts"] * 60 + ["V"] * 120).confounded
    assert (found.key, found.counts["counts"]) == ("unit", Counter({0.0: 60}))
