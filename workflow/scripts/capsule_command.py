"""The command `capsule`: a word for each thing that people do with it.

Each word is a script beside this one and behaves as the script does: its options, its errors, its
exit status. Nothing else is imported before the word is known.
"""

import sys
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).resolve().parent
# In the project the scripts lie here; installed, they lie in a folder of their own beside it.
INSTALLED = HERE / "capsule_project" / "workflow" / "scripts"
SCRIPTS = HERE if (HERE / "acquire.py").exists() else INSTALLED
WORDS = {
    "record": ("acquire.py", "record a run of the capsule from the logger board"),
    "survey": ("survey.py", "survey a gut: go back to what looks like a nodule, look again"),
    "simulate": ("simulate.py", "simulate recordings with the model of the paper's phantom"),
    "import": ("import_recordings.py", "bring recordings from other programs' files into raw/"),
    "export": ("export.py", "write recordings and results for other programs"),
    "judge": ("judge_file.py", "judge a recording by every detector, at once"),
    "report": ("make_report.py", "make results/report.html from the recordings in raw/"),
    "demo": ("demo.py", "play a simulated run, judge it live, and make its report"),
    "completion": ("shell_completion.py", "print what completes this command in your shell"),
}


def help_text() -> str:
    """Say what the words are."""
    width = max(map(len, WORDS))
    lines = [f"  {word:<{width}}  {line}" for word, (_, line) in WORDS.items()]
    hint = "capsule WORD --help tells the options of a word."
    return "\n".join(["usage: capsule WORD [options]", "", *lines, "", hint])


def unknown(word: str) -> str:
    """Answer a word that is none with the nearest one."""
    from difflib import get_close_matches  # only where it is used

    nearest = get_close_matches(word, WORDS, n=1, cutoff=0.5)
    hint = f"did you mean {nearest[0]!r}?" if nearest else f"the words are {', '.join(WORDS)}"
    return f"error: there is no capsule {word!r}; {hint}"


def run(script: Path) -> None:
    """Run a script as Python itself would, but under the name that stands in the command line."""
    module = ModuleType("__main__")
    module.__file__ = str(script)
    sys.modules["__main__"] = module
    exec(compile(script.read_bytes(), script, "exec"), vars(module))


def main() -> None:
    """Run the script behind the first word of the command line with the other ones."""
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
    except KeyboardInterrupt:  # where the script has nothing to say of it
        sys.exit(130)


if __name__ == "__main__":
    main()
