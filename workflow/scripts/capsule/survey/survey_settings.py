"""Settings of a survey, besides those of the diagonal detector."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SurveySettings:
    """The settings of a survey; simulated guts gave those of the evidence (docs/survey.md).

    Attributes
    ----------
    window, longest_window : int
        Smallest and largest number of samples for the evidence.
    window_mm : float
        Way that these samples should cover.
    every : int
        Number of samples from one judgement to the next.
    budget : float
        Wanted number of suspicions in a metre of healthy gut.
    block_mm, prior, prior_blocks, memory, gain
        As in `capsule.survey.suspicion.AdaptiveThreshold`.
    beyond_mm : float
        A pass is over when the last sensor is this far beyond the place.
    run_up_mm : float
        Distance before the place at which the first sensor should begin a repeated pass.
    too_near_mm : float
        Smallest distance before the place at which a repeated pass can begin.
    reach_mm : float
        Largest distance from a place at which evidence counts for it.
    apart_mm : float
        Smallest distance of a new suspicion from a place that was judged.
    confirm, dismiss, at_last : float
        As in `capsule.survey.decision.decide`.
    latest_s : float
        Longest time for a move of the origami; a longer move has failed.
    patience_s : float
        Longest time that a fold board may say nothing while the origami unfolds.
    longest_finding_s, longest_pass_s : float
        Longest time to find the position, and to pass a place again; then the survey gives up.
    first_fix_ticks : int
        Number of judgements until the first fix after unfolding.
    fixes : int
        Number of agreeing fixes that make the position known.
    approach_mm : float
        Distance before a target at which a way back should end, besides the way until the position
        is known. The capsule stops most precisely after it has followed its own approach.
    surely_mm : float
        A way back that should lead this far beyond the start of the gut surely ends at the start.
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
