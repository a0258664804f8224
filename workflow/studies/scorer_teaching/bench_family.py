"""Draw random benches from a wide family; all recordings of a bench share its parameters.

The models are simple and do not use the phantom's geometry, so that the scorer learns what nodules
have in common, not one bench. Lengths are in pitches, times in samples, and heights in amplitudes
of the wave at a sensor. A spread is the standard deviation of a logarithm. A share lies between 0
and 1. A value of 0 switches a mechanism off.
"""

from dataclasses import dataclass

import numpy as np

WAVE_FORMS = ("sine", "skewed", "power", "double")


@dataclass(frozen=True)
class Wander:
    """A slow random variation: standard deviation, time, kind (0 to 2), spread between runs."""

    size: float
    time: float
    kind: int
    run_spread: float


@dataclass(frozen=True)
class WaveTrain:
    """The parameters of the wave: its period and beats, its form, and the contact of the wall.

    With a `bias` of 0, the wall presses for half of the period. `softness` rounds the start of a
    contact. `offset_waves` is a phase from sensor to sensor that no travelling wave causes.
    `pitch_waves` is a pitch in wavelengths. With `both_walls`, the opposite wall presses too.
    """

    period: float
    period_jitter: float
    missing_share: float
    missing_height: float
    common_beat_spread: float
    own_beat_spread: float
    form: str
    form_value: float
    form_angle: float
    bias: float
    softness: float
    offset_waves: float
    pitch_waves: float
    both_walls: bool


@dataclass(frozen=True)
class Way:
    """The parameters of the capsule's motion: pace, strokes, effect of a nodule, end of a run.

    `lag` is the time for a pitch. With `by_wave`, a stroke lasts the share `grip` of a wave, and
    the share `stick` of the strokes fails. Otherwise the pace varies within `stroke_time`.
    `slip_back` is in strokes. A nodule slows the climb by `snag`, and holds each sensor for up to
    twice `hold`. The first sensor meets the nodule after `lead` pitches. A run ends `tail` pitches
    after the last sensor has met it, or when the memory is full.
    """

    lag: float
    run_spread: float
    stroke_spread: float
    stroke_time: float
    by_wave: bool
    stick: float
    grip: float
    slip_back: float
    snag: float
    hold: float
    lead: float
    lead_spread: float
    tail: float
    until_full: bool


@dataclass(frozen=True)
class Lump:
    """The parameters of a nodule: height at 3 mm, growth with size, distance, profile.

    Shares of the height are added to the wall (`adds`), multiply the press (`multiplies`) or raise
    the press at all times (`lifts`). `miss_mm` is the distance of a nodule from the line of the
    sensors. `miss_alike` is the share of its variance that is common to all nodules of a size.
    `strip_mm` is the width of a sensor.
    """

    height: float
    growth: float
    adds: float
    multiplies: float
    lifts: float
    miss_mm: float
    miss_alike: float
    strip_mm: float
    touch_spread: float
    untouched_share: float
    width: float
    width_a_mm: float
    flatness: float


@dataclass(frozen=True)
class Disturbances:
    """Disturbances that look like a nodule: wanders, an uneven wall, jumps, drift and settling.

    `seat_jumps` and `base_jumps` are mean numbers in a run. `drift` is the size of a random walk
    over a run.
    """

    common_strength: Wander
    own_strength: Wander
    seat: Wander
    unevenness: float
    unevenness_length: float
    unevenness_multiplies: bool
    seat_jumps: float
    seat_jump: float
    base_jumps: float
    base_jump: float
    drift: float
    settling: float
    settling_time: float
    settling_alike: bool


@dataclass(frozen=True)
class Sensing:
    """The parameters of the sensors and their electronics.

    `limit` bounds the press. `echo` is a second press `echo_waves` later. `counts` is the change
    of a reading by one amplitude. `rest` is the logarithm of the sensor's resistance, relative to
    the resistor in series.
    """

    limit: float
    lag_time: float
    creep: float
    creep_time: float
    echo: float
    echo_waves: float
    crosstalk: float
    gain_spread: float
    noise: float
    spikes: float
    counts: float
    divider: bool
    rest: float
    rest_spread: float


@dataclass(frozen=True)
class RandomBench:
    """One bench: the parameters that all its recordings share."""

    wave: WaveTrain
    way: Way
    lump: Lump
    disturbances: Disturbances
    sensing: Sensing


class _Draw:
    """A source of random values for the parameters of a bench."""

    def __init__(self, numbers: np.random.Generator) -> None:
        self.numbers = numbers
        self.between = numbers.uniform

    def log(self, low: float, high: float) -> float:
        """Return a random number whose logarithm is uniform."""
        return float(np.exp(self.numbers.uniform(np.log(low), np.log(high))))

    def chance(self, share: float) -> bool:
        """Return True with the given probability."""
        return bool(self.numbers.random() < share)

    def maybe(self, share: float, value: float) -> float:
        """Return the value with the given probability, and otherwise 0."""
        return value if self.chance(share) else 0.0

    def wander(self, low: float, high: float) -> Wander:
        """Return a random wander with a standard deviation in the given range."""
        spread = self.maybe(0.5, self.log(0.1, 0.9))
        return Wander(self.log(low, high), self.log(20, 400), int(self.numbers.integers(3)), spread)


