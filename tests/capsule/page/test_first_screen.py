"""What a verdict means at each prevalence of the slider."""

from types import SimpleNamespace

from capsule.evaluation.answers import Estimate
from capsule.page.detector_sections import MOST_PREVALENT, meaning_values


# Kills: the ratio of the odds upside down, the wrong "no nodule" verdicts taken for the right ones.
def test_the_slider_says_what_follows_from_sensitivity_and_specificity():
    def right(prevalence, sensitivity=0.9, specificity=0.8):
        ill, healthy = prevalence, 1 - prevalence
        ppv = sensitivity * ill / (sensitivity * ill + (1 - specificity) * healthy)
        npv = specificity * healthy / (specificity * healthy + (1 - sensitivity) * ill)
        return ppv, npv

    ours = SimpleNamespace(meaning=[Estimate(share, share, 1.0, 0, 1) for share in right(0.1)])
    said = meaning_values(ours, 0.1)
    assert len(said["moved"]) == MOST_PREVALENT
    assert said["moved"][10] == {name: said[name] for name in ("ppv", "npv")}
    for percent in (1, 37, 60):
        ppv, npv = right(percent / 100)
        assert said["moved"][percent] == {
            "ppv": Estimate(ppv, ppv, 1.0, 0, 1).in_hundred(),
            "npv": Estimate(1 - npv, 0.0, 1 - npv, 0, 1).in_hundred(),
        }
