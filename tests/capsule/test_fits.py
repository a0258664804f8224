"""The fits of the recordings that can be judged are read; without any, each reason is told."""

import numpy as np
import pytest

from capsule import files
from capsule.errors import CapsuleError
from capsule.fits import by_size, read_particles
from capsule.results import FITS, Results

COLUMNS = ["recording", "status", "reason", "no_verdict", "readings_sha256"]
LENGTHS = {"amplitude": 4, "vertical_spread": 4, "peak_spacing": 3, "horizontal_spread": 4}


def listed(folder, *rows):
    """Write the list of the recordings and a fit for each, and return both."""
    files.write_csv(
        folder / "labelled.csv", COLUMNS, [dict(zip(COLUMNS, row, strict=True)) for row in rows]
    )
    results = Results.of_table(folder, folder / "labelled.csv", 1)
    for number, name in enumerate(results.names):
        parameters = {key: [float(number)] * length for key, length in LENGTHS.items()}
        files.write_json(results.file(FITS, name), {"recording": name, "parameters": parameters})
    return folder / "labelled.csv", results


def test_fits_are_read_in_the_order_of_the_contents_of_their_recordings(tmp_path):
    found = read_particles(
        *listed(
            tmp_path,
            ("0mm/r01", "accepted", "", "", "1"),
            ("2mm/r01", "accepted", "", "", "9"),
            ("3mm/r01", "accepted", "", "", "2"),
            ("3mm/r02", "rejected", "the file is empty", "", ""),
            ("3mm/r03", "accepted", "", "there is no wave", "0"),
            ("3mm/r04", "accepted", "", "", "3"),
        )
    )
    assert list(found) == ["3mm/r01", "3mm/r04", "2mm/r01"]
    np.testing.assert_array_equal(found["3mm/r04"].peak_spacing, [5.0] * 3)
    assert {size: len(each) for size, each in by_size(found).items()} == {3.0: 2, 2.0: 1}


def test_without_a_usable_recording_of_a_nodule_each_is_named_with_the_reason(tmp_path):
    rows = [
        ("0mm/r01", "accepted", "", "", "1"),
        ("3mm/r02", "rejected", "the file is empty", "", ""),
        ("3mm/r03", "accepted", "", "there is no wave", "0"),
    ]
    with pytest.raises(CapsuleError) as caught:
        read_particles(*listed(tmp_path, *rows))
    first, *others = str(caught.value).splitlines()
    assert first.startswith("no recording of a nodule can be used, so no template can be made")
    assert others == [
        "  rejected: raw/3mm/r02: the file is empty",
        "  not judged: raw/3mm/r03: there is no wave",
    ]
