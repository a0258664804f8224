"""Make the header lines that name the origin of an imported recording."""

from collections.abc import Sequence
from pathlib import Path

from capsule.importing.mapped_runs import Guess, Run
from capsule.importing.source_files import Source
from capsule.names import displayed

_LONGEST_ENTRY = 300


def origin_lines(
    files: Sequence[Path],
    sources: Sequence[Source],
    run: Run,
    guess: Guess,
    guesses: Sequence[Guess],
) -> dict[str, str]:
    """Return the header lines with a recording's origin: files, columns, time and unit."""
    table, choice = guess.table, guess.choice
    names = [displayed(file.name) for file in files]
    origin = {
        "source": f"imported from {', '.join(names)}",
        "import_file": ", ".join(names),
        "import_sha256": ", ".join(source.sha256 for source in sources),
    }
    if table.kind:
        origin[f"import_{table.kind}"] = table.label
    if run.label:
        origin["import_run"] = run.label
    columns = (
        [each.table.column_label(each.choice.sensors[0]) for each in guesses]
        if len(files) > 1
        else [table.column_label(index) for index in choice.sensors]
    )
    time = "none" if choice.time is None else table.column_label(choice.time)
    named = [f"time = {time}"] + [f"sensor_{n} = {each}" for n, each in enumerate(columns, start=1)]
    origin["import_columns"] = "; ".join(named)
    origin["import_time"] = f"{guess.clock.unit}, {guess.clock.reason}"
    origin["import_unit"] = f"{guess.unit.unit}, {guess.unit.reason}"
    if table.passed_over:
        origin["import_passed_over"] = f"{len(table.passed_over)} lines without a whole sample"
    return {key: displayed(text)[:_LONGEST_ENTRY] for key, text in origin.items()}
