"""What the detectors learn from is read as it was written."""

import numpy as np
import pytest

from capsule.detectors import described
from capsule.detectors.files import read_template_set, read_templates
from capsule.detectors.network import Features
from capsule.detectors.search import UNKNOWN, Passage
from capsule.detectors.wave_traits import UNKNOWN_TRAITS, WaveTraits

SHAPES = {"0mm": np.zeros((4, 9)), "2.5mm": np.ones((4, 9)), "10mm": np.eye(4, 9)}


def test_templates_are_read_by_size_in_their_order(tmp_path):
    path = tmp_path / "templates.npz"
    np.savez(path, **SHAPES)
    read, whole = read_templates(path), read_template_set(path, 3)
    assert list(read) == [0.0, 2.5, 10.0] == list(whole.sizes_mm)
    np.testing.assert_equal(list(read.values()), list(SHAPES.values()))
    np.testing.assert_equal(list(whole.matrices), list(SHAPES.values()))
    assert whole.first_peak == 3


def features_of(number):
    """Return features that differ between recordings."""
    gradient = np.arange(5, dtype=np.float32) - number
    return Features(float(number), np.full(3, number, np.float32), gradient)


PLACE = Passage(0.1 + 0.2, 1, 2, 3, 4.5, 128, 130, 0.1, 1 / 3, 0.1)
TRAITS = WaveTraits(3.2, 0.25, 1 / 3, 0.01, 0.9, 0.1)


def numbers_of(made):
    return [vars(part) for part in (made if isinstance(made, tuple) else [made])]


@pytest.mark.parametrize(
    ("write", "read", "made"),
    [
        (described.write_features, described.read_features, [features_of(1), features_of(np.nan)]),
        (
            described.write_best_places,
            described.read_best_places,
            [(PLACE, TRAITS), (UNKNOWN, UNKNOWN_TRAITS)],
        ),
        # A batch without a usable recording has none.
        (described.write_features, described.read_features, []),
        (described.write_best_places, described.read_best_places, []),
    ],
)
def test_what_describes_recordings_comes_back_in_full_precision(tmp_path, write, read, made):
    written = {f"3mm/r{number}": each for number, each in enumerate(made)}
    write(tmp_path / "batch", written)
    found = read(tmp_path / "batch")
    assert list(found) == list(written)
    np.testing.assert_equal([*map(numbers_of, found.values())], [*map(numbers_of, made)])
