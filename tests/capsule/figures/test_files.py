"""A figure is written at both widths, with the data that it shows."""

from types import SimpleNamespace

from capsule.figures.files import write_figure
from capsule.store.files import read_csv

INPUTS = SimpleNamespace(settings={"recording": {"sensors": 4}})


def test_a_figure_is_written_at_both_widths_with_its_data(tmp_path):
    line = write_figure("readings", INPUTS, "svg", tmp_path)
    written = {path.name: path for path in tmp_path.iterdir()}
    assert set(written) == {"readings.svg", "readings_column.svg", "readings.csv"}
    assert line == f"readings: {len(read_csv(written['readings.csv']))} rows of data"
    wide, narrow = (written[f"readings{suffix}.svg"].read_bytes() for suffix in ("", "_column"))
    assert wide.startswith(b"<?xml") and wide != narrow
    before = {name: path.read_bytes() for name, path in written.items()}
    write_figure("readings", INPUTS, "svg", tmp_path)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
