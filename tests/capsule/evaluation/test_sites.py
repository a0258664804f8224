"""Several passes over one site: one verdict, with a threshold learned from other sites."""

import numpy as np
import pandas as pd
import pytest

from capsule.detectors.familiar import Familiarity
from capsule.detectors.verdicts import VerdictWord
from capsule.evaluation.columns import SITES
from capsule.evaluation.sites import detections_by_passes, site_table, site_verdicts

UNKNOWN = float("nan")
OF_A_PASS = ("score", "estimate_mm", "location_mm", "estimate_low_mm", "estimate_high_mm")


def passes(size_mm, *scores, **columns):
    """Make the passes over a site; the size is None if it is not known."""
    made = dict.fromkeys(OF_A_PASS, UNKNOWN) | {"size_mm": size_mm, "score": scores} | columns
    return pd.DataFrame(made, dtype=float)


def by_site(sites):
    """Return passes over sites; a key may name the site with a mark that is cut off."""
    made = [each.assign(site=key.partition("#")[0]) for key, each in sites.items()]
    return pd.concat(made, ignore_index=True)


def verdict_of(sites, key, specificity, detector="diagonal"):
    verdicts = site_verdicts(by_site(sites), detector, specificity)
    return verdicts.iloc[[*sites].index(key)]


def table_of(verdicts, sites, specificity):
    index = {name: {"site": site} for name, site in sites.items()}
    rules = {"schemes": ["all"], "specificity": specificity}
    return site_table(verdicts.assign(scheme="all"), [], index, rules)


UNTOLD = dict.fromkeys(OF_A_PASS[1:], UNKNOWN) | Familiarity(None).cells
HEALTHY = {f"h{place}": passes(0.0, place, place + 0.2) for place in range(9)}
ALL = HEALTHY | {"single": passes(0.0, 100.0), "n": passes(2.0, 8.0, 10.0)}
ONE_HIGH = {f"h{place}": passes(0.0, 1.0 * place, 0.0, 0.0) for place in range(4)}
BOTH = {f"h{place}": passes(0.0, place, place) for place in range(3)}
BOTH |= {"h2#2": passes(2.0, 1.5, 1.5), "h2#?": passes(None, 1.5, 1.5)}
RULE = {"a": passes(0.0, -1.0, 0.5), "b": passes(1.0, -1.0, 1.5)}


def test_a_site_is_judged_by_the_mean_of_its_passes_against_means_of_as_many():
    for sites, detector, specificity, key, threshold, detected in (
        # Of 10 healthy places the threshold is the mean of rank 9, that of h8. The mean of a
        # healthy site does not teach its own threshold: of the 9 others the rank is 8.
        (ALL, "diagonal", 0.8, "n", 8.1, True),
        (ALL, "diagonal", 0.8, "h8", 7.1, True),
        # Each mean is over as many passes as were made: (2 + 0) / 2.
        (ONE_HIGH | {"n": passes(None, 1.0, 1.0)}, "diagonal", 0.5, "n", 1.0, False),
        (ONE_HIGH | {"n": passes(None, 1.0, 1.0, 1.0)}, "diagonal", 0.5, "n", 2 / 3, True),
        # The healthy passes over a site teach none of its passes.
        (BOTH, "diagonal", 0.95, "h2#2", 1.0, True),
        (BOTH, "diagonal", 0.95, "h2#?", 1.0, True),
        (BOTH, "diagonal", 0.95, "h0", 2.0, False),
        # The paper's threshold stays 0.
        (RULE, "template", 0.9, "b", 0.0, True),
        # Without a healthy site, or without a score, nothing is said.
        ({"n": passes(3.0, 9.0, 8.0)}, "diagonal", 0.9, "n", UNKNOWN, None),
        (HEALTHY | {"n": passes(3.0, UNKNOWN)}, "diagonal", 0.5, "n", None, None),
    ):
        verdict = verdict_of(sites, key, specificity, detector)
        assert verdict["detected"] is detected
        assert verdict["passes"] == sites[key]["score"].count()
        if verdict["passes"]:
            assert verdict["score"] == pytest.approx(sites[key]["score"].mean())
            assert verdict["threshold"] == pytest.approx(threshold, nan_ok=True)


def test_sizes_and_locations_are_those_of_the_passes_that_found_it():
    told = [[3.0, UNKNOWN, 4.0], [5.0, UNKNOWN, 9.0], [2.0, UNKNOWN, 3.5], [3.5, UNKNOWN, 5.0]]
    told = dict(zip(OF_A_PASS[1:], told, strict=True))
    # A site whose mean is below the threshold has neither.
    for lower, detected, expected in ((0, True, [3.5, 7.0, 2.75, 4.25]), (9, False, [UNKNOWN] * 4)):
        site = passes(3.0, 9.0 - lower, -lower, 9.0 - lower, **told)
        verdict = verdict_of(HEALTHY | {"n": site}, "n", 0.5)
        assert verdict["detected"] is detected
        np.testing.assert_equal(verdict[[*OF_A_PASS[1:]]].tolist(), expected)


