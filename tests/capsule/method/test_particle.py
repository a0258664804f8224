"""Particles are rendered by the formula, and the fit finds hidden ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.engine.configuration import read_config_file
from capsule.method import particle as method
from capsule.method.preprocessing import preprocess
from capsule.seeding import generator
from support import literal
from support.paper import PAPER
from support.project import ROOT
from support.synthetic import make_recording

SHIPPED = read_config_file(ROOT / "config/config.yaml")["fit"]

SMALL = method.ParameterSpace((0.01, 1.5), (0.05, 1.0), (5, 15), (1, 6), 0.1, 2)


@pytest.mark.parametrize(("sensors", "length", "first_peak"), [(4, 200, 30), (1, 20, 5)])
def test_rendering_equals_the_literal_formula(sensors, length, first_peak):
    particle = method.Particle.from_vector(PAPER.draw(1, sensors, generator(1, "render"))[0])
    particle.peak_spacing[:] = particle.peak_spacing / 10 + 0.25  # averages may be fractions
    expected = literal.render(*vars(particle).values(), first_peak, length)
    np.testing.assert_allclose(method.render(particle, first_peak, length), expected, atol=1e-14)
    # What is stored of a fit gives its particle; without parameters, it has none.
    parameters = {name: values.tolist() for name, values in vars(particle).items()}
    stored = {"3mm/r02": {"parameters": parameters}, "3mm/r01": {"parameters": None}}
    ((name, restored),) = method.particles_of(stored).items()
    assert name == "3mm/r02"
    np.testing.assert_array_equal(restored.to_vector(), particle.to_vector())


def test_random_particles_fill_their_ranges_and_steps_have_their_deviations():
    drawn = PAPER.draw(20_000, 4, generator(1, "ends"))
    low, high = PAPER.bounds(4)
    assert np.all((drawn >= low) & (drawn <= high))
    # Integers reach both ends.
    assert (drawn[:, 8:11].min(), drawn[:, 8:11].max()) == (100, 250)
    assert (drawn[:, 11:].min(), drawn[:, 11:].max()) == (1, 60)
    for space, deviation in ((PAPER, 1), (SMALL, 2)):
        steps = space.draw_steps(40_000, 4, generator(1, "steps"))
        assert steps[:, :8].std() == pytest.approx(0.1, rel=0.01)
        # The variance of a rounded normal number is larger by 1/12.
        assert steps[:, 8:].std() == pytest.approx(np.sqrt(deviation**2 + 1 / 12), rel=0.01)
        np.testing.assert_array_equal(steps[:, 8:], np.rint(steps[:, 8:]))


def test_a_fit_equals_the_literal_algorithm(monkeypatch):
    """By eq. initalParticleindex to eq. Theta*, with literal comparisons."""
    sensors, length = 2, 30
    recording = make_recording(3.0, "3mm/r01", samples=length - 4, sensors=sensors, spacing=11)
    matrix = preprocess(recording.values, window=6, threshold=0.5, length=length)

    def distance(vector):
        cuts = np.split(vector, [sensors, 2 * sensors, 3 * sensors - 1])
        return literal.smallest_rmse(matrix, literal.render(*cuts, 8, length))

    numbers, accepted = generator(5, "fit"), 0
    best = min(SMALL.draw(21, sensors, numbers), key=distance)
    initial = smallest = distance(best)
    for step in SMALL.draw_steps(47, sensors, numbers):
        proposal = np.clip(best + step, *SMALL.bounds(sensors))
        proposed = distance(proposal)
        if proposed < smallest:
            best, smallest, accepted = proposal, proposed, accepted + 1
    rules = {"particles": 21, "iterations": 47, "first_peak": 8, "space": SMALL}
    # However many particles are compared at once.
    for at_once in (1, 2, 3, 50):
        monkeypatch.setattr(method, "CANDIDATES_AT_ONCE", at_once)
        monkeypatch.setattr(method, "PROPOSALS_AT_ONCE", at_once)
        fit = method.fit_particle(matrix, generator(5, "fit"), **rules)
        np.testing.assert_allclose(fit.particle.to_vector(), best, atol=1e-12)
        assert (fit.rmse_initial, fit.rmse) == pytest.approx((initial, smallest), abs=1e-9)
        assert fit.accepted_moves == accepted > 2
    sliding = literal.sliding_rmse(matrix, method.render(fit.particle, 8, length))
    assert fit.lag == np.argmin(sliding) + 1


@given(st.integers(1, 5), st.integers(1, 1000), st.integers(0, 2**32))
def test_the_fast_rendering_holds_for_peaks_at_and_beyond_the_edges(sensors, length, seed):
    first_peak = int(generator(seed, "first peak").integers(1, length, endpoint=True))
    renderer = method.ParticleRenderer(sensors, length, first_peak, PAPER)
    vectors = PAPER.draw(2, sensors, generator(seed, "edges"))
    drawn = np.empty((2, sensors, length))
    renderer.draw_into(vectors, drawn)
    for found, vector in zip(drawn, vectors, strict=True):
        expected = method.render(method.Particle.from_vector(vector), first_peak, length)
        np.testing.assert_allclose(found, expected, atol=1e-15)


def test_the_options_of_a_fit_are_all_its_settings_but_the_seed():
    options = method.fit_options(SHIPPED)
    space = vars(options.pop("space"))
    assert options | space | {"seed": SHIPPED["seed"]} == SHIPPED
