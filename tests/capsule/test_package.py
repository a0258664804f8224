"""The package's names, its errors as lines, plain values for JSON, and streams of numbers."""

import errno

import numpy as np
import pytest

import capsule
from capsule import errors
from capsule.arrays import plain
from capsule.engine.project import project_version
from capsule.interface.archive import load
from capsule.method.particle import Particle, render
from capsule.seeding import fit_generator, generator


def test_the_package_has_its_public_names_and_checks_what_its_functions_are_given():
    assert capsule.__all__ == dir(capsule)
    assert capsule.__version__ == project_version()
    assert (capsule.Particle, capsule.load) == (Particle, load)
    assert capsule.render is not render
    with pytest.raises(AttributeError, match="no attribute 'renders'"):
        _ = capsule.renders


def test_an_error_of_the_disk_is_one_line():
    for error in (OSError(5, "lost"), OSError("lost")):
        assert errors.error_line(error) == "error: disk: lost"
    full = errors.error_line(OSError(errno.EDQUOT, "full", "a.csv"))
    assert full.startswith("error: a.csv: full; free some space and run again")


def test_plain_values_are_numbers_lists_and_none_for_what_json_lacks():
    values = {"a": np.array([1, 2]), "b": (np.float64(0.5), np.inf), "c": [{"d": np.nan}], "e": "x"}
    assert plain(values) == {"a": [1, 2], "b": [0.5, None], "c": [{"d": None}], "e": "x"}
    assert type(plain(values)["b"][0]) is float


def test_a_stream_belongs_to_its_seed_and_names_and_that_of_a_fit_to_its_readings():
    values = np.array([[1.0, np.nan, 3.0], [4.0, 5.0, 6.0]])
    asked = [(1, "roc", "3mm/r07"), (2, "roc", "3mm/r07"), (1, "roc", "3mm/r08"), (1, "roc3mm/r07")]
    fits = [(1, values), (2, values), (1, values + np.eye(2, 3))]
    streams = [(generator, *each) for each in asked] + [(fit_generator, *each) for each in fits]
    first, again = ([make(*of).integers(2**62) for make, *of in streams] for _ in range(2))
    assert first == again
    assert len(set(first)) == 7
