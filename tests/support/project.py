"""Copy the project with other recordings, and run Snakemake in the copy."""

import csv
import fcntl
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import pytest
import yaml

from support.synthetic import write_archive

ROOT = Path(__file__).parents[2]
PARTS = ["Snakefile", "workflow", "config", "profiles"]
# What Snakemake's log says of a job, as the rules have it, and the job's rule.
_MESSAGES = re.compile(r'^(?:use rule \w+ as|rule) (\w+).*?message:\n *"(.+?)"', re.M | re.S)
RULES = {
    re.sub(r"\{.+?\}", r"\\S+", message): rule
    for path in (ROOT / "workflow" / "rules").glob("*.smk")
    for rule, message in _MESSAGES.findall(path.read_text(encoding="utf-8"))
}
# The line of a job in a run, and in a dry run.
JOB = re.compile(r"^(?:\d+ of \d+|Job \d+): (?!everything$)(.+)", re.MULTILINE)
# With these, `coverage` counts which branches run in the jobs, beside what `pytest --cov` counts.
MEASURED = {
    "COVERAGE_PROCESS_START": str(ROOT / "pyproject.toml"),
    "COVERAGE_FILE": str(ROOT / ".coverage"),
}


class Project:
    """A copy of the project.

    Parameters
    ----------
    folder : Path
        The folder of the copy.

    Attributes
    ----------
    measured : bool
        Whether `coverage` counts which branches the jobs run.
    """

    measured: ClassVar[bool] = False

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.raw = folder / "raw"
        self.results = folder / "results"

    @classmethod
    def create(
        cls,
        folder: Path,
        recordings: Sequence[str] = (),
        samples: int = 700,
        **fit: int,
    ) -> "Project":
        """Return a copy of the project's code and configuration, with other recordings and fits.

        Parameters
        ----------
        folder : Path
            The folder of the copy.
        recordings : sequence of str
            Names such as ``3mm/r01``; a formula makes these recordings.
        samples : int
            Number of samples K of these recordings.
        **fit : int
            Changed keys of section ``fit`` of the configuration.
        """
        folder.mkdir(parents=True)
        for part in PARTS:
            copy = shutil.copytree if (ROOT / part).is_dir() else shutil.copy2
            copy(ROOT / part, folder / part)
        project = cls(folder)
        project.raw.mkdir()
        write_archive(project.raw, recordings, samples=samples)
        # The shipped session is held out of the shipped recordings alone.
        project.configure(fit=fit, evaluation={"held_out": []})
        return project

    def copy(self, folder: Path, *, keep_times: bool = True, results: bool = True) -> "Project":
        """Return a copy; without times as after a new checkout, or without results and notes."""
        function = shutil.copy2 if keep_times else shutil.copyfile
        shutil.copytree(self.folder, folder, copy_function=function, symlinks=True)
        if not results:
            for made in ("results", ".snakemake"):
                shutil.rmtree(folder / made)
        return Project(folder)

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
        """Call snakemake as a user does, with additional environment variables."""
        called = self._call(arguments, cores, environment)
        done = subprocess.run(**called, capture_output=True, check=False)
        return Run(done.returncode, done.stdout + done.stderr)

    def start(self, *arguments: str, cores: int = 1) -> subprocess.Popen[str]:
        """Start snakemake in its own process group, so that a test can kill the whole group.

        The process's standard output also contains the errors.
        """
        return subprocess.Popen(
            **self._call(arguments, cores),
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )

    def _call(
        self, arguments: Sequence[str], cores: int, environment: Mapping[str, str] | None = None
    ) -> dict[str, Any]:
        """Return the arguments with which `subprocess` calls snakemake."""
        # Warnings are errors in the jobs too, except for files that Snakemake does not close.
        strict = {"PYTHONPATH": "", "PYTHONWARNINGS": "error,ignore::ResourceWarning"}
        return {
            "args": [sys.executable, "-m", "snakemake", f"-c{cores}", *arguments],
            "cwd": self.folder,
            "env": {
                **os.environ,
                **strict,
                **(MEASURED if self.measured else {}),
                **(environment or {}),
            },
            "text": True,
        }

    def table(self, name: str) -> list[dict[str, str]]:
        """Read a table of the results, such as ``recordings.csv``; every cell is a text."""
        with (self.results / name).open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    def result_bytes(self) -> dict[str, bytes]:
        """Return the content of every result, without the logs and the sign of the run."""
        return {
            path.relative_to(self.results).as_posix(): path.read_bytes()
            for path in sorted(self.results.rglob("*"))
            if path.is_file() and path.relative_to(self.results).parts[0] not in ("logs", "run.txt")
        }


class Run:
    """The result of a call of snakemake.

    Attributes
    ----------
    status : int
        The exit status.
    output : str
        What Snakemake has printed.
    jobs : Counter
        The number of jobs of each rule that have started, or would start in a dry run. The rules
        that only name targets do not count.
    """

    def __init__(self, status: int, output: str) -> None:
        self.status, self.output = status, output
        self.jobs = Counter(map(rule_of, JOB.findall(output)))

    @property
    def did_nothing(self) -> bool:
        """Return whether snakemake printed that there is nothing to do."""
        return self.status == 0 and "Nothing to be done" in self.output and not self.jobs


def rule_of(message: str) -> str:
    """Return the rule of a job from its message in Snakemake's log."""
    (rule,) = (rule for text, rule in RULES.items() if re.fullmatch(text, message))
    return rule


def built_once(
    tmp_path_factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]
) -> Path:
    """Return a folder that all processes of a test run share; the first that asks makes it.

    Parameters
    ----------
    tmp_path_factory : TempPathFactory
        Gives the folder of the process.
    name : str
        Name of the folder.
    make : callable
        ``make(folder)`` makes the folder.
    """
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent
    folder, finished = shared / name / "project", shared / f"{name}.finished"
    with (shared / f"{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not finished.exists():
            make(folder)
            finished.touch()
    return folder
