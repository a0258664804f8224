"""Preprocess the recordings of a set that are not up to date, each as preprocess.py does."""

from pathlib import Path

from capsule.kinds import Settings
from edges import files
from edges.recording_files import recording_files
from edges.set_jobs import make_set
from preprocess import preprocess_recording


def make(raw: Path, results: Path, name: str, settings: Settings) -> None:
    """Preprocess one recording."""
    outputs = recording_files(results, "preprocess", name)
    preprocess_recording(raw / f"{name}.csv", name, settings, outputs)


def main() -> None:
    """Preprocess a set."""
    make_set("preprocess", make, __doc__)


if __name__ == "__main__":
    files.run(main)
