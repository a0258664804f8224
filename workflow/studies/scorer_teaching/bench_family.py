"""Draw random benches from a wide family; all recordings of a bench share its parameters.

The models are simple and do not use the phantom's geometry, so that the scorer learns what nodules
have in common, not one bench. Lengths are in pitches, times in samples, and heights in amplitudes
of the wave at a sensor. A spread is the standard deviation of a logarithm. A share lies between 0
and 1. A value of 0 switches a mechanism off. Beside each parameter stands its distribution.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Annotated, Any, NamedTuple, TypeAlias, TypeVar, get_type_hints

import numpy as np

WAVE_FORMS = ("sine", "skewed", "power", "double")

_Parameters = TypeVar("_Parameters")
# A distribution: a function that draws a value.
Draw: TypeAlias = Callable[[np.random.Generator], Any]


def between(low: float, high: float) -> Draw:
    """Return the uniform distribution."""
    return lambda numbers: numbers.uniform(low, high)


def log(low: float, high: float) -> Draw:
    """Return the distribution whose logarithm is uniform."""
    return lambda numbers: float(np.exp(numbers.uniform(np.log(low), np.log(high))))


def chance(share: float) -> Draw:
    """Return the distribution that is True with the given probability."""
    return lambda numbers: bool(numbers.random() < share)


def maybe(share: float, draw: Draw) -> Draw:
    """Return a distribution that holds with the given probability; the value is 0 otherwise."""

    def drawn(numbers: np.random.Generator) -> float:
        value = draw(numbers)
        return value if numbers.random() < share else 0.0

    return drawn


class Wander(NamedTuple):
    """A slow random variation: standard deviation, time, kind (0 to 2), spread between runs."""

    size: float
    time: float
    kind: int
    run_spread: float


def wander(low: float, high: float) -> Draw:
    """Return the distribution of wanders with a standard deviation in the given range."""

    def drawn(numbers: np.random.Generator) -> Wander:
        spread = maybe(0.5, log(0.1, 0.9))(numbers)
        size, time = log(low, high)(numbers), log(20, 400)(numbers)
        return Wander(size, time, int(numbers.integers(3)), spread)

    return drawn


def _period(numbers: np.random.Generator) -> float:
    near = float(32.0 * np.exp(numbers.normal(0, 0.03)))
    return near if numbers.random() < 0.7 else log(24, 44)(numbers)


class Effect(NamedTuple):
    """The shares of a nodule's height by their effect.

    They are added to the wall (`adds`), multiply the press (`multiplies`) or raise the press at all
    times (`lifts`).
    """

    adds: float
    multiplies: float
    lifts: float


def _effect(numbers: np.random.Generator) -> Effect:
    mixed = numbers.dirichlet([0.5, 0.25, 0.12])
    single = np.eye(3)[numbers.choice(3, p=[0.65, 0.27, 0.08])]
    return Effect(*(mixed if numbers.random() < 0.5 else single).tolist())


@dataclass(frozen=True)
class WaveTrain:
    """The parameters of the wave: its period and beats, its form, and the contact of the wall.

    With a `bias` of 0, the wall presses for half of the period. `softness` rounds the start of a
    contact. `offset_waves` is a phase from sensor to sensor that no travelling wave causes.
    `pitch_waves` is a pitch in wavelengths. With `both_walls`, the opposite wall presses too.
    """

    period: Annotated[float, _period]
    period_jitter: Annotated[float, maybe(0.5, log(0.003, 0.08))]
    missing_share: Annotated[float, maybe(0.25, log(0.01, 0.08))]
    missing_height: Annotated[float, between(0, 0.6)]
    common_beat_spread: Annotated[float, log(0.002, 0.15)]
    own_beat_spread: Annotated[float, log(0.002, 0.15)]
    form: Annotated[str, lambda numbers: str(numbers.choice(WAVE_FORMS))]
    form_value: Annotated[float, between(0, 1)]
    form_angle: Annotated[float, between(0, 2 * np.pi)]
    bias: Annotated[float, between(-0.4, 0.9)]
    softness: Annotated[float, maybe(0.5, log(0.02, 0.5))]
    offset_waves: Annotated[float, between(-0.12, 0.12)]
    pitch_waves: Annotated[float, between(0.03, 0.15)]
    both_walls: Annotated[bool, chance(0.5)]


@dataclass(frozen=True)
class Way:
    """The parameters of the capsule's motion: pace, strokes, effect of a nodule, end of a run.

    `lag` is the time for a pitch. With `by_wave`, a stroke lasts the share `grip` of a wave, and
    the share `stick` of the strokes fails. Otherwise the pace varies within `stroke_time`.
    `slip_back` is in strokes. A nodule slows the climb by `snag`, and holds each sensor for up to
    twice `hold`. The first sensor meets the nodule after `lead` pitches. A run ends `tail` pitches
    after the last sensor has met it, or when the memory is full.
    """

    lag: Annotated[float, log(85, 240)]
    run_spread: Annotated[float, log(0.02, 0.25)]
    stroke_spread: Annotated[float, log(0.02, 0.6)]
    stroke_time: Annotated[float, log(30, 300)]
    by_wave: Annotated[bool, chance(0.6)]
    stick: Annotated[float, maybe(0.5, between(0, 0.25))]
    grip: Annotated[float, between(0.2, 1.0)]
    slip_back: Annotated[float, maybe(0.3, log(0.02, 0.5))]
    snag: Annotated[float, maybe(0.7, log(0.05, 0.7))]
    hold: Annotated[float, maybe(0.4, log(10, 200))]
    lead: Annotated[float, between(0.4, 1.6)]
    lead_spread: Annotated[float, log(0.05, 0.5)]
    tail: Annotated[float, between(0.3, 1.5)]
    until_full: Annotated[bool, chance(0.3)]


@dataclass(frozen=True)
class Lump:
    """The parameters of a nodule: height at 3 mm, growth with size, distance, profile.

    `miss_mm` is the distance of a nodule from the line of the sensors. `miss_alike` is the share of
    its variance that is common to all nodules of a size. `strip_mm` is the width of a sensor.
    """

    effect: Annotated[Effect, _effect]
    height: Annotated[float, log(0.08, 1.5)]
    growth: Annotated[float, between(0.6, 2.0)]
    miss_mm: Annotated[float, maybe(0.7, log(0.1, 1.2))]
    miss_alike: Annotated[float, between(0, 0.8)]
    strip_mm: Annotated[float, between(0.3, 1.5)]
    touch_spread: Annotated[float, log(0.02, 0.6)]
    untouched_share: Annotated[float, maybe(0.3, between(0, 0.2))]
    width: Annotated[float, log(0.08, 0.4)]
    width_a_mm: Annotated[float, between(0, 0.06)]
    flatness: Annotated[float, between(2, 4)]


@dataclass(frozen=True)
class Disturbances:
    """Disturbances that look like a nodule: wanders, an uneven wall, jumps, drift and settling.

    `seat_jumps` and `base_jumps` are mean numbers in a run. `drift` is the size of a random walk
    over a run.
    """

    common_strength: Annotated[Wander, wander(0.004, 0.3)]
    own_strength: Annotated[Wander, wander(0.01, 0.4)]
    seat: Annotated[Wander, wander(0.01, 0.4)]
    unevenness: Annotated[float, log(0.003, 0.2)]
    unevenness_length: Annotated[float, log(0.1, 1.5)]
    unevenness_multiplies: Annotated[bool, chance(0.3)]
    seat_jumps: Annotated[float, maybe(0.3, log(0.1, 3))]
    seat_jump: Annotated[float, log(0.02, 0.4)]
    base_jumps: Annotated[float, maybe(0.3, log(0.1, 3))]
    base_jump: Annotated[float, log(0.05, 1.0)]
    drift: Annotated[float, log(0.02, 2.0)]
    settling: Annotated[float, maybe(0.6, log(0.05, 3.0))]
    settling_time: Annotated[float, log(30, 300)]
    settling_alike: Annotated[bool, chance(0.5)]


@dataclass(frozen=True)
class Sensing:
    """The parameters of the sensors and their electronics.

    `limit` bounds the press. `echo` is a second press `echo_waves` later. `counts` is the change
    of a reading by one amplitude. `rest` is the logarithm of the sensor's resistance, relative to
    the resistor in series.
    """

    limit: Annotated[float, log(0.8, 12)]
    lag_time: Annotated[float, log(0.3, 8)]
    creep: Annotated[float, maybe(0.6, between(0, 0.6))]
    creep_time: Annotated[float, log(15, 200)]
    echo: Annotated[float, maybe(0.3, between(0, 0.5))]
    echo_waves: Annotated[float, between(0.2, 0.5)]
    crosstalk: Annotated[float, maybe(0.4, log(0.01, 0.25))]
    gain_spread: Annotated[float, log(0.02, 0.5)]
    noise: Annotated[float, log(0.005, 0.4)]
    spikes: Annotated[float, maybe(0.15, log(0.0005, 0.01))]
    counts: Annotated[float, log(8, 250)]
    divider: Annotated[bool, chance(0.8)]
    rest: Annotated[float, lambda numbers: float(numbers.normal(0, 0.4))]
    rest_spread: Annotated[float, log(0.02, 0.3)]


@dataclass(frozen=True)
class RandomBench:
    """One bench: the parameters that all its recordings share."""

    wave: WaveTrain
    way: Way
    lump: Lump
    disturbances: Disturbances
    sensing: Sensing


def draw_bench(numbers: np.random.Generator) -> RandomBench:
    """Return a random bench."""
    parts = get_type_hints(RandomBench)
    return RandomBench(**{name: _drawn(kind, numbers) for name, kind in parts.items()})


def _drawn(kind: type[_Parameters], numbers: np.random.Generator) -> _Parameters:
    """Return random parameters, drawn in the order of the fields from their distributions."""
    hints = get_type_hints(kind, include_extras=True)
    return kind(**{item.name: hints[item.name].__metadata__[0](numbers) for item in fields(kind)})
