"""The cards of the first screen: which verdict stands first, and what each says."""

import pandas as pd
import pytest

from capsule import words
from capsule.detectors.familiar import Familiarity
from capsule.evaluation.answers import Estimate
from capsule.evaluation.archive_rates import Lead
from capsule.page import cards
from capsule.page.packing import inflated
from capsule.page.sketches import felt_sketch, score_strip, size_chart
from support.evaluated import index_of
from support.sections import section
from support.stored import Described

NAN = float("nan")
ROW = {"score": 2.0, "threshold": 1.0, "probability": 0.9, "estimate_mm": 2.5, "no_verdict": ""}
ROW |= {"estimate_low_mm": 1.8, "estimate_high_mm": 3.2, "location_s": 13.6, "location_mm": 6.0}
ROW |= {"familiar": "yes", "unfamiliar_because": ""}


# How the rows of patients differ from that of a nodule.
CHANGES = {
    "passed": {},
    "quiet": {"score": 0.5, "probability": 0.01},
    "strange": Familiarity(False, ("noise", "step_s"), 0.5, 0.1, 0.2).cells,
    "doubtful": {"probability": 0.07},
    "likely": {"probability": 0.8},
    "sure": {},
}


@pytest.fixture(scope="module")
def patients():
    """Return the cards of all patients in their order; "passed" is that of a place."""
    verdicts = {
        f"unlabelled/{name}": [ROW | {"detector": each} | of for each in ("taught", "diagonal")]
        for name, of in CHANGES.items()
    }
    usual = [[name, NAN, "accepted", NAN, "", "aa", 70.0] for name in verdicts]
    bad = ["unlabelled/bad", NAN, "rejected", "the file is empty", "", NAN, NAN]
    index = index_of(*usual, bad)
    index["site"] = index["recording"].map({"unlabelled/passed": "place"})
    place = {"site": "place", "size_mm": NAN, "passes": 2, "detector": "taught", **ROW}
    sites = pd.DataFrame([place | {"probability": NAN}])
    described = {name: {"quality": ""} for name in verdicts}
    described["unlabelled/passed"] = {"quality": "sensor 2 is loose"}
    made = cards.patient_cards(index, verdicts, sites, "taught", described)
    return {card["patient"]: card for card in made}


def test_the_most_urgent_patient_stands_first_before_it_a_place_by_all_its_passes(patients):
    order = ["place", "sure", "likely", "doubtful", "strange", "bad", "quiet"]
    assert list(patients) == order
    place = patients["place"]
    assert (place["names"], place["passes"]) == (["unlabelled/passed"], 2)
    assert place["quality"] == "sensor 2 is loose"
    assert patients["sure"]["passes"] == 0


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("place", "2 passes together."),
        ("sure", "Nodule, 2.5 mm <small>(1.8 to 3.2)</small>"),
        ("sure", "6 mm from the start (13.6 s). Probability 90 %. Both detectors agree."),
        ("sure", "Each sensor in turn was pressed 2.0 times as deep as usual."),
        ("sure", "None of 3 healthy recordings"),
        ("doubtful", "Uncertain: pass again"),
        ("doubtful", "the probability is 7 %. If a nodule: 2.5 mm, 6 mm from the start"),
        ("doubtful", "1 of 3 healthy recordings exceed the threshold too; none"),
        ("quiet", '<p class="verdict">No nodule</p>'),
        ("strange", "a reading bends by 50.0 % of a wave's depth, but 10.0 to"),
        ("strange", "; 1 other trait deviates too. Judged all the same: a nodule."),
        ("bad", "Rejected: the file is empty."),
    ],
)
def test_a_card_says_what_to_do_and_why(patients, name, words):
    drawn = cards.with_sketches(patients[name], Described(), [0.1, 0.2, 1.5], [3.0])
    page = {"cards": [drawn], "lead": Lead("taught", False, NAN, 2), "most_listed": 20}
    page |= {"verdict_counts": [], "prevalence": "10 %", "largest_mm": 5.0, "pressed": 1.25}
    assert words in " ".join(section("cards", **page, most_cards=6).split())


def test_a_nodule_has_a_diagonal_and_a_healthy_patient_has_none():
    felt = inflated(Described()["a"]["drawn"])
    assert felt_sketch(felt, diagonal=False)["passed"] == []
    sketch = felt_sketch(felt, diagonal=True)
    for row, (_, top) in zip(sketch["rows"], sketch["passed"], strict=True):
        # A sensor passes the place at its bump, which stands on its usual depth.
        heights = [float(point.split()[1]) for point in row["line"][1:].split("L")]
        assert (min(heights), max(heights)) == (top, row["base"])
    # A row is 32 high, and the deepest bump fills 85 % of it.
    bases = [row["base"] for row in sketch["rows"]]
    assert bases == [40.4, 72.4, 104.4, 136.4]
    assert [top for _, top in sketch["passed"]] == pytest.approx([each - 27.2 for each in bases])
    # A sensor that passes the place after the end leaves no diagonal.
    felt["beats"]["passed_s"][3] = 1000.0
    assert felt_sketch(felt, diagonal=True)["passed"] == []


def test_a_share_of_nodules_found_stands_at_its_height_between_its_bounds():
    found = {"ours": {2.0: Estimate(0.5, 0.25, 1.0)}, "paper": {1.0: Estimate(1.0, 1.0, 1.0)}}
    chart = size_chart(found, [1.0, 2.0])
    assert chart["grid"] == [(12.0, 100), (91.0, 50), (170.0, 0)]
    assert chart["sizes"] == [(123.0, "1 mm"), (281.0, "2 mm")]
    ours, paper = chart["series"]
    assert ours["points"] == [(275.5, 91.0, 130.5, 12.0)]
    assert paper["points"] == [(128.5, 12.0, 12.0, 12.0)]
    assert (ours["texts"][0], paper["texts"][1]) == (words.NOT_GIVEN, words.NOT_GIVEN)


def test_scores_stand_in_the_order_of_their_values():
    strip = score_strip([1.0], [3.0], 2.0, 4.0)
    assert strip["threshold"] < strip["this"]
    # The least score stands at the left end.
    assert float(strip["marks"][0].partition("M")[2].split()[0]) < strip["threshold"]
