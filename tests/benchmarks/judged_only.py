"""Benches that judge only: each is the usual bench with one trouble that is new to the detectors.

No trouble of this module is in the shipped phantom, in config/benches/, in the random benches of
scorer_teaching, or in a stored bench. Each strength comes from the physics in its docstring. It was
written down before any detector had judged a recording of the bench. workflow/studies/benches.md
compares each with the nearest trouble that taught or chose.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from capsule.arrays import FloatArray, IntArray
from capsule.phantom.contact import shaped_noise
from capsule.phantom.origami import pitch
from capsule.phantom.parameters import Phantom
from capsule.phantom.sensor import Sensors, counts
from capsule.phantom.simulation import Run
from capsule.phantom.wall import wave_period
from capsule.seeding import generator

# Pressures are in kPa, stiffnesses in N/mm: 1 kPa is 1e-3 N/mm^2.
_N_MM2_PER_KPA = 1e-3


class Passed(NamedTuple):
    """One simulated pass of the usual bench, to which a bench of this module adds its trouble.

    Seed and site are the archive and the place of the pass, as `simulate_run` takes them.
    """

    phantom: Phantom
    run: Run
    seed: int
    site: str

    def draw(self, subject: str) -> np.random.Generator:
        """Return the random numbers of one subject of the trouble, drawn anew for each pass."""
        return generator(self.seed, "judged only", self.site, "1", subject)

    @property
    def rate_hz(self) -> float:
        """Sampling rate in Hz."""
        return self.phantom.electronics.rate_hz

    def ohms(self, compression_mm: FloatArray) -> FloatArray:
        """Return the sensors' resistance for a compression in mm; both have the shape (S, K).

        The sensors are those of the usual bench: the same rest values, drift and noise.
        """
        numbers = generator(self.seed, "phantom", self.site, "1", "sensor")
        sensors = Sensors(self.phantom.sensor, numbers, compression_mm.shape, self.rate_hz)
        return sensors.resistance(compression_mm)

    def counts(self, ohms: FloatArray) -> IntArray:
        """Return the converter's readings of the sensors, integers (S, K)."""
        return counts(self.phantom.electronics, ohms)


def breathing_patient(passed: Passed) -> IntArray:
    """Return readings under a patient's breath, which presses on all sensors in its own rhythm.

    Twelve to eighteen breaths a minute raise the pressure in the abdomen by 0.5 kPa (quiet) to
    2 kPa (deep). That presses the flank of each substructure against its stiffness, and moves each
    wall inwards by up to 0.2 to 0.8 mm (assumed), so that the wave presses harder. The depth is
    drawn for each run, and breaths differ in length by 10 %. A cough reaches 5 to 15 kPa (W. S.
    Cobb and others, J. Surg. Res. 129, 2005, 231-235); here 10 kPa for 0.4 s, twice a minute on
    average.
    """
    shortest_s, longest_s, spread = 3.3, 5.0, 0.1
    narrowing_mm_per_kpa, coughs_per_s, cough_kpa, cough_s = 0.4, 1 / 30, 10.0, 0.4
    wall, contact, origami = passed.phantom.wall, passed.phantom.contact, passed.phantom.origami
    samples, numbers = passed.run.time_s.size, passed.draw("breath")
    period_s = numbers.uniform(shortest_s, longest_s)
    kpa = numbers.uniform(0.5, 2.0)
    begun = numbers.uniform()
    most = int(np.ceil(samples / passed.rate_hz / shortest_s * 2)) + 2
    lengths_s = period_s * np.exp(numbers.normal(0.0, spread, most))
    starts_s = np.concatenate([[0.0], np.cumsum(lengths_s)]) - begun * lengths_s[0]
    breaths = np.interp(passed.run.time_s, starts_s, np.arange(most + 1))
    breath_kpa = kpa * (0.5 - 0.5 * np.cos(2 * np.pi * breaths))
    coughs = np.zeros(samples)
    length = round(cough_s * passed.rate_hz)
    shape = np.sin(np.pi * (np.arange(length) + 0.5) / length)
    numbers = passed.draw("coughs")
    for start in np.flatnonzero(numbers.random(samples) < coughs_per_s / passed.rate_hz):
        coughs[start : start + length] = shape[: samples - start]
    flank_mm2 = pitch(origami) * origami.height_mm
    both_halves = 2 * _N_MM2_PER_KPA * flank_mm2 / contact.unit_stiffness_n_mm
    # At the crest the wall overlaps the capsule by the wave's amplitude.
    harder = 1 + narrowing_mm_per_kpa * breath_kpa / wall.amplitude_mm
    pressed = passed.run.compression_mm * harder + both_halves * (breath_kpa + cough_kpa * coughs)
    return passed.counts(passed.ohms(pressed))


