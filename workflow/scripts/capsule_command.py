"""The command `capsule`, with a subcommand for each task.

Each subcommand (in the code: word) runs a script beside this one, with the script's options, errors
and exit status. This module imports nothing else before it knows the subcommand.
"""

import sys
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).resolve().parent
# In the project the scripts are in this folder; an installed package has its own folder for them.
INSTALLED = HERE / "capsule_project" / "workflow" / "scripts"
SCRIPTS = HERE if (HERE / "acquire.py").exists() else INSTALLED
WORDS = {
    "record": ("acquire.py", "record a run of the capsule from the logger board"),
    "survey": ("survey.py", "survey a gut: go back to each suspected nodule, and test it again"),
    "simulate": ("simulate.py", "simulate recordings with the model of the paper's phantom"),
    "import": ("import_recordings.py", "import recordings from other programs' files into raw/"),
    "export": ("export.py", "write recordings and results for other programs"),
    "judge": ("judge_file.py", "judge a recording by every detector"),
    "report": ("make_report.py", "make results/report.html from the recordings in raw/"),
    "verify": ("verify.py", "make all results again elsewhere, and name each that differs"),
    "demo": ("demo.py", "play a simulated run, judge it live, and make its report"),
    "completion": ("shell_completion.py", "print a script with which your shell completes capsule"),
}


def help_text() -> str:
    """Return the help text with all subcommands."""
    width = max(map(len, WORDS))
    lines = [f"  {word:<{width}}  {line}" for word, (_, line) in WORDS.items()]
    hint = "capsule COMMAND --help shows the options of a command."
    return "\n".join(["usage: capsule COMMAND [options]", "", *lines, "", hint])


def unknown(word: str) -> str:
    """Return the error for an unknown subcommand, with the nearest known one."""
    from difflib import get_close_matches  # only if it is used

    nearest = get_close_matches(word, WORDS, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"the commands are {', '.join(WORDS)}"
    return f"error: capsule has no command {word!r}; {hint}"


def run(script: Path) -> None:
    """Run a script as Python does, but as the main module of this process."""
    module = ModuleType("__main__")
    module.__file__ = str(script)
    sys.modules["__main__"] = module
    exec(compile(script.read_bytes(), script, "exec"), vars(module))


def main() -> None:
    """Run the script of the subcommand with the rest of the command line."""
    if len(sys.argv) < 2 or sys.argv[1] in ("-h", "--help"):
        print(help_text())
        sys.exit(0 if len(sys.argv) > 1 else 2)
    word, *options = sys.argv[1:]
    if word not in WORDS:
        print(unknown(word), file=sys.stderr)
        sys.exit(2)
    script = SCRIPTS / WORDS[word][0]
    if not script.exists():
        sys.exit(f"error: {script} is missing; install the project again")
    sys.argv = [f"capsule {word}", *options]
    sys.path.insert(0, str(SCRIPTS))
    try:
        run(script)
    except KeyboardInterrupt:  # if the script does not handle it
        sys.exit(130)


if __name__ == "__main__":
    main()