def draw_bench(numbers: np.random.Generator) -> RandomBench:
    """Return a random bench."""
    draw = _Draw(numbers)
    return RandomBench(
        wave=_draw_wave(draw),
        way=_draw_way(draw),
        lump=_draw_lump(draw),
        disturbances=_draw_disturbances(draw),
        sensing=_draw_sensing(draw),
    )


def _draw_wave(draw: _Draw) -> WaveTrain:
    near = float(32.0 * np.exp(draw.numbers.normal(0, 0.03)))
    return WaveTrain(
        period=near if draw.chance(0.7) else draw.log(24, 44),
        period_jitter=draw.maybe(0.5, draw.log(0.003, 0.08)),
        missing_share=draw.maybe(0.25, draw.log(0.01, 0.08)),
        missing_height=draw.between(0, 0.6),
        common_beat_spread=draw.log(0.002, 0.15),
        own_beat_spread=draw.log(0.002, 0.15),
        form=str(draw.numbers.choice(WAVE_FORMS)),
        form_value=draw.between(0, 1),
        form_angle=draw.between(0, 2 * np.pi),
        bias=draw.between(-0.4, 0.9),
        softness=draw.maybe(0.5, draw.log(0.02, 0.5)),
        offset_waves=draw.between(-0.12, 0.12),
        pitch_waves=draw.between(0.03, 0.15),
        both_walls=draw.chance(0.5),
    )


def _draw_way(draw: _Draw) -> Way:
    return Way(
        lag=draw.log(85, 240),
        run_spread=draw.log(0.02, 0.25),
        stroke_spread=draw.log(0.02, 0.6),
        stroke_time=draw.log(30, 300),
        by_wave=draw.chance(0.6),
        stick=draw.maybe(0.5, draw.between(0, 0.25)),
        grip=draw.between(0.2, 1.0),
        slip_back=draw.maybe(0.3, draw.log(0.02, 0.5)),
        snag=draw.maybe(0.7, draw.log(0.05, 0.7)),
        hold=draw.maybe(0.4, draw.log(10, 200)),
        lead=draw.between(0.4, 1.6),
        lead_spread=draw.log(0.05, 0.5),
        tail=draw.between(0.3, 1.5),
        until_full=draw.chance(0.3),
    )


def _draw_lump(draw: _Draw) -> Lump:
    mixed = draw.numbers.dirichlet([0.5, 0.25, 0.12])
    single = np.eye(3)[draw.numbers.choice(3, p=[0.65, 0.27, 0.08])]
    adds, multiplies, lifts = (mixed if draw.chance(0.5) else single).tolist()
    return Lump(
        height=draw.log(0.08, 1.5),
        growth=draw.between(0.6, 2.0),
        adds=adds,
        multiplies=multiplies,
        lifts=lifts,
        miss_mm=draw.maybe(0.7, draw.log(0.1, 1.2)),
        miss_alike=draw.between(0, 0.8),
        strip_mm=draw.between(0.3, 1.5),
        touch_spread=draw.log(0.02, 0.6),
        untouched_share=draw.maybe(0.3, draw.between(0, 0.2)),
        width=draw.log(0.08, 0.4),
        width_a_mm=draw.between(0, 0.06),
        flatness=draw.between(2, 4),
    )


def _draw_disturbances(draw: _Draw) -> Disturbances:
    return Disturbances(
        common_strength=draw.wander(0.004, 0.3),
        own_strength=draw.wander(0.01, 0.4),
        seat=draw.wander(0.01, 0.4),
        unevenness=draw.log(0.003, 0.2),
        unevenness_length=draw.log(0.1, 1.5),
        unevenness_multiplies=draw.chance(0.3),
        seat_jumps=draw.maybe(0.3, draw.log(0.1, 3)),
        seat_jump=draw.log(0.02, 0.4),
        base_jumps=draw.maybe(0.3, draw.log(0.1, 3)),
        base_jump=draw.log(0.05, 1.0),
        drift=draw.log(0.02, 2.0),
        settling=draw.maybe(0.6, draw.log(0.05, 3.0)),
        settling_time=draw.log(30, 300),
        settling_alike=draw.chance(0.5),
    )


def _draw_sensing(draw: _Draw) -> Sensing:
    return Sensing(
        limit=draw.log(0.8, 12),
        lag_time=draw.log(0.3, 8),
        creep=draw.maybe(0.6, draw.between(0, 0.6)),
        creep_time=draw.log(15, 200),
        echo=draw.maybe(0.3, draw.between(0, 0.5)),
        echo_waves=draw.between(0.2, 0.5),
        crosstalk=draw.maybe(0.4, draw.log(0.01, 0.25)),
        gain_spread=draw.log(0.02, 0.5),
        noise=draw.log(0.005, 0.4),
        spikes=draw.maybe(0.15, draw.log(0.0005, 0.01)),
        counts=draw.log(8, 250),
        divider=draw.chance(0.8),
        rest=float(draw.numbers.normal(0, 0.4)),
        rest_spread=draw.log(0.02, 0.3),
    )
