"""What `capsule compare` tells of two folders of results."""

import pandas as pd
import pytest

from capsule.commands import compare
from capsule.errors import CapsuleError
from support.command import run_command

SUMMARY = ("sensitivity", "specificity")
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


def write(folder, checksum, verdict, *summary):
    """Write a folder of results; `checksum` and `verdict` are the places in `PLACES`."""
    (folder / "evaluation").mkdir(parents=True)
    columns = {"recording": 0, "size_mm": 2, "sha256": checksum, "predicted_mm": verdict}
    rows = [KEY | {name: row[place] for name, place in columns.items()} for row in PLACES]
    summary = [KEY | dict.fromkeys(SUMMARY, rate) | more for rate, more in summary]
    tables = {"recordings": rows, "evaluation/predictions": rows, "evaluation/summary": summary}
    for name, table in tables.items():
        pd.DataFrame(table).to_csv(folder / f"{name}.csv", index=False)


# Kills: pairing by the name alone; two missing verdicts that count as a change.
def test_verdicts_are_paired_over_the_same_recordings(tmp_path):
    folders = tmp_path / "A", tmp_path / "B"
    # A is of an earlier version, whose table had no sizes.
    write(folders[0], 1, 3, (0.5, {}))
    write(folders[1], 4, 5, (0.75, {"size_mm": None}), (0.0, {"size_mm": 1.0}))
    listed = [pd.read_csv(folder / "recordings.csv") for folder in folders]
    (row,) = compare.compared(folders, listed).to_dict("records")
    told = {f"{rate}_{of}": each for rate in SUMMARY for of, each in (("a", 0.5), ("b", 0.75))}
    # Three differ, one of them to A: McNemar's exact test.
    told |= {"paired": 5, "changed": 4, "only_a_right": 1, "only_b_right": 2, "p": 1.0}
    assert row == KEY | told
    content = ["5 the same", "1 with other content, such as 2mm/r3"]
    assert compare.recordings_that_differ(*listed) == content


# Kills: comparing sections as wholes; a key of one side that is passed over.
def test_settings_and_code_that_differ_are_named():
    a = {"preprocessing": {"window": 84, "threshold": 1.0}, "detectors": ["template", "diagonal"]}
    b = a | {"preprocessing": {"window": 40, "threshold": 1.0}, "taught": {"height": 10}}
    differing = ["preprocessing.window: 84 -> 40", "taught.height: none -> 10"]
    assert compare.settings_that_differ(a, b) == differing
    assert compare.settings_that_differ(a, a) == ["the same"]
    steps = {"fit.py": "1", "list.py": "2"}
    assert compare.steps_that_differ(steps, steps | {"fit.py": "3"}) == ["other code of fit.py"]
    assert compare.steps_that_differ(None, {}) == ["not known: an earlier version made one of them"]


def test_a_folder_without_results_is_refused(tmp_path):
    with pytest.raises(CapsuleError, match=r"no detectors.json.*capsule report"):
        run_command("compare", tmp_path, tmp_path)