def wetted_sensors(passed: Passed) -> IntArray:
    """Return readings of sensors that grow wet, so that they lose gain along the run.

    A film of saline between the electrodes lies in parallel to the sensor. With 1.5 S/m, 10 mm of
    length, the print's height as width and 0.05 mm of thickness, it has 27 kOhm. Then the sensor's
    changes count half as much. Each sensor has a film of its own, which starts at a random time in
    the first minute and spreads with a time constant of 15 s.
    """
    conductivity_s_m, length_mm, film_mm, film_spread = 1.5, 10.0, 0.05, 0.7
    latest_s, spreading_s = 60.0, 15.0
    numbers, sensors = passed.draw("film"), len(passed.run.counts)
    thick_mm = film_mm * np.exp(numbers.normal(0.0, film_spread, (sensors, 1)))
    since_s = passed.run.time_s - numbers.uniform(0.0, latest_s, (sensors, 1))
    wet = np.where(since_s > 0, 1 - np.exp(-np.maximum(since_s, 0) / spreading_s), 0.0)
    width_mm = passed.phantom.origami.height_mm
    siemens = 1e-3 * conductivity_s_m * width_mm * thick_mm / length_mm * wet
    ohms = passed.ohms(passed.run.compression_mm)
    return passed.counts(ohms / (1 + ohms * siemens))


