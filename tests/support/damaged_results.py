"""Damage files under results/ at random, and call what reads them in a fork."""

import contextlib
import importlib
import importlib.util
import io
import json
import os
import pickle
import re
import resource
import shlex
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from capsule.commands import cli
from capsule.store import files
from support.damaged_files import damaged

MOST_BYTES, MOST_SECONDS = 1_000_000_000, 5.0
# A process that exceeds the limits by far is ended.
_END_BYTES, _END_SECONDS = 4 * MOST_BYTES, 60
KINDS = ("bytes", "cut", "doubled", "swapped", "word")
# Words of a table or of JSON, and what takes their place.
_WORD = re.compile(rb"[^,\n:{}\[\] \"]+")
_OTHER_WORDS = (
    b"",
    b"nan",
    b"-1",
    b"1e999",
    b"rejected",
    b"0",
    b"[1]",
    b"9" * 400,
    b"\xff",
    b"null",
)
# The rules whose jobs read results. `draw` takes long, and reads what `report` reads.
_RULES = ("list", "list_labelled", "fit", "describe", "templates", "evaluate", "detect", "report")


class Outcome(NamedTuple):
    """What came of a call.

    Attributes
    ----------
    status : int
        The exit status; -1 after a traceback, -2 if a signal has ended it.
    told : str
        What it printed as an error.
    seconds : float
        The time that the processor took.
    most_bytes : int
        The largest memory.
    """

    status: int
    told: str
    seconds: float = 0.0
    most_bytes: int = 0

    def fault(self, file: str, usual_s: float) -> str:
        """Return what is wrong with the answer to a damaged file; empty if nothing is.

        `usual_s` is the time that the call takes with a file that is whole.
        """
        if self.status < 0:
            return self.told
        if self.most_bytes > MOST_BYTES or self.seconds > usual_s + MOST_SECONDS:
            return f"{self.most_bytes / 1e6:.0f} MB, {self.seconds:.1f} s"
        if self.status == 0:
            return ""
        if self.told.startswith("error: no recording of a nodule can be used"):
            return ""  # a table that is cut at the end of a line is one of fewer recordings
        lines = self.told.strip().splitlines()
        errors = [line for line in lines if line.startswith("error: ")]
        if len(errors) != 1 or lines[-1] != errors[0]:
            return f"not one line: {self.told}"
        named = file in errors[0] or f"{Path(file).parent}/" in errors[0]
        remedy = "snakemake -c2" in errors[0] or "delete" in errors[0]
        return "" if named and remedy else f"no file or no remedy: {errors[0]}"


def change(content: bytes, other: bytes, kind: str, rng: np.random.Generator) -> bytes:
    """Return the content of a file with damage of one of `KINDS`.

    `other` is the content of the same file of another archive.
    """
    if kind == "bytes" or not content:
        return damaged(content, rng) if content else b"\0"
    if kind == "cut":
        return content[: int(rng.integers(len(content)))]
    if kind == "doubled":
        first, last = sorted(int(each) for each in rng.integers(len(content) + 1, size=2))
        return content[:last] + content[first:]
    if kind == "word" and (words := list(_WORD.finditer(content))):
        word = words[int(rng.integers(len(words)))]
        return content[: word.start()] + rng.choice(_OTHER_WORDS) + content[word.end() :]
    return other


def readers(folder: Path) -> dict[str, Callable[[], int | None]]:
    """Return what reads results of a finished project, by name; each may be called in a fork.

    Parameters
    ----------
    folder : Path
        The folder of the project, the working directory.
    """
    # What the readers need is imported once, and not in each fork.
    for word in ("judge", "export", "verify"):
        importlib.import_module(cli.COMMANDS[word].module)
    importlib.import_module("capsule.page.sections")
    called: dict[str, Callable[[], int | None]] = {}
    for path in sorted((folder / ".snakemake/metadata").iterdir()):
        note = json.loads(path.read_text(encoding="utf-8"))
        if note["rule"] in _RULES and note["rule"] not in called:
            words = shlex.split(note["shellcmd"].partition(" > ")[0])[1:]
            called[note["rule"]] = partial(_script, *words)
    one = sorted(folder.glob("raw/*/*.csv"))[-1].relative_to(folder).as_posix()
    called["judge"] = partial(_command, "judge", one)
    for what in ("all", "recordings", "fits"):
        called[f"export {what}"] = partial(_command, "export", "--format", "mat", "--what", what)
    called["verify"] = _compared
    called["end of a run"] = partial(_end_of_run, folder)
    called["forget"] = partial(_command, "forget", "--dry-run", one)
    return called


