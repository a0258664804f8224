"""The answers in values and in words: a size counts as found only with every larger one."""

from dataclasses import replace

import pandas as pd
import pytest

from capsule.evaluation.columns import RATES
from capsule.evaluation.intervals import rate
from capsule.evaluation.lead import Lead
from capsule.evaluation.paper import Evaluation
from capsule.page import answers, detector_sections
from capsule.page.answers import answers_of, paper_answers
from support.evaluated import SETTINGS, UNKNOWN, evaluated, index_of, rates_of
from support.sections import cards_of, section, summary


def found(*rates):
    """Return how often each size is found, from triples: size, lower bound, number."""
    return {
        size: answers.Estimate(1.0, bound, 1.0, 1, of, at_least=bound) for size, bound, of in rates
    }


@pytest.mark.parametrize(
    ("bounds", "specificity", "expected"),
    [
        ([(1, 0.6, 20), (2, 0.85, 20), (3, 0.88, 20)], 0.86, 2.0),
        ([(1, 0.9, 20), (2, 0.5, 20), (3, 0.9, 20)], 0.85, 3.0),
        ([(1, 0.9, 20), (2, 0.84, 20)], 0.9, None),
        ([(1, UNKNOWN, 20), (2.5, 0.9, 20)], 0.9, 2.5),
        ([(1, UNKNOWN, 20)], 0.9, None),
        ([(1, 0.9, 20), (2, 0.9, 20)], 0.84, None),
        ([(1, 0.9, 20), (2, 0.9, 20)], UNKNOWN, None),
        ([], 0.9, None),
    ],
)
def test_reliable_is_a_size_from_which_on_all_are_found(bounds, specificity, expected):
    assert answers.smallest_reliable_size(found(*bounds), specificity, 0.85) == expected


def test_the_lower_bound_makes_a_size_reliable_and_not_the_estimate():
    nodules = [(f"2mm/{run}", 2.0, 2.0 if run else 0.0) for run in range(20)]
    healthy = [(f"0mm/{run}", 0.0, 0.0) for run in range(40)]
    # 19 of 20 are 95 %, but with a lower bound of 80.4 %.
    one_missed = answers_of(rates_of(evaluated(nodules + healthy)), "template", "leave_one_out")
    assert one_missed.found[2.0].value == 0.95
    assert one_missed.found[2.0].at_least == pytest.approx(0.804, abs=0.001)
    assert one_missed.smallest_mm is None
    all_found = [(name, size, 2.0) for name, size, _ in nodules]
    answer = answers_of(rates_of(evaluated(all_found + healthy)), "template", "leave_one_out")
    assert answer.smallest_mm == 2.0


def test_so_many_recordings_can_show_that_a_size_is_reliably_found():
    for level in (0.8, 0.85, 0.9):
        needed = answers.recordings_to_show(level)
        assert rate(needed, needed, 0.9)[1] >= level > rate(needed - 1, needed - 1, 0.9)[1]
    assert answers.recordings_to_show(0.85) == 16


def test_a_threshold_sets_the_specificity_and_promises_what_it_can():
    healthy = [(f"0mm/{run}", 0.0, 0.0) for run in range(20)]
    enough = answers.set_specificity(rates_of(evaluated(healthy)), "leave_one_out")
    # Beta(20, 1): the roots of 5 and 95 %.
    assert (enough.low, enough.high) == pytest.approx((0.05**0.05, 0.95**0.05))
    assert (enough.places, enough.least_places) == (20, 19)
    assert rate(0.95 * enough.needed, enough.needed, 0.95)[2] - rate(
        0.95 * enough.needed, enough.needed, 0.95
    )[1] == pytest.approx(0.1, abs=0.001)
    without = rates_of(evaluated([("2mm/a", 2.0, 2.0)]))
    assert answers.set_specificity(without, "leave_one_out") is None


def test_where_the_threshold_sets_the_specificity_the_predictive_values_follow_from_it():
    verdicts = [(f"0mm/{run}", 0.0, 0.0 if run else 2.0) for run in range(20)]
    verdicts += [(f"2mm/{run}", 2.0, 2.0 if run % 10 else 0.0) for run in range(20)]
    rates = rates_of(evaluated(verdicts, (0.0, 2.0), ("template", "diagonal")))
    learned = answers_of(rates, "diagonal", "leave_one_out")
    assert learned.set_specificity.places == 20
    # 90 % of the nodules are found; of 1000 places 100 have one: 90 right, 45 false detections.
    assert learned.meaning[0].value == pytest.approx(90 / 135)
    low = 0.09 / (0.09 + 0.9 * (1 - learned.set_specificity.low))
    assert learned.meaning[0].low == pytest.approx(low)
    fixed = answers_of(rates, "template", "leave_one_out")
    assert fixed.set_specificity is None and fixed.specificity.value == 0.95
    (row,) = (
        rates.of("template", "leave_one_out")["predictive_values"]
        .query("size_mm.isna()")
        .to_dict("records")
    )
    assert fixed.meaning[0].low == row["ppv_low"]
    held_out = rates_of(evaluated(verdicts, (0.0, 2.0), ("diagonal",), "held_out"))
    assert answers_of(held_out, "diagonal", "held_out").set_specificity is None


