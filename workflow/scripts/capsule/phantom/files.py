"""Read the phantom's parameters and its benches, and the options that choose them."""

import argparse
from pathlib import Path

import yaml

from capsule.engine.project import CONFIG
from capsule.errors import CapsuleError
from capsule.phantom.parameters import (
    Phantom,
    bench_values,
    nearest,
    parsed,
    phantom_from_table,
    with_values,
)

DEFAULT_TABLE = CONFIG / "phantom.yaml"
BENCHES = CONFIG / "benches"


def bench_file(name: str) -> Path:
    """Return the file of a bench; the error for an unknown name suggests the nearest one."""
    benches = {path.stem: path for path in sorted(BENCHES.glob("*.yaml"))}
    if name not in benches:
        near = nearest(name, benches)
        hint = f"did you mean {near}?" if near else f"allowed are {', '.join(benches)}"
        raise CapsuleError(f"there is no bench {name} in {BENCHES}; {hint}")
    return benches[name]


def read_phantom(table: Path, changes: list[str], bench: str | None = None) -> Phantom:
    """Read the table of parameters, then apply the differences of a bench, then the changes.

    Parameters
    ----------
    table
        A complete table, such as ``config/phantom.yaml``.
    changes
        Texts of the form ``part.parameter=value``.
    bench
        Name of a file in ``config/benches/``, without its suffix.

    Raises
    ------
    CapsuleError
        The table, the bench or a change cannot be used; the message names it.
    """
    differing = None if bench is None else bench_file(bench)
    path = table
    try:
        content = yaml.safe_load(table.read_text(encoding="utf-8"))
        phantom = phantom_from_table(content)
        if differing is not None:
            path = differing
            differences = yaml.safe_load(path.read_text(encoding="utf-8"))
            phantom = with_values(phantom, bench_values(content, differences))
    except (yaml.YAMLError, CapsuleError) as error:
        raise CapsuleError(f"{path}: {error}") from error
    return with_values(phantom, dict(map(parsed, changes)))


def add_phantom_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that choose the phantom."""
    add = parser.add_argument
    table = "table of the phantom's parameters (default: config/phantom.yaml)"
    add("--parameters", type=Path, default=DEFAULT_TABLE, metavar="FILE", help=table)
    bench = "simulate the bench of config/benches/NAME.yaml (workflow/studies/benches.md)"
    add("--bench", metavar="NAME", help=bench)
    change = "change a parameter, such as sensor.noise=0.01; may be repeated"
    add("--set", dest="changes", action="append", default=[], metavar="NAME=VALUE", help=change)