def _script(path: str, *words: str) -> int | None:
    spec = importlib.util.spec_from_file_location(f"script_{Path(path).stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.argv = [path, *words]
    return files.run(module.main)


def _command(*words: str) -> None:
    cli.main(words)


def _compared() -> None:
    from capsule.commands.verify import compare

    compare(Path("results"), Path("results"), "")


def _end_of_run(folder: Path) -> None:
    from capsule.engine.configuration import read_settings
    from capsule.engine.run import Run
    from capsule.store.results import batch_size, batches, described_together
    from capsule.survey.listed import list_surveys

    settings = read_settings(folder / "config/config.yaml")
    names = files.list_archive(Path("raw")).recordings
    size = batch_size(len(names), settings["recordings_per_job"])
    divided = batches(names, size), described_together(names, size)
    run = Run(
        "raw", "results", "sessions", settings, size, *divided, list_surveys(Path("sessions"))
    )
    files.run(partial(run.succeed, "0" * 20))


@contextlib.contextmanager
def _thrown_away(path: Path, mode: str = "w") -> Iterator[io.BytesIO | io.TextIOWrapper]:
    content = io.BytesIO()
    yield content if "b" in mode else io.TextIOWrapper(content, encoding="utf-8", newline="")


def call(reader: Callable[[], int | None], opened: Sequence[str] | None = None) -> Outcome:
    """Call a reader in a fork, which writes nothing.

    With a list `opened`, the results that it opens are added to the list.
    """
    receive, send = os.pipe()
    if (child := os.fork()) == 0:
        os.close(receive)
        _call_here(reader, send)
    os.close(send)
    with os.fdopen(receive, "rb") as stream:
        answer = stream.read()
    _, ended, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    if os.WIFSIGNALED(ended):
        return Outcome(-2, f"ended by signal {os.WTERMSIG(ended)} after {seconds:.1f} s")
    status, told, paths = pickle.loads(answer)
    if opened is not None:
        opened += paths
    return Outcome(status, told, seconds, used.ru_maxrss * 1024)


def _call_here(reader: Callable[[], int | None], send: int) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (_END_BYTES, _END_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (_END_SECONDS, _END_SECONDS))
    paths: list[str] = []

    def note(event: str, arguments: tuple[object, ...]) -> None:
        if event == "open" and isinstance(arguments[0], str | Path):
            path = str(arguments[0])
            if path.startswith("results/") and Path(path).is_file():
                paths.append(path)

    sys.addaudithook(note)
    files.write_whole = _thrown_away  # type: ignore[assignment]
    told, status = io.StringIO(), -1
    try:  # the process ends here, also after an exception
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(told):
            reader()
        status = 0
    except SystemExit as ended:
        status = ended.code if isinstance(ended.code, int) else 1
        told.write(ended.code if isinstance(ended.code, str) else "")
    finally:
        if status == -1:
            told.write(traceback.format_exc())
        with os.fdopen(send, "wb") as stream:
            stream.write(pickle.dumps((status, told.getvalue(), list(dict.fromkeys(paths)))))
        os._exit(0)


@cache
def kind_of(file: str) -> str:
    """Return the kind of a file: that of each recording or figure is one kind."""
    parts = Path(file).parts
    return f"{'/'.join(parts[:2])}/*{Path(file).suffix}" if len(parts) > 3 else file


def read_files(
    called: dict[str, Callable[[], int | None]],
) -> Iterator[tuple[str, float, dict[str, str]]]:
    """Yield each reader with the time that it takes, and a file of each kind that it opens."""
    for name, reader in called.items():
        opened: list[str] = []
        outcome = call(reader, opened)
        assert outcome.status == 0, (name, outcome)
        # A picture stands in the page as it is; nobody reads what is in it.
        read = [file for file in reversed(opened) if not file.endswith(".svg")]
        yield name, outcome.seconds, {kind_of(file): file for file in read}