def sticky_mucus(passed: Passed) -> IntArray:
    """Return readings of a capsule that rests in mucus for long, and is carried back.

    Capsules in a bowel rest for seconds to minutes, also where nothing lies, and at times move back
    by millimetres to centimetres. Here a run has one rest on average, of 3 to 9 waves (10 to 29 s),
    and one return, by the way of the last 1 to 4 waves (2 to 7 mm). Both begin after a random wave.

    While the capsule rests, the wave passes on: all sensors repeat their last beats. After a return
    it goes the same way again. So both repeat samples of the run in whole waves, which is exact for
    a wave that is regular. A person stops runs that grow longer than the paper's longest one.
    """
    run, numbers = passed.run, passed.draw("mucus")
    wave = round(wave_period(passed.phantom.wall) * passed.rate_hz)
    rests, returns = (
        numbers.integers(least, most, int(numbers.poisson(1.0)), endpoint=True).tolist()
        for least, most in ((3, 9), (1, 4))
    )
    # A rest repeats one wave many times, and a return repeats many waves once.
    events = [(1, waves) for waves in rests] + [(waves, 1) for waves in returns]
    order = list(range(-(-run.time_s.size // wave)))
    for back, times in events:
        at = int(numbers.integers(back, max(len(order), back + 1)))
        order[at:at] = order[at - back : at] * times
    samples = (np.array(order)[:, np.newaxis] * wave + np.arange(wave)).ravel()
    longest = int(passed.phantom.advance.longest_samples)
    samples = samples[samples < run.time_s.size][:longest]
    return passed.counts(passed.ohms(run.compression_mm[:, samples]))


def food_residue(passed: Passed) -> IntArray:
    """Return readings of a capsule that meets food residue, which yields to the first awns.

    Lumps of 0.5 to 3 mm (seeds, skins, fibres) lie on the wall, one in 10 mm of the gut on average.
    Each awn that passes drags most of a lump away, and 40 % of its height stays for the next one.
    So the first sensor feels it, the second hardly, and the later ones not. On average one lump in
    a run clings to an awn, and rides on it for 10 to 30 s: one sensor alone feels it.

    A lump of height h under the tip adds h to the overlap of one wall, which is the amplitude A of
    the wave at its crest, on each side. So it raises the compression by the factor 1 + h / (2 A).
    Its profile along the gut has a standard deviation of 0.8 to 2 mm.
    """
    lumps_per_mm, height_mm, width_mm, left = 0.1, (0.5, 3.0), (0.8, 2.0), 0.4
    run, numbers = passed.run, passed.draw("residue")
    sensors = len(run.counts)
    offsets_mm = pitch(passed.phantom.origami) * np.arange(sensors)[:, np.newaxis]
    position_mm = run.head_mm - offsets_mm
    begin_mm, end_mm = float(position_mm.min()), float(position_mm.max())
    lump_mm = np.zeros_like(position_mm)
    for _ in range(int(numbers.poisson(lumps_per_mm * (end_mm - begin_mm)))):
        off = (position_mm - numbers.uniform(begin_mm, end_mm)) / numbers.uniform(*width_mm)
        kept = left ** np.arange(sensors)[:, np.newaxis]
        lump_mm += numbers.uniform(*height_mm) * kept * np.exp(-0.5 * off**2)
    for _ in range(int(numbers.poisson(1.0))):
        since_s = run.time_s - numbers.uniform(0.0, run.time_s[-1])
        there = (since_s >= 0) & (since_s < numbers.uniform(10.0, 30.0))
        lump_mm[numbers.integers(sensors)] += numbers.uniform(*height_mm) * there
    higher = 1 + lump_mm / (2 * passed.phantom.wall.amplitude_mm)
    return passed.counts(passed.ohms(run.compression_mm * higher))


def unshielded_cable(passed: Passed) -> IntArray:
    """Return readings with 1/f noise of the print and with mains hum that aliases.

    Conducting composites have 1/f noise. Its relative power is S_R / R^2 = 1e-5 / f, much for a
    film and usual for a filled polymer under strain; in a run this is 0.8 % of the resistance.

    A long cable without a shield couples the mains into a sensor by 20 to 100 pF. The current flows
    through the sensor beside its resistor in series, 6 kOhm: 3 to 13 counts of 5 V / 1024. The
    board's ceramic resonator is off by up to 0.5 %. So 50 Hz, sampled at nearly 10 Hz, appear
    as 0 to 0.25 Hz, at the same phase in all sensors: the wave has 0.31 Hz.
    """
    one_over_f, mains_v, mains_hz, capacitance_pf, rate_error = 1e-5, 230.0, 50.0, (20, 100), 0.005
    time_s, rate_hz = passed.run.time_s, passed.rate_hz
    sensors, samples = passed.run.counts.shape
    frequencies = np.fft.rfftfreq(2 * samples, 1 / rate_hz)
    gain = np.zeros_like(frequencies)
    gain[1:] = frequencies[1:] ** -0.5
    noise = shaped_noise(passed.draw("1/f noise"), gain, sensors, samples)
    deviation = np.sqrt(one_over_f * np.log(frequencies[-1] / frequencies[1]))
    ohms = passed.ohms(passed.run.compression_mm) * (1 + deviation * noise)

    numbers, electronics = passed.draw("mains"), passed.phantom.electronics
    capacitance = np.exp(numbers.uniform(*np.log(capacitance_pf)))
    capacitance *= np.exp(numbers.normal(0.0, 0.3, (sensors, 1)))
    ampere = 2 * np.pi * mains_hz * 1e-12 * capacitance * np.sqrt(2) * mains_v
    alias_hz = mains_hz * rate_error * numbers.uniform(-1.0, 1.0)
    hum = np.sin(2 * np.pi * alias_hz * time_s + numbers.uniform(0.0, 2 * np.pi))
    series = electronics.series_ohm
    volt = (electronics.vref_v + ampere * hum * series) * ohms / (ohms + series)
    # The converter takes a resistance, so the voltage is given as the one that would cause it.
    volt = np.clip(volt, 0.0, electronics.vref_v * (1 - 1e-9))
    return passed.counts(series * volt / (electronics.vref_v - volt))


def losing_logger(passed: Passed) -> IntArray:
    """Return readings of a logger that loses rows without a note.

    The host is busy for 0.2 to 2 s, once in 20 s on average. The serial line keeps one or two
    frames meanwhile, and the others are lost. The logger counts rows and stamps no time. So the
    wave and the way from sensor to sensor seem to jump ahead in all sensors at once.
    """
    numbers, samples = passed.draw("losses"), passed.run.time_s.size
    kept = np.ones(samples, dtype=bool)
    for start in np.flatnonzero(numbers.random(samples) < 0.05 / passed.rate_hz):
        kept[start : start + round(numbers.uniform(0.2, 2.0) * passed.rate_hz)] = False
    return passed.run.counts[:, kept]


BENCHES: dict[str, Callable[[Passed], IntArray]] = {
    "breathing-patient": breathing_patient,
    "wetted-sensors": wetted_sensors,
    "sticky-mucus": sticky_mucus,
    "food-residue": food_residue,
    "unshielded-cable": unshielded_cable,
    "losing-logger": losing_logger,
}
