"""Kinds of numbers that the phantom's parameters are; a bare float is 0 or more."""

import math
from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Limits:
    """Smallest and largest number that is allowed; `beyond`: greater than the smallest."""

    low: float = 0.0
    high: float = math.inf
    beyond: bool = False


Signed = Annotated[float, Limits(low=-math.inf)]
# Of a whole, such as a probability.
Share = Annotated[float, Limits(high=1.0)]
# The model divides by the rest.
MostShare = Annotated[float, Limits(high=0.99)]
# A model divides by it.
Positive = Annotated[float, Limits(beyond=True)]
PositiveShare = Annotated[float, Limits(high=1.0, beyond=True)]
