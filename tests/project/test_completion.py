"""The completion of the command capsule works in a real bash."""

import os
import select
import subprocess
import time

import pytest

from capsule.commands import completion
from capsule.commands.cli import COMMANDS, subparsers
from support.command import CAPSULE, parsers

pytestmark = pytest.mark.takes(0.2)

pty = pytest.importorskip("pty", reason="this system has no pseudo-terminals")


def options_of(parser):
    return {option for action in parser._actions for option in action.option_strings}


def test_completion_knows_every_option_of_every_command():
    completed = subparsers(completion.whole_parser())
    assert list(completed) == list(COMMANDS)
    for word, parser in parsers().items():
        assert options_of(completed[word]) == options_of(parser)
        assert len(options_of(parser)) > 2 or word in ("completion", "new")


@pytest.fixture(scope="module")
def script(tmp_path_factory):
    """Write the completion script for bash, and return its path."""
    path = tmp_path_factory.mktemp("completion") / "capsule.bash"
    with path.open("wb") as stream:
        command = [*CAPSULE, "completion", "bash"]
        subprocess.run(command, stdout=stream, check=True)
    return path


def test_the_script_is_valid(script):
    subprocess.run(["bash", "-n", script], check=True)


class Bash:
    """A bash in a pseudo-terminal."""

    def __init__(self, folder, script):
        self._keyboard, screen = pty.openpty()
        environment = {"PATH": os.environ["PATH"], "PS1": "ready ", "TERM": "dumb"}
        self.process = subprocess.Popen(
            ["bash", "--norc", "--noprofile", "-i"],
            stdin=screen,
            stdout=screen,
            stderr=screen,
            cwd=folder,
            env=environment,
            start_new_session=True,
        )
        os.close(screen)
        self.see("ready ")
        self.type("bind 'set bell-style none'; bind 'set completion-query-items 0'\n", "ready ")
        self.type(f"source {script}\n", "ready ")

    def type(self, keys, wanted):
        """Type keys, wait until a text is on the screen, and return the output."""
        os.write(self._keyboard, keys.encode())
        return self.see(wanted)

    def see(self, wanted, limit_s=20):
        """Wait until a text is on the screen, and return the output."""
        seen, deadline = "", time.monotonic() + limit_s
        while wanted not in seen:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self._keyboard], [], [], left)[0]:
                raise AssertionError(f"{wanted!r} did not come, but {seen!r}")
            seen += os.read(self._keyboard, 4096).decode()
        return seen

    def end(self):
        """Close the terminal."""
        self.process.kill()
        self.process.wait()
        os.close(self._keyboard)


@pytest.fixture
def bash(tmp_path, script):
    (tmp_path / "monday.csv").touch()
    made = Bash(tmp_path, script)
    yield made
    made.end()


@pytest.mark.parametrize(
    ("keys", "wanted"),
    [
        ("capsule sur\t", "capsule survey "),
        ("capsule judge --pi\t", "capsule judge --picture "),
        ("capsule record --size 3 --unl\t", "capsule record --size 3 --unlabelled "),
        ("capsule judge mon\t", "capsule judge monday.csv "),
        ("capsule completion ba\t", "capsule completion bash "),
    ],
)
def test_bash_completes_what_can_be_only_one_thing(bash, keys, wanted):
    bash.type(keys, wanted)


def test_bash_lists_every_option(bash):
    listed = bash.type("capsule judge --\t\t", "ready ")
    assert options_of(parsers()["judge"]) - {"-h"} <= set(listed.split())


def test_bash_lists_the_sizes(bash):
    listed = bash.type("capsule record --size \t\t", "ready ")
    assert set(completion.SIZES_MM) <= set(listed.split())


@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_other_shells_are_told_the_same_words_and_options(shell):
    text = completion.shtab.complete(completion.whole_parser(), shell)
    assert all(word in text for word in COMMANDS)
    for option in options_of(parsers()["judge"]) - {"-h"}:
        assert option.removeprefix("--") in text