ONCE_OR_MORE = {"h1": passes(0.0, 0.0, 0.4, 9.0), "h2": passes(0.0, 0.3, 0.1)}
ONCE_OR_MORE |= {"h3": passes(0.0, 0.9), "n1": passes(1.0, 0.1, 0.9)}
ONE_SILENT = HEALTHY | {"n": passes(2.0, 30.0), "silent": passes(2.0, UNKNOWN)}
HALF_SILENT = ONCE_OR_MORE | {"h1": passes(0.0, UNKNOWN, 0.4)}


def test_the_first_passes_over_every_place_are_judged_together():
    for sites, count, found in (
        # h3 was passed only once.
        (ONCE_OR_MORE, 2, {"h1": False, "h2": False, "n1": True}),
        # If one pass has no verdict, the other one counts.
        (HALF_SILENT, 2, {"h1": True, "h2": False, "n1": True}),
        (ONE_SILENT, 1, dict.fromkeys(ONE_SILENT, False) | {"h8": True, "n": True}),
        # No healthy site was passed three times: nothing can be judged by three passes.
        (HEALTHY | {"n": passes(2.0, 30.0, 30.0, 30.0)}, 3, {}),
    ):
        verdicts = detections_by_passes(by_site(sites), "diagonal", count, 0.9)
        assert dict(zip(verdicts["site"], verdicts["detected"], strict=True)) == found
        assert all(verdicts["size_mm"] == [sites[name]["size_mm"][0] for name in verdicts["site"]])


def test_sites_of_several_passes_are_listed_by_detector_and_label_and_say_which_pass_is_strange():
    sites = {"0mm/a": "", "0mm/b": "", "2mm/a": "p", "2mm/b": "p", "unlabelled/c": "p"}
    sites |= {"2mm/q": "q", "2mm/r": "q", "2mm/s": "r", "2mm/t": "r"}
    told = UNTOLD | {"estimate_mm": 2.0, "estimate_low_mm": 1.5, "estimate_high_mm": 2.25}
    made = pd.DataFrame({"recording": list(sites), "size_mm": 2.0, **told})
    made["size_mm"] = [0.0, 0.0, 2.0, 2.0, UNKNOWN, *[2.0] * 4]
    # Nobody tells of r; of q, both passes are familiar.
    made["familiar"] = ["", "", "yes", "no", "yes", "yes", "yes", "", ""]
    made.loc[3, "unfamiliar_because"] = "noise"
    scored = [made.assign(detector=name, score=range(9)) for name in ("template", "diagonal")]
    # The unlabelled pass is none over the labelled site; what was passed once teaches.
    table = table_of(pd.concat(scored), sites, 0.6)
    assert list(table) == SITES
    # The rule's own threshold is 0, the other is a healthy score.
    keys = [(name, site, at) for name, at in (("template", 0), ("diagonal", 1)) for site in "pqr"]
    assert table[["detector", "site", "threshold"]].values.tolist() == [[*key] for key in keys]
    assert table.iloc[0][["size_mm", "recordings", "score"]].tolist() == [2.0, 2, 2.5]
    assert table.iloc[0][["estimate_low_mm", "estimate_high_mm"]].tolist() == [1.5, 2.25]
    assert table["familiar"].tolist() == ["no", "yes", ""] * 2
    strange = table[["unlike_recording", "unfamiliar_because"]].dropna().values.tolist()
    assert strange == [["2mm/b", "noise"]] * 2
    assert table["verdict"].tolist()[:2] == [VerdictWord.UNLIKE, VerdictWord.NODULE]
    assert table_of(made.iloc[:0].assign(detector="", score=0.0), {}, 0.9).empty
    # Passes come in the order of the index, whatever they are called: the threshold of a site with
    # two passes is the mean of the first two of the healthy site.
    sites = dict.fromkeys(["2mm/z", "2mm/b", "2mm/a"], "p") | {"3mm/y": "q", "3mm/x": "q"}
    verdicts = pd.DataFrame({"recording": list(sites), "size_mm": [0.0] * 3 + [3.0] * 2})
    verdicts = verdicts.assign(detector="diagonal", score=[0.0, 1.0, 5.0, 2.0, 2.0], **UNTOLD)
    table = table_of(verdicts.sort_values("recording"), sites, 0.5)
    assert table["threshold"][table["site"] == "q"].tolist() == [0.5]
