"""The outline of a substructure and how it folds, each against what one can work out by hand."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from capsule.parts import substructure as unit
from capsule.parts.bench_parts import belt_length, shaft_distance
from capsule.parts.cam import follower_displacement, phase_step, steepest_overhang
from capsule.parts.files import read_design
from capsule.parts.outlines import circle, points, reverse, signed_area, slot
from capsule.parts.refusals import crosses
from capsule.phantom.origami import pitch
from capsule.phantom.parameters import words_of

DESIGN = read_design()
ORIGAMI, CHOICES = DESIGN.phantom.origami, DESIGN.parts.choice
WORDS = ("origami.fold_side", "origami.corners", "origami.tip")
READINGS = {
    f"{side} {corners} {tip}": replace(ORIGAMI, fold_side=side, corners=corners, tip=tip)
    for side, corners, tip in product(*map(words_of, WORDS))
}


def test_an_outline_is_as_large_and_wide_as_its_lines_and_arcs():
    pill = slot((1.0, 2.0), 4.2, 6.0)
    assert signed_area(pill) == pytest.approx(4.2 * 6.0 + np.pi * 2.1**2)
    assert signed_area(reverse(circle(3.0))) == pytest.approx(-9 * np.pi)
    ends = points(pill).min(axis=0), points(pill).max(axis=0)
    np.testing.assert_allclose(ends, [[1 - 2.1, 2 - 5.1], [1 + 2.1, 2 + 5.1]], atol=1e-12)
    corners = points(circle(40.0))
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 40.0, rtol=1e-12)
    halfway = (corners + np.roll(corners, 1, axis=0)) / 2
    assert 40.0 - np.linalg.norm(halfway, axis=1).min() <= 0.005


@pytest.mark.parametrize("reading", READINGS)
def test_the_outline_is_one_wall_of_the_papers_width(reading):
    shape = unit.shape_of(READINGS[reading])
    boundaries = unit.outline(shape)
    assert not crosses(boundaries)
    assert signed_area(boundaries[0]) > 0 > signed_area(boundaries[1])
    outer, inner = map(points, boundaries)
    assert np.ptp(outer[:, 1]) == pytest.approx(20.0)
    # Half a millimetre lies between both boundaries at the flats, and everywhere at least that.
    faces = unit.glue_faces(shape)
    flats = inner[np.abs(inner[:, 1]) < 2.5]
    assert faces["head"][0, 0] == pytest.approx(flats[:, 0].max() + 0.5)
    assert faces["tail"][0, 0] == pytest.approx(flats[:, 0].min() - 0.5)
    assert min(np.linalg.norm(outer[:, np.newaxis] - inner, axis=2).min(axis=0)) >= 0.5 - 1e-9
    # The awn's end begins at its side, half a wall from its middle line, whatever form it has.
    assert (unit.awn_end(shape)[0, :2] - shape.shoulder) @ shape.headward == pytest.approx(0.25)
    # The simulator's pitch is the drawn one: the faces and the adhesive.
    assert unit.face_to_face(shape) + 0.25 == pytest.approx(pitch(READINGS[reading]))


@pytest.mark.parametrize("reading", READINGS)
def test_folding_turns_walls_and_keeps_their_lengths(reading):
    def lengths(shape):
        ends = np.array([shape.fold, shape.shoulder, shape.lower, shape.cap])
        return np.linalg.norm(np.diff(ends, axis=0), axis=1)

    rest = unit.shape_of(READINGS[reading])
    shape = unit.folded(rest, 8.0)
    np.testing.assert_allclose(unit.folded(rest, 10.0).cap, rest.cap, atol=1e-9)
    np.testing.assert_allclose(lengths(rest), lengths(shape))
    top_mm = points(unit.outline(shape)[0])[:, 1].max()
    assert (top_mm, unit.top_mm(shape)) == pytest.approx((8.0, 8.0))
    assert (shape.fold[1], shape.lower[1]) == (rest.fold[1], rest.lower[1])
    # The awns lean to the tail, so that the capsule moves to the head when it is pressed.
    assert shape.tilt_rad > rest.tilt_rad
    assert shape.cap[0] < rest.cap[0]


def test_what_would_be_folded_too_far_is_refused():
    low = replace(ORIGAMI, lower_corner_mm=1.0)
    for origami, too_far, told in ((ORIGAMI, 10.2, "be pressed to 10.2"), (low, 2.5, "shoulder C")):
        with pytest.raises(ValueError, match=told):
            unit.folded(unit.shape_of(origami), too_far)


def test_a_loops_wires_sit_at_both_sides_of_its_cut_and_halves_have_one_in_each():
    shape = DESIGN.shape
    tail = unit.glue_faces(shape)["tail"][0, 0]
    np.testing.assert_allclose(unit.cut_lines(shape, CHOICES), [[[tail, 0.0], [tail + 0.5, 0.0]]])
    wires = [[tail + 0.25, 1.0], [tail + 0.25, -1.0]]
    np.testing.assert_allclose(unit.wire_positions(shape, CHOICES), wires)
    halves = read_design(["choice.current=halves"])
    apart = np.diff(unit.wire_positions(shape, halves.parts.choice), axis=0)
    np.testing.assert_allclose(np.abs(apart), [[5.5213, 0.0]], atol=1e-3)
    # The halves are in parallel, so the plastic needs four times the resistivity.
    assert halves.resistivity_ohm_m / DESIGN.resistivity_ohm_m == pytest.approx(4.0, rel=0.05)


def test_the_cam_turns_once_in_a_wave_and_belts_fit_their_shafts():
    assert phase_step(DESIGN.cam, 2.0) == 9.0
    assert steepest_overhang(DESIGN.cam) == pytest.approx(15.4, abs=0.05)
    # A quarter of a turn later the same wave stands a quarter of a wave further on.
    along = np.linspace(0, 160, 50)
    ahead = follower_displacement(DESIGN.cam, along, np.pi / 2)
    behind = follower_displacement(DESIGN.cam, along - 20.0, 0.0)
    np.testing.assert_allclose(ahead, behind, atol=1e-12)
    assert belt_length(20, 20, 60.0) == pytest.approx(2 * 60 + 40)
    assert belt_length(60, 20, shaft_distance(60, 20, 200.0)) == pytest.approx(200.0)
    with pytest.raises(ValueError, match="belt of 60 mm is too short"):
        shaft_distance(60, 20, 60.0)
