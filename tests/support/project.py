"""Copy the project with other recordings, and run Snakemake in the copy."""

import csv
import fcntl
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path

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
# Warnings are errors in the jobs too, except for files that Snakemake does not close.
STRICT = {"PYTHONPATH": "", "PYTHONWARNINGS": "error,ignore::ResourceWarning"}
# With these, `coverage` counts which branches run in the jobs, beside what `pytest --cov` counts.
MEASURED = {
    "COVERAGE_PROCESS_START": str(ROOT / "pyproject.toml"),
    "COVERAGE_FILE": str(ROOT / ".coverage"),
}


class Project:
    """A copy of the project; where `measured`, `coverage` counts which branches the jobs run."""

    measured = False

    def __init__(self, folder):
        self.folder = folder
        self.raw = folder / "raw"
        self.results = folder / "results"

    @classmethod
    def create(cls, folder, recordings=(), samples=700, **fit):
        """Copy code and configuration; make recordings of these names, and change keys of `fit`."""
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

    def copy(self, folder, *, keep_times=True, results=True):
        """Return a copy; without times as after a new checkout, or without results and notes."""
        function = shutil.copy2 if keep_times else shutil.copyfile
        shutil.copytree(self.folder, folder, copy_function=function, symlinks=True)
        if not results:
            for made in ("results", ".snakemake"):
                shutil.rmtree(folder / made)
        return Project(folder)

    def configure(self, **changes):
        """Change keys of config.yaml; a dict changes keys of a section."""
        path = self.folder / "config" / "config.yaml"
        config = yaml.safe_load(path.read_text(encoding="utf-8"))
        for key, value in changes.items():
            config[key] = config[key] | value if isinstance(value, dict) else value
        path.write_text(yaml.safe_dump(config), encoding="utf-8")

    def append(self, file, text):
        """Add text to the end of a file."""
        with (self.folder / file).open("a", encoding="utf-8") as stream:
            stream.write(text)

    def snakemake(self, *arguments, cores=2, environment=()):
        """Call snakemake as a user does, with additional environment variables."""
        called = self._call(arguments, cores, environment)
        done = subprocess.run(**called, capture_output=True, check=False)
        return Run(done.returncode, done.stdout + done.stderr)

    def start(self, *arguments, cores=1, environment=()):
        """Start snakemake in a process group of its own; its output also contains the errors."""
        to = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "start_new_session": True}
        return subprocess.Popen(**self._call(arguments, cores, environment), **to)

    def _call(self, arguments, cores, environment=()):
        environment = os.environ | STRICT | (MEASURED if self.measured else {}) | dict(environment)
        words = [sys.executable, "-m", "snakemake", f"-c{cores}", *arguments]
        return {"args": words, "cwd": self.folder, "env": environment, "text": True}

    def table(self, name):
        """Read a table of the results, such as ``recordings.csv``; every cell is a text."""
        with (self.results / name).open(encoding="utf-8", newline="") as stream:
            return list(csv.DictReader(stream))

    def result_bytes(self):
        """Return the content of every result, without the logs and the sign of the run."""
        return {
            path.relative_to(self.results).as_posix(): path.read_bytes()
            for path in sorted(self.results.rglob("*"))
            if path.is_file() and path.relative_to(self.results).parts[0] not in ("logs", "run.txt")
        }


class Run:
    """The exit status and the output of a call of snakemake, and its `jobs` by their rules.

    In a dry run these are the jobs that would start. Rules that only name targets do not count.
    """

    def __init__(self, status, output):
        self.status, self.output = status, output
        self.jobs = Counter(map(rule_of, JOB.findall(output)))

    @property
    def did_nothing(self):
        """Return whether snakemake printed that there is nothing to do."""
        return self.status == 0 and "Nothing to be done" in self.output and not self.jobs


def rule_of(message):
    """Return the rule of a job from its message in Snakemake's log."""
    (rule,) = (rule for text, rule in RULES.items() if re.fullmatch(text, message))
    return rule


def built_once(tmp_path_factory, name, make):
    """Return a folder that all processes of a test run share; the first calls `make(folder)`."""
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
