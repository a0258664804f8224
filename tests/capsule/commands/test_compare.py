"""What `capsule compare` tells of two folders of results."""

import pandas as pd
import pytest

from capsule.commands.compare import (
    compared,
    recordings_that_differ,
    settings_that_differ,
    steps_that_differ,
)
from capsule.errors import CapsuleError
from support.command import run_command

KEY = {"detector": "taught", "scheme": "leave_one_out"}
# Recording, checksum, true size and verdict in mm in A; then checksum and verdict in B.
PLACES = [
    ("0mm/r1", "a", 0.0, 0.0, "a", 1.0),  # right in A alone
    ("1mm/r1", "b", 1.0, 0.0, "b", 2.0),  # right in B alone
    ("1mm/r2", "c", 1.0, float("nan"), "c", 1.0),  # no verdict in A
    ("2mm/r1", "d", 2.0, 2.0, "d", 3.0),  # another size, right in both
    ("2mm/r2", "e", 2.0, float("nan"), "e", float("nan")),  # the same: no verdict
    ("2mm/r3", "f", 2.0, 0.0, "changed", 2.0),  # another recording under the same name
]


@pytest.fixture
def folders(tmp_path):
    made = []
    for name, checksum, verdict, rate in (("A", 1, 3, 0.5), ("B", 4, 5, 0.75)):
        folder = tmp_path / name
        (folder / "evaluation").mkdir(parents=True)
        rows = [{"recording": row[0], "size_mm": row[2], "sha256": row[checksum]} for row in PLACES]
        pd.DataFrame(rows).to_csv(folder / "recordings.csv", index=False)
        said = [KEY | {"recording": row[0], "size_mm": row[2]} for row in PLACES]
        said = [
            each | {"predicted_mm": row[verdict]} for each, row in zip(said, PLACES, strict=True)
        ]
        pd.DataFrame(said).to_csv(folder / "evaluation/predictions.csv", index=False)
        summary = [KEY | {"sensitivity": rate, "specificity": rate}]
        if name == "B":  # A is of an earlier version, whose table had no sizes.
            one = KEY | {"sensitivity": 0.0, "specificity": 0.0}
            summary = [summary[0] | {"size_mm": None}, one | {"size_mm": 1.0}]
        pd.DataFrame(summary).to_csv(folder / "evaluation/summary.csv", index=False)
        made.append(folder)
    return tuple(made)


# Kills: pairing by the name alone; two missing verdicts that count as a change.
def test_verdicts_are_paired_over_the_same_recordings(folders):
    listed = [pd.read_csv(folder / "recordings.csv") for folder in folders]
    (row,) = compared(folders, listed).to_dict("records")
    assert row | {"p": None} == KEY | {
        "sensitivity_a": 0.5,
        "sensitivity_b": 0.75,
        "specificity_a": 0.5,
        "specificity_b": 0.75,
        "paired": 5,
        "changed": 4,
        "only_a_right": 1,
        "only_b_right": 2,
        "p": None,
    }
    # Three differ, one of them to A: McNemar's exact test.
    assert row["p"] == 1.0
    assert recordings_that_differ(*listed) == [
        "5 the same",
        "1 with other content, such as 2mm/r3",
    ]


# Kills: comparing sections as wholes; a key of one side that is passed over.
def test_settings_and_code_that_differ_are_named():
    a = {"preprocessing": {"window": 84, "threshold": 1.0}, "detectors": ["template", "diagonal"]}
    b = {"preprocessing": {"window": 40, "threshold": 1.0}, "taught": {"height": 10}} | {
        "detectors": ["template", "diagonal"]
    }
    assert settings_that_differ(a, b) == [
        "preprocessing.window: 84 -> 40",
        "taught.height: none -> 10",
    ]
    assert settings_that_differ(a, a) == ["the same"]
    assert steps_that_differ({"fit.py": "1", "list.py": "2"}, {"fit.py": "3", "list.py": "2"}) == [
        "other code of fit.py"
    ]
    assert steps_that_differ(None, {}) == ["not known: an earlier version made one of them"]


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(CapsuleError, match=r"no detectors.json.*capsule report"):
        run_command("compare", tmp_path, tmp_path)
