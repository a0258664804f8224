"""What a verdict means for a patient: predictive values at a stated prevalence."""

import numpy as np
from scipy.special import ndtri


def predictive_values(
    hits: int, nodules: int, rejections: int, healthy: int, prevalence: float, confidence: float
) -> dict[str, float]:
    """Give the probability that a verdict is right, at a stated prevalence.

    The prevalence of an archive is the experimenter's choice, so the values follow from
    sensitivity and specificity by Bayes' rule. The intervals are those of the log odds by the
    delta method, with half a recording added to each count (Mercaldo, Lau and Zhou 2007).

    Parameters
    ----------
    hits, nodules : int
        How many of how many nodules were detected.
    rejections, healthy : int
        In how many of how many healthy recordings none was.
    prevalence : float
        Share of nodules among those examined.
    confidence : float
        Level of the intervals.

    Returns
    -------
    dict
        ``ppv`` and ``npv``, each with ``_low`` and ``_high``; NaN without either kind.
    """
    names = [f"{name}{end}" for name in ("ppv", "npv") for end in ("", "_low", "_high")]
    if nodules == 0 or healthy == 0:
        return dict.fromkeys(names, float("nan"))
    sensitivity, specificity = hits / nodules, rejections / healthy
    z = ndtri(0.5 + confidence / 2)
    soft_hit = (hits + 0.5) / (nodules + 1)
    soft_rejection = (rejections + 0.5) / (healthy + 1)
    hit_spread, miss_spread = (1 - soft_hit) / soft_hit, soft_hit / (1 - soft_hit)
    alarm_spread = soft_rejection / (1 - soft_rejection)
    quiet_spread = (1 - soft_rejection) / soft_rejection
    positive = np.log(soft_hit / (1 - soft_rejection)) + _logit(prevalence)
    negative = np.log(soft_rejection / (1 - soft_hit)) - _logit(prevalence)
    reach_positive = z * np.sqrt(hit_spread / (nodules + 1) + alarm_spread / (healthy + 1))
    reach_negative = z * np.sqrt(quiet_spread / (healthy + 1) + miss_spread / (nodules + 1))
    return {
        "ppv": _share(sensitivity * prevalence, (1 - specificity) * (1 - prevalence)),
        "ppv_low": _expit(positive - reach_positive),
        "ppv_high": _expit(positive + reach_positive),
        "npv": _share(specificity * (1 - prevalence), (1 - sensitivity) * prevalence),
        "npv_low": _expit(negative - reach_negative),
        "npv_high": _expit(negative + reach_negative),
    }


def _share(part: float, rest: float) -> float:
    return part / (part + rest) if part + rest > 0 else float("nan")


def _logit(share: float) -> float:
    return float(np.log(share / (1 - share)))


def _expit(odds: float) -> float:
    return float(1.0 / (1.0 + np.exp(-odds)))
