"""Tables are read as they were written."""

import numpy as np

from capsule.evaluation.files import read_table
from capsule.store.files import write_csv


def test_what_people_wrote_stays_as_they_wrote_it(tmp_path):
    path = tmp_path / "sites.csv"
    rows = [
        {"site": "01", "score": 1.5, "recordings": 2, "detected": True},
        {"site": "NA", "score": None, "recordings": 3, "detected": False},
        {"site": "nan", "score": float("nan"), "recordings": 3, "detected": False},
        {"site": "1e3", "score": -1.0, "recordings": 1, "detected": True},
        {"site": None, "score": -1.0, "recordings": 1, "detected": True},
    ]
    write_csv(path, list(rows[0]), rows)
    read = read_table(path)
    assert read["site"].iloc[:4].tolist() == ["01", "NA", "nan", "1e3"]
    assert read["site"].isna().tolist() == [False] * 4 + [True]
    np.testing.assert_array_equal(read["score"], [1.5, np.nan, np.nan, -1.0, -1.0])
    assert read["recordings"].dtype.kind == "i"
    assert read["detected"].dtype.kind == "b"
