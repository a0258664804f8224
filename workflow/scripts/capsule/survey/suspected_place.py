"""A place that a survey suspects, with its passes and its verdict."""

from dataclasses import dataclass, field

import numpy as np

STATUSES = ("confirmed", "dismissed", "undecided")


@dataclass
class Place:
    """A suspected place.

    Attributes
    ----------
    number : int
        Number from 1, in the order of suspicion.
    first_mm : float
        Position from the first pass.
    evidence : list of float
        The largest evidence of each pass, including the first; NaN for a pass without evidence.
    heights : list of float
        The same in units of the usual evidence; empty before the first repeated pass.
    again_mm : list of float
        Position from each repeated pass.
    threshold : float
        Threshold above which the first pass was suspicious.
    status : str
        One of `STATUSES`; empty before the decision.
    """

    number: int
    first_mm: float
    threshold: float
    evidence: list[float] = field(default_factory=list)
    heights: list[float] = field(default_factory=list)
    again_mm: list[float] = field(default_factory=list)
    status: str = ""

    @property
    def passes(self) -> int:
        """Number of passes with evidence."""
        return int(np.count_nonzero(~np.isnan(self.evidence)))

    @property
    def place_mm(self) -> float:
        """Position: the median over all passes, or the first pass's if the place is dismissed."""
        again = [place for place in self.again_mm if not np.isnan(place)]
        if self.status == "dismissed":
            return self.first_mm
        return float(np.median([self.first_mm, *again]))
