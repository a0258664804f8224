"""Several passes over one site: one verdict, with a threshold learned from other sites."""

import numpy as np
import pandas as pd
import pytest

from capsule.detectors.familiar import Familiarity
from capsule.evaluation.columns import SITES
from capsule.evaluation.sites import detections_by_passes, site_table, site_verdicts

UNKNOWN = float("nan")
OF_A_PASS = ("score", "estimate_mm", "location_mm", "estimate_low_mm", "estimate_high_mm")


def passes(size_mm, *scores, estimates=None, locations=None, low=None, high=None):
    """Make the passes over a site; the size is None if it is not known."""
    parts = (scores, estimates, locations, low, high)
    columns = {
        name: UNKNOWN if part is None else part for name, part in zip(OF_A_PASS, parts, strict=True)
    }
    return pd.DataFrame(
        {"size_mm": UNKNOWN if size_mm is None else size_mm, **columns}, dtype=float
    )


def by_site(sites):
    """Return passes over sites; a key may name the site with a mark that is cut off."""
    return pd.concat([each.assign(site=key.partition("#")[0]) for key, each in sites.items()])


def verdicts_of(sites, specificity, detector="diagonal"):
    """Return the verdicts by the key of the site."""
    verdicts = site_verdicts(by_site(sites).reset_index(), detector, specificity)
    return dict(zip(sites, verdicts.to_dict("records"), strict=True))


def detected_at(sites, count, detector="diagonal"):
    """Return the sizes of the sites, and what is detected there by their first passes."""
    verdicts = detections_by_passes(by_site(sites).reset_index(), detector, count, 0.9)
    return [verdicts[name].tolist() for name in ("size_mm", "detected")]


def table_of(verdicts, sites, specificity):
    index = {name: {"site": site} for name, site in sites.items()}
    rules = {"schemes": ["leave_one_out"], "specificity": specificity}
    return site_table(verdicts.assign(scheme="leave_one_out"), [], index, rules)


UNKNOWN_KIND = Familiarity(None).cells
UNTOLD = dict.fromkeys(OF_A_PASS[1:], UNKNOWN) | UNKNOWN_KIND
HEALTHY = {f"h{place}": passes(0.0, place, place + 0.2) for place in range(9)}


TWO, THREE = passes(None, 1.0, 1.0), passes(None, 1.0, 1.0, 1.0)
ONE_HIGH = {f"h{place}": passes(0.0, 1.0 * place, 0.0, 0.0) for place in range(4)}
BOTH = {f"h{place}": passes(0.0, place, place) for place in range(3)}
BOTH |= {"h2#2": passes(2.0, 1.5, 1.5), "h2#?": passes(None, 1.5, 1.5)}
RULE = {"a": passes(0.0, -1.0, 0.5), "b": passes(1.0, -1.0, 1.5)}
NODULE = {"single": passes(0.0, 100.0), "n": passes(2.0, 8.0, 10.0)}


@pytest.mark.parametrize(
    ("sites", "detector", "specificity", "key", "threshold", "detected"),
    [
        # Of 10 healthy places the threshold is the mean of rank 9, that of h8. The mean of a
        # healthy site does not teach its own threshold: of the 9 others the rank is 8.
        (HEALTHY | NODULE, "diagonal", 0.8, "n", 8.1, True),
        (HEALTHY | NODULE, "diagonal", 0.8, "h0", 8.1, False),
        (HEALTHY | NODULE, "diagonal", 0.8, "h8", 7.1, True),
        # Each mean is over as many passes as were made: (2 + 0) / 2.
        (ONE_HIGH | {"n": TWO}, "diagonal", 0.5, "n", 1.0, False),
        (ONE_HIGH | {"n": THREE}, "diagonal", 0.5, "n", 2 / 3, True),
        # The healthy passes over a site teach none of its passes.
        (BOTH, "diagonal", 0.95, "h2", 1.0, True),
        (BOTH, "diagonal", 0.95, "h2#2", 1.0, True),
        (BOTH, "diagonal", 0.95, "h2#?", 1.0, True),
        (BOTH, "diagonal", 0.95, "h0", 2.0, False),
        # The paper's threshold stays 0.
        (RULE, "template", 0.9, "a", 0.0, False),
        (RULE, "template", 0.9, "b", 0.0, True),
        # Without a healthy site, or without a score, nothing is said.
        ({"n": passes(3.0, 9.0, 8.0)}, "diagonal", 0.9, "n", UNKNOWN, None),
        (HEALTHY | {"n": passes(3.0, UNKNOWN)}, "diagonal", 0.5, "n", None, None),
    ],
)
def test_a_site_is_judged_by_the_mean_of_its_passes_against_means_of_as_many(
    sites, detector, specificity, key, threshold, detected
):
    verdict = verdicts_of(sites, specificity, detector)[key]
    assert verdict["detected"] is detected
    assert verdict["passes"] == sites[key]["score"].count()
    if verdict["passes"]:
        assert verdict["score"] == pytest.approx(sites[key]["score"].mean())
        assert verdict["threshold"] == pytest.approx(threshold, nan_ok=True)


