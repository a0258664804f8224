"""Simulate one run: the capsule's motion, the wall under each sensor, and the readings."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.errors import CapsuleError
from capsule.phantom.advance import draw_holds, first_arrival
from capsule.phantom.contact import bulge_of, looseness, stray_offset
from capsule.phantom.journey import Capsule, Pass, draw_chance
from capsule.phantom.origami import pitch
from capsule.phantom.parameters import Phantom
from capsule.phantom.sensor import Sensors, counts
from capsule.phantom.wall import draw_unevenness, roughness, wave_period
from capsule.recordings.names import size_label
from capsule.recordings.recording import Recording
from capsule.seeding import generator

# Raise the version whenever the same seed gives other readings.
SIMULATOR_VERSION = "5"
SENSORS = 4
# A fixed date, so that a simulated run gives the same bytes at any time.
STARTED = "2024-06-03T00:00:00Z"


@dataclass(frozen=True)
class Run:
    """The course of one simulated run."""

    nodule_mm: float  # its diameter; 0 for none
    time_s: FloatArray  # shape (K,)
    head_mm: FloatArray  # distance of sensor 1 from the start, shape (K,)
    # Place of the nodule, as a value of `head_mm`; without one, the place that it would have.
    nodule_at_mm: float
    compression_mm: FloatArray  # of each substructure, shape (S, K)
    counts: IntArray  # readings of the converter, shape (S, K)


@dataclass(frozen=True)
class PlannedRun:
    """One run of an archive."""

    name: str  # of the recording, such as ``3mm/r07``
    site: str  # name of the place within the archive; several passes over it share the name
    setup: str  # name of the set-up within the archive; several places of one size share it
    size_mm: float  # diameter of the nodule; 0 for none
    attempt: str  # name of the pass


def planned_runs(
    sizes_mm: Sequence[float],
    runs: int | Sequence[int],
    passes: int,
    setups: int | Sequence[int] = 1,
    prefix: str = "r",
) -> list[PlannedRun]:
    """Return the runs of an archive.

    Parameters
    ----------
    sizes_mm
        Diameters of the nodules; 0 for none.
    runs
        Number of places of each size: one number for all sizes, or one for each.
    passes
        Number of passes over each place.
    setups
        Number of set-ups of each size, likewise. The places of a size are divided into so many
        neighbouring parts, and each part is run with a set-up of its own.
    prefix
        What the names of the recordings begin with.

    Raises
    ------
    CapsuleError
        The numbers are neither one nor one for each size, or a set-up would have no run.
    """
    planned = []
    for size, places, parts in zip(
        sizes_mm, _of_each(sizes_mm, runs), _of_each(sizes_mm, setups), strict=True
    ):
        if parts > places:
            raise CapsuleError(f"{size_label(size)}: {parts} set-ups need as many runs or more")
        for number in range(places):
            site = f"{size_label(size)}/{prefix}{number + 1:02d}"
            setup = setup_name(size, number * parts // places)
            planned += [
                PlannedRun(f"{site}p{attempt}" if passes > 1 else site, site, setup, size, attempt)
                for attempt in map(str, range(1, passes + 1))
            ]
    return planned


def _of_each(sizes_mm: Sequence[float], numbers: int | Sequence[int]) -> Sequence[int]:
    listed = [numbers] if isinstance(numbers, int) else [*numbers]
    if len(listed) == 1:
        return listed * len(sizes_mm)
    if len(listed) != len(sizes_mm):
        raise CapsuleError(
            f"{len(listed)} numbers for {len(sizes_mm)} sizes: give one, or one each"
        )
    return listed


def setup_name(size_mm: float, number: int = 0) -> str:
    """Return the name of a set-up within an archive: ``3mm``, and ``3mm/2`` for the second one."""
    return size_label(size_mm) + (f"/{number + 1}" if number else "")


def archive_name(seed: int, bench: str | None = None) -> str:
    """Return the name of a simulated archive, of which no archive of another seed has the same."""
    return f"{bench or 'simulated'}-{seed}"


def simulate_run(
    phantom: Phantom,
    nodule_mm: float,
    seed: int,
    site: str,
    attempt: str = "1",
    sensors: int = SENSORS,
    setup: str | None = None,
) -> Run:
    """Simulate one pass of the capsule over one place.

    Parameters
    ----------
    phantom
        The bench.
    nodule_mm
        Diameter of the nodule; 0 for a healthy gut.
    seed
        The archive's seed.
    site
        Name of the place. Its nodule and its uneven wall are the same in every pass.
    attempt
        Name of the pass. Everything else is drawn again for each pass.
    sensors
        S; the paper's capsule has four.
    setup
        Name of the set-up; without one, that of the nodule's size (`setup_name`). The height at
        which nodule and gut lie on the bench is drawn once for each set-up.

    Returns
    -------
    Run
    """
    place = generator(seed, "phantom", site)
    series = generator(seed, "phantom", setup or setup_name(nodule_mm), "series")

    @cache
    def draw(subject: str) -> np.random.Generator:
        return generator(seed, "phantom", site, attempt, subject)

    wall, contact, advance = phantom.wall, phantom.contact, phantom.advance
    rate_hz, longest = phantom.electronics.rate_hz, int(advance.longest_samples)
    rough = roughness(wall, generator(seed, "phantom", site, "roughness"))
    walls = draw_unevenness(wall, place, rough), draw_unevenness(wall, place, rough)
    seat = draw("seat")
    nodule_at_mm = max(advance.lead_mm + seat.normal(0.0, advance.lead_spread_mm), 0.0)
    coupling = np.exp(seat.normal(0.0, contact.coupling_spread, sensors))
    height_offset_mm = series.normal(0.0, contact.series_offset_mm) + seat.normal(
        0.0, contact.height_offset_mm
    )
    phase = seat.uniform(0.0, 2 * np.pi)
    height_offset_mm += stray_offset(contact, draw("stray"))
    bulge = bulge_of(
        contact, wall, phantom.origami, nodule_mm=nodule_mm, at_mm=nodule_at_mm,
        height_offset_mm=height_offset_mm, coupling=coupling,
    )  # fmt: skip
    waves = int(np.ceil(longest / rate_hz / wave_period(wall))) + 1
    chance = draw_chance(phantom, draw, walls, phase, (sensors, longest), waves)
    holds = draw_holds(advance, draw("advance"), sensors)
    this_pass = Pass([bulge], holds, looseness(contact, draw("wander")))
    way = Capsule(phantom, chance, lambda number: this_pass).press(longest)
    way_mm = 2 * advance.lead_mm + (sensors - 1) * pitch(phantom.origami)
    samples = max(int(first_arrival(way.head_mm, way_mm)), 2)
    pressed = way.compression_mm[:, :samples]
    felt = Sensors(phantom.sensor, draw("sensor"), pressed.shape, rate_hz)
    readings = counts(phantom.electronics, felt.resistance(pressed))
    time_s, head_mm = way.time_s[:samples], way.head_mm[:samples]
    return Run(nodule_mm, time_s, head_mm, nodule_at_mm, pressed, readings)


def simulated_header(source: str, phantom: Phantom, seed: int) -> dict[str, str]:
    """Return the first header lines of every simulated recording.

    Parameters
    ----------
    source
        Name of the source; it must contain the word "simulated".
    """
    electronics = phantom.electronics
    return {
        "source": source,
        "simulator_version": SIMULATOR_VERSION,
        "simulator_seed": str(seed),
        "rate_hz": f"{electronics.rate_hz:g}",
        "adc_bits": f"{electronics.adc_bits:g}",
        "vref_v": f"{electronics.vref_v:g}",
        "series_ohm": f"{electronics.series_ohm:g}",
        "started": STARTED,
    }


def recording_of(
    run: Run,
    phantom: Phantom,
    seed: int,
    site: str,
    bench: str | None = None,
    setup: str | None = None,
) -> Recording:
    """Return a run as a recording, with a header that marks it as simulated.

    Site and set-up of the header begin with the name of the archive: two archives may hold places
    of the same name, but they are not the same places.

    Parameters
    ----------
    site, setup
        As in `simulate_run`.
    bench
        Name of the bench, if it is not the default bench.
    """
    archive = archive_name(seed, bench)
    header = {
        **simulated_header("simulated phantom", phantom, seed),
        "site": f"{archive}/{site}",
        "session": archive,
        "setup": f"{archive}/{setup or setup_name(run.nodule_mm)}",
    }
    if bench is not None:
        header["simulator_bench"] = bench
    if run.nodule_mm > 0:
        header["nodule_at_mm"] = f"{run.nodule_at_mm:.2f}"
    return Recording(run.time_s, run.counts, header)
