"""What a survey goes by, beside the diagonal detector's settings."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SurveySettings:
    """Numbers of a survey; those of the evidence were found on simulated guts (docs/survey.md).

    Attributes
    ----------
    window, longest_window : int
        Samples that the evidence is taken from, at least and at most.
    window_mm : float
        Way that they should hold.
    every : int
        Samples from one judgement to the next.
    budget : float
        Suspicions wanted a metre of healthy gut.
    block_mm, prior, prior_blocks, memory, gain
        As `capsule.survey.suspicion.AdaptiveThreshold` takes them.
    beyond_mm : float
        A pass is over when the last sensor is so far beyond the place.
    run_up_mm : float
        How far before the place the first sensor begins to pass it again.
    too_near_mm : float
        Nearer to the place a pass again cannot begin.
    reach_mm : float
        Evidence counts for a place within this.
    apart_mm : float
        Nearer to a place that was judged nothing is suspected.
    confirm, dismiss, at_last : float
        As `capsule.survey.decision.decide` takes them.
    latest_s : float
        A move of the origami that takes longer has failed.
    patience_s : float
        For how long a fold board may say nothing while the origami unfolds.
    longest_finding_s, longest_pass_s : float
        A position that is not found, a place that is not passed again by then is given up.
    first_fix_ticks : int
        Judgements until there is a first fix after unfolding.
    fixes : int
        So many fixes that agree are enough to know the position.
    approach_mm : float
        So far before a target a way back should end, beside what is travelled until the position
        is known: the capsule stops best where it has watched itself come nearer.
    surely_mm : float
        A way back that should lead so far beyond the start of the gut surely ends at the start.
    """

    window: int = 400
    longest_window: int = 1500
    window_mm: float = 21.0
    every: int = 8
    budget: float = 1.5
    block_mm: float = 25.0
    prior: tuple[float, float] = (0.07, 0.0166)
    prior_blocks: int = 20
    memory: int = 80
    gain: float = 1.0
    beyond_mm: float = 5.0
    run_up_mm: float = 7.0
    too_near_mm: float = 3.0
    reach_mm: float = 6.0
    apart_mm: float = 10.0
    confirm: float = 2.05
    dismiss: float = 1.8
    at_last: float = 2.0
    latest_s: float = 10.0
    patience_s: float = 60.0
    longest_finding_s: float = 60.0
    longest_pass_s: float = 600.0
    first_fix_ticks: int = 8
    fixes: int = 4
    approach_mm: float = 10.0
    surely_mm: float = 10.0
