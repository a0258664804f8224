"""Compare two folders of results: what they were made from, and what that did to the verdicts.

Verdicts are paired over the recordings that both folders hold with the same content.
"""

import argparse
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from capsule import words
from capsule.detectors.files import read_learned
from capsule.errors import CapsuleError
from capsule.evaluation.files import read_table
from capsule.evaluation.intervals import Units
from capsule.evaluation.measures import sign_test
from capsule.evaluation.rates import is_right, of_any
from capsule.store import files
from capsule.store.results import OfArchive

EPILOG = """
To try another setting without touching your results, run in a folder of its own:
  capsule new trial && cp -r raw trial/      then change trial/config/config.yaml, and
  cd trial && capsule report && capsule compare ../results results
"""
_PAIR = ["detector", "scheme", "recording"]
_COLUMNS = ["detector", "scheme", "sensitivity_a", "sensitivity_b", "specificity_a"]
_COLUMNS += ["specificity_b", "paired", "changed", "only_a_right", "only_b_right", "p"]
_SHOWN = ["detector", "scheme", "sensitivity", "specificity", "paired", "changed", "right in A, B"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.epilog = EPILOG
    for name in ("A", "B"):
        what = "a folder of results, such as results/"
        parser.add_argument(name.lower(), type=Path, metavar=name, help=what)
    table = "write the table of rates and paired verdicts to a file"
    parser.add_argument("--csv", type=Path, metavar="FILE", help=table)


def main(arguments: argparse.Namespace) -> None:
    """Print what differs, and the table.

    Raises
    ------
    CapsuleError
        A folder holds no results.
    """
    folders = arguments.a, arguments.b
    for folder in folders:
        if not (folder / OfArchive.DETECTORS).is_file():
            raise CapsuleError(
                f"{folder} holds no {OfArchive.DETECTORS}, so it is no folder of results; "
                "make it in the folder above it: capsule report"
            )
    made = [read_learned(folder / OfArchive.DETECTORS) for folder in folders]
    listed = [read_table(folder / OfArchive.RECORDINGS) for folder in folders]
    for name, text in (
        ("settings", settings_that_differ(made[0]["settings"], made[1]["settings"])),
        ("code", steps_that_differ(made[0].get("code"), made[1].get("code"))),
        ("recordings", recordings_that_differ(*listed)),
    ):
        print(f"{name + ':':<12}{f'{chr(10)}{chr(32) * 12}'.join(text)}")
    table = compared(folders, listed)
    print(f"A is {folders[0]}, B is {folders[1]}")
    rows = [_SHOWN, *map(_shown, table.to_dict("records"))]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        print("  ".join(map(str.ljust, row, widths)).rstrip())
    if arguments.csv:
        with files.write_whole(arguments.csv) as stream:
            table.to_csv(stream, index=False, lineterminator="\n")


def _leaves(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in settings.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def settings_that_differ(a: Mapping[str, Any], b: Mapping[str, Any]) -> list[str]:
    """Return each setting that differs, with both values; those of no effect are not stored."""
    first, second = dict(_leaves(a)), dict(_leaves(b))
    keys = [key for key in {**first, **second} if first.get(key) != second.get(key)]
    values = [[words.setting(each.get(key, "none")) for each in (first, second)] for key in keys]
    told = [f"{key}: {' -> '.join(both)}" for key, both in zip(keys, values, strict=True)]
    return told or ["the same"]


def steps_that_differ(a: Mapping[str, str] | None, b: Mapping[str, str] | None) -> list[str]:
    """Return the steps whose code differs."""
    if a is None or b is None:
        return ["not known: an earlier version made one of them"]
    steps = [step for step in {**a, **b} if a.get(step) != b.get(step)]
    return [f"other code of {words.enumerate_words(steps)}" if steps else "the same"]


def recordings_that_differ(a: pd.DataFrame, b: pd.DataFrame) -> list[str]:
    """Return how many recordings are the same, changed, or in one folder alone."""
    first, second = (each.set_index("recording")["sha256"].to_dict() for each in (a, b))
    both = first.keys() & second.keys()
    same = {name for name in both if first[name] == second[name]}
    told = [f"{len(same)} the same"]
    for what, names in (
        ("with other content", both - same),
        ("in A alone", first.keys() - both),
        ("in B alone", second.keys() - both),
    ):
        if names:
            told.append(f"{len(names)} {what}, such as {min(names)}")
    return told


def compared(folders: tuple[Path, Path], listed: list[pd.DataFrame]) -> pd.DataFrame:
    """Return the rates of both folders and the paired verdicts, a row a detector and scheme."""
    rates = [read_table(folder / OfArchive.EVALUATION / "summary.csv") for folder in folders]
    # In a table of an earlier version, which has no sizes, all rows are of any nodule.
    rates = [of_any(each) if "size_mm" in each else each for each in rates]
    rates = [each[["detector", "scheme", "sensitivity", "specificity"]] for each in rates]
    table = rates[0].merge(rates[1], how="outer", on=_PAIR[:2], suffixes=("_a", "_b"), sort=False)
    contents = listed[0].merge(listed[1], on=["recording", "sha256", "size_mm"])["recording"]
    verdicts = [read_table(folder / OfArchive.PREDICTIONS) for folder in folders]
    pairs = verdicts[0].merge(verdicts[1], on=[*_PAIR, "size_mm"], suffixes=("_a", "_b"))
    pairs = pairs[pairs["recording"].isin(contents)]
    cells = {key: _paired(of_key) for key, of_key in pairs.groupby(_PAIR[:2])}
    paired = [
        cells.get((row.detector, row.scheme), _paired(pairs[:0])) for row in table.itertuples()
    ]
    return pd.concat([table, pd.DataFrame(paired, index=table.index)], axis=1)[_COLUMNS]


def _paired(pairs: pd.DataFrame) -> dict[str, float]:
    true_mm, a, b = (
        pairs[name].to_numpy() for name in ("size_mm", "predicted_mm_a", "predicted_mm_b")
    )
    first, second = is_right(a, true_mm), is_right(b, true_mm)
    return {
        "paired": len(pairs),
        "changed": int(np.sum((a != b) & ~(np.isnan(a) & np.isnan(b)))),
        "only_a_right": int(np.sum(first & ~second)),
        "only_b_right": int(np.sum(second & ~first)),
        "p": sign_test(first, second, Units.of_places(np.arange(len(pairs)))),
    }


def _shown(row: Mapping[Any, Any]) -> list[str]:
    rates = [
        f"{words.percent(row[f'{rate}_a'])} -> {words.percent(row[f'{rate}_b'])}"
        for rate in ("sensitivity", "specificity")
    ]
    won = f"{row['only_a_right']}, {row['only_b_right']} {words.p_value(row['p'])}"
    counts = [str(row["paired"]), str(row["changed"])]
    return [row["detector"], words.scheme(row["scheme"]), *rates, *counts, won]