def test_the_papers_false_alarms_leave_no_size_reliably_found():
    paper = evaluated([]).paper
    settings = {"evaluation": {"confidence": 0.95, "tolerance_mm": 1.0}}
    settings["report"] = {"reliable_rate": 0.85}
    told = paper_answers(paper, sizing(), settings, 1)
    assert told["found"] == "none, by the same rule"
    assert told["specificity"].startswith("30 % (")
    # The one-sided bounds of 30 % of 20 and of 75 % of 20.
    settings["report"] = {"reliable_rate": 0.16}
    assert paper_answers(paper, sizing(), settings, 1)["found"].startswith("1 mm and larger")


def test_within_tolerance_pools_counts():
    sizing = pd.DataFrame({"size_mm": [1, 2, 3], "within": [1, 8, 9], "recordings": [10, 10, 10]})
    assert answers.within_tolerance(sizing, 0.95).value == 0.6
    assert answers.within_tolerance(sizing, 0.95, [2, 3]).value == 0.85
    assert answers.within_tolerance(sizing, 0.95, [7]).of == 0


def sizing(*sizes_mm):
    rows = {"size_mm": sizes_mm, "within": [9] * len(sizes_mm), "recordings": [10] * len(sizes_mm)}
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("sizes_mm", "end"),
    [
        ((1, 2, 3), "; here over the same sizes 90 %"),
        ((2, 3), "; here over the same sizes 90 %"),
        ((1, 3), "; this archive lacks some of these sizes"),
        ((), "; this archive lacks some of these sizes"),
    ],
)
def test_ours_is_compared_with_the_paper_only_over_all_of_its_sizes(sizes_mm, end):
    paper = {"sizing": sizing(3, 2), "detection": pd.DataFrame({"tp": [], "fn": [], "size_mm": []})}
    paper["specificity"] = pd.DataFrame()
    settings = {"evaluation": {"confidence": 0.95, "tolerance_mm": 1.0}}
    settings["report"] = {"reliable_rate": 0.85}
    assert paper_answers(paper, sizing(*sizes_mm), settings, 1)["within"].endswith(
        f"2 and 3 mm{end}"
    )
    other = paper_answers(paper, sizing(*sizes_mm), settings, 2)["within"]
    assert other.endswith("2 and 3 mm, with another tolerance")


def archive(healthy=20, false_alarms=1, missed=0, size_mm=2.0, of=20):
    verdicts = [(f"0mm/{n}", 0.0, size_mm if n < false_alarms else 0.0) for n in range(healthy)]
    return verdicts + [(f"2mm/{n}", size_mm, 0.0 if n < missed else size_mm) for n in range(of)]


def test_held_out_recordings_are_counted_and_called_so():
    rates = rates_of(evaluated(archive(60, 3, 2), (0.0, 2.0), ("diagonal",), "held_out"))
    ours = answers_of(rates, "diagonal", "held_out")
    assert summary("simulated", ours, "diagonal") == (
        "On 80 held-out simulated recordings (60 without a nodule and 20 with one), which taught "
        "nothing and chose nothing, the detector diagonal found 18 of 20 nodules. It reported a "
        "nodule in 3 of 60 recordings without one."
    )
    card = cards_of(rates, "diagonal")["specificity"]
    assert (card["answer"], card["value"]) == ("95 %", 0.95)
    assert card["detail"] == (
        "86.3 to 98.3 %; 57 of 60 held-out recordings without a nodule have this verdict, for "
        "further runs of these set-ups."
    )


def test_rates_over_recordings_unlike_those_that_teach_say_so():
    evaluation = evaluated(archive(60, 3, 2), (0.0, 2.0), ("diagonal",), "held_out")
    familiar = ["no" if number < 7 else "yes" for number in range(80)]
    because = ["noise" if each == "no" else UNKNOWN for each in familiar]
    predictions = evaluation.predictions.assign(familiar=familiar, unfamiliar_because=because)
    rates = rates_of(replace(evaluation, predictions=predictions))
    ours = answers_of(rates, "diagonal", "held_out")
    assert summary("simulated", ours, "diagonal").endswith(
        " Unlike the recordings that teach: 7 of 80; the rates include them."
    )


