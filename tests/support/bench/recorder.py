"""Run capsule record as a user does."""

import atexit
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from capsule.interface.archive import read_recording
from capsule.recordings.recording import Recording
from support.command import CAPSULE


class Recorder:
    """A running recorder with its files in a test's folder; one that a test leaves is killed."""

    def __init__(self, folder: Path, *options: str, **settings: object) -> None:
        self.raw = folder / "raw"
        command = [*CAPSULE, "record", *options, "--raw", self.raw, "--logs", folder / "logs"]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        self.process = subprocess.Popen(
            [str(word) for word in command], text=True, encoding="utf-8", **(pipes | settings)
        )
        atexit.register(self.process.kill)

    def done(self) -> bool:
        """Return whether the program has ended."""
        return self.process.poll() is not None

    def recording(self) -> Recording:
        """Return the only recording in the archive."""
        (path,) = self.raw.rglob("*.csv")
        return read_recording(path, 4)

    def parts(self) -> list[Path]:
        """Return the paths of the unfinished recordings."""
        return list(self.raw.rglob("*.part"))

    def wait_for_samples(self, count: int) -> None:
        """Wait until so many samples, including missing ones, are on the disk."""

        def are_there() -> bool:
            text = "".join(part.read_text(encoding="utf-8") for part in self.parts())
            return sum(line[:1].isdigit() for line in text.splitlines()) >= count

        wait_until(are_there)

    def expect(self, status: int, *words: str) -> None:
        """Check the exit status, the output and the error message of the program at its end."""
        printed, errors = self.process.communicate(timeout=20)
        assert self.process.returncode == status, f"{printed}\n{errors}"
        assert errors.count("error: ") == bool(status) == bool(errors), errors
        assert "Traceback" not in errors, errors
        for word in words:
            assert word in printed + errors, f"{word!r} not in:\n{printed}\n{errors}"


def wait_until(happened: Callable[[], bool], limit_s: float = 30.0) -> None:
    """Wait for a condition; raise `TimeoutError` if it does not hold in time."""
    until_s = time.monotonic() + limit_s
    while not happened():
        if time.monotonic() > until_s:
            raise TimeoutError(f"the condition did not hold within {limit_s:g} s")
        time.sleep(0.02)
