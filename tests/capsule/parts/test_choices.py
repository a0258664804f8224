"""Every choice gives valid parts, or an error with its limit."""

import os
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, reject, settings
from hypothesis import strategies as st

from capsule.errors import CapsuleError
from capsule.parts.all_parts import all_parts, assembly, substructure
from capsule.parts.design import design_of, entries, volume
from capsule.parts.files import read_parts_table
from capsule.parts.refusals import check_design
from capsule.parts.substructure import wall_area
from capsule.phantom.files import DEFAULT_TABLE, read_phantom
from capsule.phantom.parameters import parameter_names, words_of
from support.command import CAPSULE, run_command

pytestmark = pytest.mark.takes(0.1)

TABLE, PHANTOM = read_parts_table(), read_phantom(DEFAULT_TABLE, [])
ROWS = dict(entries(TABLE))
REFUSAL = re.compile(
    r"^[a-z]+\.[a-z_]+ is .+; (it must be (at least|at most) -?\d|it must be a multiple of|"
    r"allowed (is|are) |.+; (enlarge|reduce) it).*"
)


def is_sound(part):
    for name, vertices, triangles in part.bodies:
        mesh = trimesh.Trimesh(vertices, triangles, process=False)
        assert mesh.is_watertight and mesh.is_winding_consistent, name
        assert np.isfinite(vertices).all(), name
    assert volume(part) > 0, part.name


def designed(*changes):
    """Return the design with changed values, without reading the tables again."""
    design = design_of(TABLE, changes, PHANTOM, sensors=4)
    check_design(design)
    return design


# The last one is 5 (tan 48 - tan 8), a wall and the adhesive.
PITCHES_MM = {"origami.fold_side=tail": 5.38, "origami.corners=outside": 5.77}
PITCHES_MM |= {"origami.tip=curl": 6.27, "origami.fold_angle_deg=40 origami.awn_tilt_deg=8": 5.60}


@pytest.mark.parametrize("change", PITCHES_MM)
def test_a_choice_of_form_gives_its_pitch(change):
    sizes = assembly(designed(*change.split())).sizes
    assert sizes["pitch_mm"] == pytest.approx(PITCHES_MM[change], abs=0.005)


# Substructures that stand clear at rest.
PRESSED = "origami.fold_angle_deg=16 origami.shoulder_to_tip_mm=8 origami.tip_radius_mm=1"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ("origami.wall_thickness_mm=0.3", "must be at least 0.4, so that no wall is thinner"),
        ("print.nozzle_mm=0.6", "wall_thickness_mm is 0.5; it must be at least 0.6"),
        ("origami.fold_angle_deg=10", "is 10; the hexagon crosses itself; enlarge it"),
        ("origami.tip_radius_mm=2", "tip_radius_mm is 2; it must be at most 1.25"),
        (PRESSED, "tips and walls meet the neighbour when the capsule is pressed"),
        ("bench.follower_mm=1 bench.follower_gap_mm=0.3", "is 1; it must be at least 1.1"),
        ("bench.length_mm=100", "multiple of wall.wavelength_mm (80), at most 160"),
        ("wall.amplitude_mm=5", "amplitude_mm is 5; it must be at most 4.634"),
        ("bench.frame_mm=90", "bench.frame_mm is 90; allowed is 2 to 10"),
        ("choice.fold_side=tail", "did you mean origami.fold_side?"),
        ("sensor.noise=0.1", "the parts have no value sensor.noise; config/parts.yaml lists all"),
    ],
)
def test_what_cannot_be_made_is_refused_in_one_line(changes, told):
    with pytest.raises(CapsuleError, match=re.escape(told)) as error:
        designed(*changes.split())
    assert "\n" not in str(error.value)


def test_without_a_package_one_line_says_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "manifold3d.py").write_text("raise ModuleNotFoundError(name='manifold3d')")
    lacking, out = os.environ | {"PYTHONPATH": str(tmp_path)}, tmp_path / "parts"
    command = [*CAPSULE, "parts", "--out", str(out)]
    run = subprocess.run(command, env=lacking, capture_output=True, text=True)
    told = 'the parts need manifold3d, which is not installed; run in .*: pip .*"\\.\\[parts\\]"'
    assert (run.returncode, bool(re.fullmatch(f"error: {told}\n", run.stderr))) == (1, True)
    for name in ["OCP", *(each for each in sys.modules if each.startswith("OCP."))]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "capsule.parts.step_files", raising=False)
    with pytest.raises(CapsuleError, match=r'^--step needs Open CASCADE, .*pip .*"\.\[cad\]"$'):
        run_command("parts", "--step", "--out", out)
    assert not out.exists()


def drawn(name):
    """Draw a change of a value: one of its words, or a number within its limits, or none."""
    words = ROWS[name].get("allowed") if name in ROWS else words_of(name)
    if words:
        return st.sampled_from(words).map(lambda word: f"{name}={word}")
    low, high = TABLE["limits"].get(name) or ROWS[name]["range"]
    return st.none() | st.floats(low, high).map(lambda value: f"{name}={value:.3f}")


OF_CAPSULE = [name for name in TABLE["limits"] if name.startswith("origami.")]
OF_CAPSULE += [name for name in ROWS if "allowed" in ROWS[name]]
OF_CAPSULE += [name for name in parameter_names() if words_of(name)]
WHOLE = ("teeth", "length_mm", "follower_mm")
BENCH = [name for name in ROWS if name.startswith("bench.") and not name.endswith(WHOLE)]
BENCH += ["wall.lumen_mm", "wall.amplitude_mm"]


def design_or_limit(changes):
    """Return the design; without one, the error names value and limit."""
    try:
        return designed(*filter(None, changes))
    except CapsuleError as error:
        assert REFUSAL.fullmatch(str(error)), error
        reject()


@settings(max_examples=12, deadline=None)
@given(st.tuples(*map(drawn, OF_CAPSULE)))
def test_random_dimensions_give_a_valid_capsule_or_name_the_limit(changes):
    design = design_or_limit(changes)
    part, row = substructure(design), assembly(replace(design, sensors=2))
    is_sound(part)
    # Two bodies that do not meet share no volume.
    assert volume(row) == pytest.approx(2 * volume(part), rel=1e-6)
    origami, area = design.phantom.origami, wall_area(design.shape)
    # Chords stand for the arcs of two awns, each of two sides at the most, and cut off 2/3 of
    # 0.005 mm along them.
    cut_off = 2 / 3 * 0.005 * 8 * np.pi * design.shape.cap_radius_mm
    # Eyelets are two bores through both flats.
    eyelets = 0 if design.parts.choice.folding == "none" else 4
    bored = eyelets * np.pi * 0.4**2 * origami.wall_thickness_mm
    within = origami.height_mm * cut_off + 0.05 * bored
    assert volume(part) == pytest.approx(origami.height_mm * area - bored, abs=within)


@settings(max_examples=2, deadline=None)
@given(st.tuples(*map(drawn, BENCH)))
def test_random_dimensions_give_a_valid_bench_or_name_the_limit(changes):
    for part in all_parts(design_or_limit(changes)):
        is_sound(part)