def test_a_specificity_that_the_threshold_sets_is_never_told_as_measured():
    rates = rates_of(evaluated(archive(), (0.0, 2.0), ("template", "diagonal")))
    ours = answers_of(rates, "diagonal", "leave_one_out")
    assert "is not measured: its threshold is set for 5 %." in summary("", ours, "diagonal")
    card = cards_of(rates, "diagonal")["specificity"]
    assert (card["answer"], card["value"]) == ("set to 95 %", None)
    assert card["detail"] == (
        "By the threshold, not measured. The threshold rests on 20 healthy places. New places of "
        "this bench may expect a specificity of 86.1 to 99.7 % (central 90 %; approximate, "
        "because scores are cross-validated). Of a new patient, only held-out set-ups tell. To "
        "measure it to ±5 points takes 83 held-out healthy recordings."
    )
    # The paper's own rule learns no threshold.
    assert cards_of(rates, "template")["specificity"]["answer"] == "95 %"


def test_with_fewer_than_19_healthy_places_95_percent_are_not_promised():
    rates = rates_of(evaluated(archive(healthy=18), (0.0, 2.0), ("diagonal",)))
    card = cards_of(rates, "diagonal")["specificity"]
    told = "95 % cannot be promised: this takes 19 healthy places, and this archive has 18."
    assert told in card["detail"]
    # Also where the detectors are compared, since the leading one may have a fixed threshold.
    lead = Lead("template", True, 0.9, 1)
    threshold = detector_sections.page_values(rates, lead, 1)["threshold"]
    assert threshold.cannot() and told in threshold.text()
    assert card["answer"] == "aims at 95 %"
    ours = answers_of(rates, "diagonal", "leave_one_out")
    assert ours.set_specificity.mean == 18 / 19
    assert "its threshold is meant for 5 %." in summary("", ours, "diagonal")


def test_passes_over_one_place_count_once():
    verdicts = archive(healthy=24)
    rows = [[name, size, "accepted", UNKNOWN, "bench", "aa", 70.0] for name, size, _ in verdicts]
    index = index_of(*rows)
    index["site"] = [f"place {n // 2}" if n < 24 else None for n in range(44)]
    index.loc[0, "near_copies"] = "0mm/2"
    rates = rates_of(evaluated(verdicts, (0.0, 2.0), ("diagonal",)), index=index)
    ours = answers_of(rates, "diagonal", "leave_one_out")
    assert ours.set_specificity.places == 11


def test_each_size_stands_with_its_interval_and_few_recordings_show_nothing():
    card = cards_of(rates_of(evaluated(archive(60, 1, 0, of=6), (0.0, 2.0))), "template")["found"]
    assert card["lines"] == ["2 mm: 100 % (61 to 100 %), 6 of 6"]
    assert card["answer"] == "none shown"
    assert (
        "6 recordings of a size cannot show this: it takes 16 places or set-ups, all of them found."
        in (card["detail"])
    )
    card = cards_of(rates_of(evaluated(archive(60, 1), (0.0, 2.0))), "template")["found"]
    assert (card["answer"], card["value"]) == ("2 mm and larger", 2.0)


def test_what_a_clinician_asks_stands_in_counts_of_100():
    card = cards_of(rates_of(evaluated(archive(60, 3, 2), (0.0, 2.0))), "template")["meaning"]
    # Sensitivity 90 %, specificity 95 %, prevalence 10 %.
    assert card["answer"] == "67 of 100"
    assert card["lines"][0].startswith("Of 100 detections, 67 are right (")
    assert card["lines"][1].startswith("Of 100 verdicts of no nodule, 98.8 are right (")
    assert card["detail"].startswith("If 10 % of the places examined have a nodule")


def test_the_interval_of_the_best_of_several_is_corrected_for_the_choice():
    rates = rates_of(evaluated(archive(), (0.0, 2.0), ("template", "diagonal")))
    chosen, named = (
        cards_of(rates, "template", lead=Lead("template", given, 0.9, 4))["found"]["lines"]
        for given in (False, True)
    )
    assert named == ["2 mm: 100 % (83.9 to 100 %), 20 of 20"]
    # At 1 - 0.05 / 4: n / (n + z^2) with z = 2.4977.
    assert chosen == ["2 mm: 100 % (76.2 to 100 %), 20 of 20"]


