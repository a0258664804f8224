"""The paper's printed numbers, and the counts that follow from them."""

import numpy as np
import pandas as pd
import pytest

from capsule.evaluation import paper
from capsule.evaluation.columns import RATES
from capsule.evaluation.intervals import rate
from capsule.evaluation.measures import measure_tables
from support.evaluated import evaluated, read_paper
from support.paper import LIKE_THE_PAPER
from support.verdicts import verdicts


@pytest.fixture(scope="module")
def tables():
    """Return the printed tables, and those of verdicts that give every printed number."""
    printed = read_paper()
    pairs = [pair for pair, runs in np.ndenumerate(LIKE_THE_PAPER) for _ in range(runs)]
    rules = {"tolerance_mm": 1.0, "confidence": 0.95}
    ours = measure_tables(verdicts(pairs, "paper", "paper"), np.arange(6.0), rules, names=RATES)
    return paper.printed_tables(printed, 0.95), ours, printed


def test_the_printed_rates_are_those_of_verdicts_counted_by_our_definitions(tables):
    found, ours, printed = tables
    pd.testing.assert_frame_equal(found["detection"], ours["detection"])
    pd.testing.assert_frame_equal(found["confusion"], ours["confusion"].query("size_mm == 0"))
    none, *nodules = found["detection"].to_dict("records")
    for said, row in zip(printed["detection"], nodules, strict=True):
        for name in ("precision", "recall"):
            assert round(100 * row[name], 1) == said[f"{name}_percent"]
    assert [(row["tp"], row["fp"], row["fn"]) for row in nodules[:2]] == [(15, 11, 5), (17, 3, 3)]
    # The specificity, which the paper does not print. Eight of 14 verdicts of no nodule are wrong.
    names = ("tp", "fn", "fp", "precision", "recall_at_least")
    assert [none[name] for name in names] == [6, 14, 8, 6 / 14, rate(6, 20, 0.9)[1]]
    assert [none[f"recall{end}"] for end in ("", "_low", "_high")] == list(rate(6, 20, 0.95))


def test_of_the_papers_sizes_the_rates_are_known_and_the_errors_are_not(tables):
    found, ours, printed = tables
    # Of all sizes together, and of 1 mm, nothing is printed.
    sized = ours["sizing"].dropna(subset="size_mm").iloc[1:].reset_index(drop=True)
    rates = ["size_mm", "recordings", "clusters", "one_sided", "exact", "within"]
    rates += [f"{name}_rate{end}" for name in rates[-2:] for end in ("", "_low", "_high")]
    pd.testing.assert_frame_equal(found["sizing"][rates], sized[rates], check_dtype=False)
    assert found["sizing"].drop(columns=["detector", "scheme", *rates]).isna().all(axis=None)
    for name in ("exact", "within"):
        said = [row[f"{name}_percent"] for row in printed["sizing"]]
        assert (100 * found["sizing"][f"{name}_rate"]).tolist() == pytest.approx(said)


def judged(*pairs):
    """Return the evaluation of verdicts with templates of none, 2 and 6 mm."""
    triples = [(f"{true:g}mm/{number}", true, said) for number, (true, said) in enumerate(pairs)]
    return evaluated(triples, (0.0, 2.0, 6.0), ["diagonal"], "held_out")


def counts(points, size_mm):
    """Return hits and number of recordings by measure."""
    of_size = points[points["size_mm"] == size_mm].set_index("measure")
    return {name: tuple(row) for name, row in of_size[["hits", "of"]].iterrows()}


def test_a_point_holds_the_rate_and_the_counts_behind_it():
    # Of 2 mm, three of four are found, two of them of the right size; a healthy one is called.
    ours = judged((0, 0), (0, 0), (0, 2), (2, 2), (2, 2), (2, 6), (2, 0))
    detected = paper.detection_points(ours.tables["detection"])
    assert counts(detected, 2.0) == {"precision": (3, 4), "recall": (3, 4)}
    assert counts(detected, 6.0) == {"precision": (0, 0), "recall": (0, 0)}
    sized = paper.sizing_points(ours.tables["sizing"])
    # Of no nodule and of any, other points tell.
    assert set(detected["size_mm"]) == set(sized["size_mm"]) == {2.0, 6.0}
    assert counts(sized, 2.0) == {"exact_rate": (2, 4), "within_rate": (2, 4)}
    none = paper.negative_points(ours.tables["confusion"])
    assert counts(none, 0.0) == {"classified": (2, 3)}
    assert counts(none, 2.0) == {"classified": (1, 3)}
    for points in (detected, sized, none):
        known = points[points["of"] > 0]
        assert known["rate"].tolist() == pytest.approx((known["hits"] / known["of"]).tolist())
        assert (known["low"] <= known["rate"]).all() and (known["rate"] <= known["high"]).all()
    # Both sizes are at an end of the templates, which only the tolerance can pass.
    assert set(sized.loc[sized["one_sided"], "measure"]) == {"within_rate"}
    assert not detected["one_sided"].any() and not none["one_sided"].any()
    # An evaluation knows its detectors and its sizes; of none, the paper's stands for all.
    assert (ours.detectors(), ours.sizes_mm()) == (["diagonal"], [0.0, 2.0, 6.0])
    assert judged().detectors() == ["template"]
    # Without a healthy recording, no verdict on one is shown.
    assert paper.negative_points(judged((2, 2)).tables["confusion"]).empty
