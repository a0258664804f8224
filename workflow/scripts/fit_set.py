"""Fit the recordings of a set whose fits are not up to date, each as fit.py does."""

from pathlib import Path

from capsule.kinds import Settings
from edges import files
from edges.recording_files import recording_files
from edges.set_jobs import make_set
from fit import fit_matrix


def make(raw: Path, results: Path, name: str, settings: Settings) -> None:
    """Fit one recording."""
    signal, matrix, _ = recording_files(results, "preprocess", name)
    (output,) = recording_files(results, "fit", name)
    fit_matrix(matrix, signal, name, settings, output)


def main() -> None:
    """Fit a set."""
    make_set("fit", make, __doc__)


if __name__ == "__main__":
    files.run(main)