def test_every_answer_has_the_papers_beside_it():
    verdicts = [("0mm/a", 0.0, 0.0), ("2mm/a", 2.0, 2.0), ("3mm/a", 3.0, 3.0)]
    paper = cards_of(rates_of(evaluated(verdicts)), "template")
    assert paper["found"]["paper"] == "none, by the same rule"
    assert paper["specificity"]["paper"].startswith("30 % (14.5 to 51.9 %)")
    within = paper["within"]["paper"]
    assert within.startswith("81.2 %") and "lacks some of these sizes" in within
    assert not any(card["beside"] for card in paper.values())


def test_every_answer_of_another_detector_has_the_papers_own_detector_beside_it():
    verdicts = archive(5, 1, 2, of=4)
    both = rates_of(evaluated(verdicts, (0.0, 2.0), ("template", "diagonal")))
    beside = {name: card["beside"] for name, card in cards_of(both, "diagonal").items()}
    assert {name: text["Paper's detector here"] for name, text in beside.items()} == {
        "specificity": "80 % (37.6 to 96.4 %)",
        "found": "none shown",
        "meaning": "22 of 100",
        "within": "50 % (15 to 85 %)",
    }


def test_beside_held_out_sessions_stands_what_leave_one_out_says():
    parts = [
        evaluated(archive(60, 3), (0.0, 2.0), ("diagonal",), "held_out"),
        evaluated([(f"{name}x", *rest) for name, *rest in archive()], (0.0, 2.0), ("diagonal",)),
    ]
    joined = Evaluation(
        pd.concat([each.predictions for each in parts]),
        {name: pd.concat([each.tables[name] for each in parts]) for name in RATES},
        parts[0].paper,
    )
    rates = rates_of(joined)
    rates.index["session"] = [
        None if name.endswith("x") else "late" for name in rates.index["recording"]
    ]
    settings = {**SETTINGS, "evaluation": {**SETTINGS["evaluation"], "held_out": ["late"]}}
    rates = replace(rates, settings=settings)
    assert rates.schemes == ["held_out", "leave_one_out"]
    shown = cards_of(rates, "diagonal")
    assert shown["specificity"]["answer"] == "95 %"
    assert shown["specificity"]["beside"]["Leave-one-out"] == "set to 95 %, not measured"


@pytest.mark.parametrize(
    ("lead", "expected"),
    [
        (Lead("diagonal", False, 0.93, 4), "Of 4 detectors it finds most nodules on this "),
        (
            Lead("template", True, 0.605, 4),
            "The configuration names it (report.lead). It finds 60.5 % of the nodules at a "
            "specificity of 95 %.",
        ),
        (
            Lead("template", False, UNKNOWN, 0),
            "No other detector could be compared with it on this archive.",
        ),
    ],
)
def test_the_page_tells_why_a_detector_leads(lead, expected):
    assert section("lead", lead=lead, held_out=False, settings=SETTINGS).startswith(expected)


def test_the_page_tells_whether_what_it_shows_has_chosen_the_detector():
    lead = Lead("diagonal", False, 0.93, 4)
    for held_out, end in ((False, "corrected for the choice."), (True, "no part in this choice.")):
        told = section("lead", lead=lead, held_out=held_out, settings=SETTINGS)
        assert told.endswith(end)


def test_another_tolerance_is_told_and_not_compared():
    verdicts = [("0mm/a", 0.0, 0.0), *((f"{n}mm/a", float(n), float(n)) for n in range(2, 6))]
    rates = rates_of(evaluated(verdicts, (0.0, 2.0, 3.0, 4.0, 5.0)))
    for tolerance_mm, end in (
        (1, "; here over the same sizes 100 %"),
        (2, ", with another tolerance"),
    ):
        within = cards_of(rates, "template", tolerance_mm)["within"]
        assert within["paper"].endswith(f"over 2, 3, 4 and 5 mm{end}")


def test_without_a_healthy_recording_nothing_is_called_reliably_found():
    verdicts = [(f"{size}mm/{n}", float(size), float(size)) for size in (2, 3) for n in range(20)]
    rates = rates_of(evaluated(verdicts))
    ours = answers_of(rates, "template", "leave_one_out")
    text = summary("recorded", ours, "template")
    assert text.startswith("On 40 recordings (40 with one), the paper's detector found 40 of 40")
    assert "a detector that always reports a nodule finds all of them" in text
    smallest = cards_of(rates, "template")["found"]
    assert (smallest["answer"], smallest["value"]) == ("not known", None)
    assert "no false alarm can occur" in smallest["detail"]
