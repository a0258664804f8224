"""What the import would take wrongly without a word is refused, asked for or named."""

import numpy as np
import pytest

from support.importing import assert_readings, import_files

TIME_S = np.round(np.arange(200) / 10, 9)
COUNTS = np.rint(500 + 40 * np.sin(2 * np.pi * TIME_S / 3.2 + np.arange(4)[:, None]))
NAMES = ("time", "S1", "S2", "S3", "S4")


def write(path, columns, head=",".join(NAMES)):
    rows = [",".join(f"{value:.12g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([head, *rows] if head else rows) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def good(tmp_path):
    return write(tmp_path / "monday.csv", [TIME_S, *COUNTS])


def test_columns_count_from_one(tmp_path, good):
    imported = import_files(tmp_path, good, "--sensors", "0", "1", "2", "3")
    assert "sensors: 0 is not a column; there are columns 1 to 5" in imported.refused
    assert imported.recordings() == {}


def test_the_time_is_no_sensor(tmp_path, good):
    imported = import_files(tmp_path, good, "--sensors", "1", "2", "3", "4", "--rate", "10")
    assert "sensors: column 1 is 'time', which holds the time; name the sensors'" in (
        imported.refused
    )
    assert imported.recordings() == {}


@pytest.mark.parametrize("given", ["S4,S3,S2,S1", "S4, S3, S2, S1", "5,4,3,2"])
def test_sensors_may_be_separated_by_commas(tmp_path, good, given):
    imported = import_files(tmp_path, good, "--sensors", *given.split())
    assert_readings(imported.the_recording(), TIME_S, COUNTS[::-1])
