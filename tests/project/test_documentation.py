"""The documents describe the configuration as the schema does."""

from capsule.engine.configuration import allowed_values, read_schema
from capsule.evaluation.intervals import new_specificity, recordings_needed
from capsule.store.files import read_csv
from support.project import ROOT

SCHEMA = read_schema(ROOT / "workflow/schemas/config.schema.json")
README = (ROOT / "config/README.md").read_text(encoding="utf-8")


def described_keys(schema, path=""):
    """Yield every key that holds a value, with its part of the schema."""
    for name, part in schema["properties"].items():
        key = f"{path}.{name}" if path else name
        if "properties" in part:
            yield from described_keys(part, key)
        else:
            yield key, part


def row(key, part):
    cells = [f"`{key}`", part.get("symbol", ""), part.get("unit", "")]
    cells.append(allowed_values(part, SCHEMA))
    return "| " + " | ".join([*cells, part["description"]]) + " |"


def test_every_key_is_explained_as_the_schema_has_it_and_no_other():
    explained = [line for line in README.splitlines() if line.startswith("| `")]
    assert explained == [row(key, part) for key, part in described_keys(SCHEMA)]


def test_report_page_and_study_give_the_range_that_the_benchmark_measured():
    rows = read_csv(ROOT / "workflow/report/benches.csv")
    lines = []
    for row in rows:
        *words, specificity, small, large = row.values()
        rates = [f"{100 * float(rate):.1f} %" for rate in (specificity, small, large)]
        lines.append(f"| {' | '.join([*words, *rates])} |\n")
    for page in ("docs/detection.md", "workflow/studies/results/detection-benches.md"):
        assert f"---|\n{''.join(lines)}\n" in (ROOT / page).read_text(encoding="utf-8")


def test_the_page_on_a_bench_of_ones_own_tells_how_many_recordings_a_rate_takes():
    rows = [
        [f"{rate} %"]
        + [str(recordings_needed(rate / 100, each, 0.95)) for each in (0.15, 0.1, 0.05)]
        for rate in (50, 60, 70, 80, 85, 90, 95, 100)
    ]
    head = "| expected rate | ±15 points | ±10 points | ±5 points |\n|---|---|---|---|\n"
    table = "".join(f"| {' | '.join(row)} |\n" for row in rows)
    assert f"{head}{table}\n" in (ROOT / "docs/your-bench.md").read_text(encoding="utf-8")


def test_the_page_on_intervals_tells_what_is_computed():
    page = " ".join((ROOT / "docs/intervals.md").read_text(encoding="utf-8").split())
    low, high = (f"{100 * share:.1f}" for share in new_specificity(20, 0.95))
    assert f"At n = 20 the central 90 % are {low} to {high} %." in page
    needed = recordings_needed(0.95, 0.05, 0.95)
    assert f"95 % to +-5 points takes {needed} healthy recordings" in page
