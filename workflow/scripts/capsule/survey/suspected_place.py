"""The places that a survey suspects, and what it makes of them."""

from dataclasses import dataclass, field

import numpy as np

STATUSES = ("confirmed", "dismissed", "undecided")


@dataclass
class Place:
    """A suspected place.

    Attributes
    ----------
    number : int
        From 1, in the order of suspicion.
    first_mm : float
        Where the first pass has it.
    evidence : list of float
        The largest evidence of each pass, the first included; NaN for a pass that is no evidence.
    heights : list of float
        The same in parts of the usual evidence; empty before it is passed again.
    again_mm : list of float
        Where each pass again has it.
    threshold : float
        Above which the first pass was suspicious.
    status : str
        One of `STATUSES`; empty while it is not decided.
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
        """How many passes are evidence."""
        return int(np.count_nonzero(~np.isnan(self.evidence)))

    @property
    def place_mm(self) -> float:
        """Where it is: the median of all passes; of a dismissed one, of the first."""
        again = [place for place in self.again_mm if not np.isnan(place)]
        if self.status == "dismissed":
            return self.first_mm
        return float(np.median([self.first_mm, *again]))