def test_sizes_and_locations_are_those_of_the_passes_that_found_it():
    found = passes(
        3.0,
        *(9.0, 0.0, 9.0),
        estimates=[3.0, UNKNOWN, 4.0],
        locations=[5.0, UNKNOWN, 9.0],
        low=[2.0, UNKNOWN, 3.5],
        high=[3.5, UNKNOWN, 5.0],
    )
    verdict = verdicts_of(HEALTHY | {"n": found}, 0.5)["n"]
    assert [verdict[name] for name in OF_A_PASS[1:]] == [3.5, 7.0, 2.75, 4.25]
    # A site whose mean is below the threshold has neither.
    quiet = found.assign(score=found["score"] - 9)
    overruled = verdicts_of(HEALTHY | {"n": quiet}, 0.5)["n"]
    assert overruled["detected"] is False
    assert np.isnan([overruled[name] for name in OF_A_PASS[1:]]).all()


def test_the_first_passes_over_every_place_are_judged_together():
    sites = {
        "h1": passes(0.0, 0.0, 0.4, 9.0),
        "h2": passes(0.0, 0.3, 0.1),
        "h3": passes(0.0, 0.9),
        "n1": passes(1.0, 0.1, 0.9),
    }
    # h3 was passed only once.
    assert detected_at(sites, 2) == [[0, 0, 1], [False, False, True]]
    # If one pass has no verdict, the other one counts.
    partly = sites | {"h1": passes(0.0, UNKNOWN, 0.4)}
    assert detected_at(partly, 2)[1] == [True, False, True]
    shifted = {key: each.assign(score=each["score"] - 0.15) for key, each in sites.items()}
    assert detected_at(shifted, 2, "template")[1] == [True, True, True]


def test_a_site_without_a_verdict_is_not_detected():
    sites = HEALTHY | {"n": passes(2.0, 30.0), "silent": passes(2.0, UNKNOWN)}
    true_mm, detected = detected_at(sites, 1)
    assert (true_mm[-2:], detected[-2:]) == ([2.0, 2.0], [True, False])
    # No healthy site was passed three times: nothing can be judged by three passes.
    few = HEALTHY | {"n": passes(2.0, 30.0, 30.0, 30.0)}
    assert detected_at(few, 3) == [[], []]


@pytest.mark.parametrize("names", [["2mm/a", "2mm/b", "2mm/c"], ["2mm/z", "2mm/b", "2mm/a"]])
def test_passes_come_in_the_order_of_the_sites_whatever_they_are_called(names):
    # The threshold of a site with two passes is the mean of the first two of the healthy site.
    sites = dict.fromkeys(names, "p") | {"3mm/y": "q", "3mm/x": "q"}
    verdicts = pd.DataFrame({"recording": list(sites), "size_mm": [0.0] * 3 + [3.0] * 2})
    verdicts = verdicts.assign(detector="diagonal", score=[0.0, 1.0, 5.0, 2.0, 2.0], **UNTOLD)
    table = table_of(verdicts.sort_values("recording"), sites, 0.5)
    assert table["threshold"][table["site"] == "q"].tolist() == [0.5]


def test_verdicts_are_sorted_by_detector_label_and_the_place_that_the_recordings_name():
    sites = {"0mm/a": "", "0mm/b": "", "2mm/a": "p", "2mm/b": "p", "unlabelled/c": "p"}
    predictions = [
        {"recording": name, "detector": detector, "size_mm": float(name[0]), "score": score}
        | UNTOLD
        | {"estimate_mm": 2.0, "estimate_low_mm": 1.5, "estimate_high_mm": 2.25}
        for detector in ("template", "diagonal")
        for score, name in enumerate(list(sites)[:4])
    ]
    # Without a label, as in detections.csv, it is not a pass over the labelled site.
    unlabelled = dict(predictions[-1], recording="unlabelled/c")
    del unlabelled["size_mm"]
    # A site that was passed once is not listed, but teaches.
    made = table_of(pd.DataFrame([*predictions, unlabelled]), sites, 0.6)
    by_rule, by_threshold = made.to_dict("records")
    assert list(made) == SITES
    assert (by_rule["detector"], by_threshold["detector"]) == ("template", "diagonal")
    assert (by_rule["site"], by_rule["size_mm"], by_rule["recordings"]) == ("p", 2.0, 2)
    # The mean of the scores 2 and 3; the rule's own threshold is 0, the other is a healthy score.
    assert (by_rule["score"], by_rule["threshold"], by_threshold["threshold"]) == (2.5, 0.0, 1.0)
    assert (by_rule["estimate_low_mm"], by_rule["estimate_high_mm"]) == (1.5, 2.25)


def test_a_place_is_strange_if_a_pass_is_and_says_which():
    kinds = {
        "unlabelled/a": ("yes", ""),
        "unlabelled/b": ("no", "noise"),
        "unlabelled/c": ("yes", ""),
        "unlabelled/d": ("yes", ""),
        "unlabelled/e": ("", "too_few_places"),
        "unlabelled/f": ("", "too_few_places"),
    }
    sites = dict(zip(kinds, "ppqqrr", strict=True))
    predictions = [
        {"recording": name, "detector": "template", "size_mm": UNKNOWN, "score": 1.0, **UNTOLD}
        | {"familiar": answer, "unfamiliar_because": traits}
        for name, (answer, traits) in kinds.items()
    ]
    table = table_of(pd.DataFrame(predictions), sites, 0.9)
    found = table.set_index("site").to_dict("index")
    assert {site: row["familiar"] for site, row in found.items()} == {
        "p": "no",
        "q": "yes",
        "r": "",
    }
    columns = ["recording", "detector", "size_mm", "score", *UNTOLD]
    assert table_of(pd.DataFrame(columns=columns), {}, 0.9).empty
    strange = found["p"]["unlike_recording"], found["p"]["unfamiliar_because"]
    assert strange == ("unlabelled/b", "noise")
    assert pd.isna([found[site]["unlike_recording"] for site in "qr"]).all()
