"""A copy of the project with its own recordings, in which tests run Snakemake for real."""

import csv
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import yaml

from support.preloaded import ForkedCall, PreloadedSnakemake
from support.synthetic import write_archive

ROOT = Path(__file__).parents[2]
PARTS = ["Snakefile", "workflow", "config", "profiles", "environment.yml"]


class Project:
    """A project folder.

    Parameters
    ----------
    folder : Path
        Where it lies.
    preloaded : PreloadedSnakemake, optional
        By which it, and its copies, call snakemake; that of the test run if not given.

    Attributes
    ----------
    preloaded_for_all : PreloadedSnakemake or None
        That of the test run; without it each call starts snakemake anew.
    """

    preloaded_for_all: ClassVar[PreloadedSnakemake | None] = None

    def __init__(self, folder: Path, preloaded: PreloadedSnakemake | None = None) -> None:
        self.folder, self.preloaded = folder, preloaded or self.preloaded_for_all
        self.raw = folder / "raw"
        self.results = folder / "results"

    @classmethod
    def create(
        cls, folder: Path, recordings: Sequence[str] = (), samples: int = 700, **fit: int
    ) -> "Project":
        """Copy the project's code and configuration, with other recordings and a smaller fit.

        Parameters
        ----------
        folder : Path
            Where it will lie.
        recordings : sequence of str
            Names such as ``3mm/r01``: recordings made by formula.
        samples : int
            K of these recordings.
        **fit : int
            Changed keys of section ``fit`` of the configuration.
        """
        folder.mkdir(parents=True)
        for part in PARTS:
            source = ROOT / part
            if source.is_dir():
                shutil.copytree(source, folder / part)
            else:
                shutil.copy2(source, folder / part)
        project = cls(folder)
        project.raw.mkdir()
        write_archive(project.raw, recordings, samples=samples)
        project.configure(fit=fit)
        return project

    def copy(self, folder: Path, *, keep_times: bool = True) -> "Project":
        """Copy everything, results too; without times it is as after a fresh checkout."""
        function = shutil.copy2 if keep_times else shutil.copyfile
        shutil.copytree(self.folder, folder, copy_function=function, symlinks=True)
        return Project(folder, self.preloaded)

    def configure(self, **changes: object) -> None:
        """Change keys of config.yaml; a dict changes keys of a section."""
        path = self.folder / "config" / "config.yaml"
        config = yaml.safe_load(path.read_text(encoding="utf-8"))
        for key, value in changes.items():
            if isinstance(value, dict):
                config[key].update(value)
            else:
                config[key] = value
        path.write_text(yaml.safe_dump(config), encoding="utf-8")

    def append(self, file: str, text: str) -> None:
        """Add text to the end of a file."""
        with (self.folder / file).open("a", encoding="utf-8") as stream:
            stream.write(text)

    def snakemake(
        self, *arguments: str, cores: int = 2, environment: Mapping[str, str] | None = None
    ) -> "Run":
        """Call snakemake as a user does, with more environment variables where given."""
        if self.preloaded and environment is None:
            with self.start(*arguments, cores=cores) as process:
                output = process.stdout.read()
            return Run(process.returncode, output)
        called = self._call(arguments, cores, environment)
        done = subprocess.run(**called, capture_output=True, check=False)
        return Run(done.returncode, done.stdout + done.stderr)

    def start(self, *arguments: str, cores: int = 1) -> subprocess.Popen[str] | ForkedCall:
        """Start snakemake in a process group of its own, which can be killed as a whole.

        What it prints, errors too, is the process's standard output.
        """
        if self.preloaded:
            called = self._call(arguments, cores)
            return self.preloaded.start(called["args"][3:], self.folder, called["env"])
        return subprocess.Popen(
            **self._call(arguments, cores),
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def _call(
        self, arguments: Sequence[str], cores: int, environment: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """Say how `subprocess` is to call snakemake."""
        # Warnings are errors in the jobs too, but for files that Snakemake leaves to be closed.
        strict = {"PYTHONPATH": "", "PYTHONWARNINGS": "error,ignore::ResourceWarning"}
        return {
            "args": [sys.executable, "-m", "snakemake", f"-c{cores}", *arguments],
            "cwd": self.folder,
            "env": {**os.environ, **strict, **(environment or {})},
            "text": True,
        }

    def table(self, name: str) -> list[dict[str, str]]:
        """Read a table of the results, such as ``recordings.csv``; every cell as text."""
        with (self.results / name).open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    def result_bytes(self) -> dict[str, bytes]:
        """Give the content of every result but the logs, which hold durations, and the records."""
        return {
            path.relative_to(self.results).as_posix(): path.read_bytes()
            for path in sorted(self.results.rglob("*"))
            if path.is_file() and path.relative_to(self.results).parts[0] not in ("logs", "records")
        }


class Run:
    """What a call of snakemake did."""

    def __init__(self, status: int, output: str) -> None:
        self.status = status
        self.output = output
        self.jobs = Counter(re.findall(r"^- (\w+)", output, re.MULTILINE))

    @property
    def did_nothing(self) -> bool:
        """Tell whether snakemake said that there is nothing to do."""
        return self.status == 0 and "Nothing to be done" in self.output and not self.jobs
