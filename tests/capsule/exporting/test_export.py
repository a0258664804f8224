"""The library of each format reads the exported values, units and provenance."""

import hashlib
import io
import json
import sys
from datetime import UTC, datetime

import numpy as np
import openpyxl
import pandas as pd
import pynwb
import pytest
import scipy.io
import xarray
from openpyxl.utils import get_column_letter
from pyarrow import parquet

from capsule.detectors.files import write_learned
from capsule.engine.configuration import read_config_file
from capsule.errors import CapsuleError
from capsule.evaluation.columns import COLUMNS, RATES
from capsule.exporting import command, formats, gathering
from capsule.exporting.formats import NO_DATE, columns_of, describe, described, legal_names
from capsule.store.files import read_csv, write_csv, write_json
from capsule.store.results import (
    BATCH_COLUMNS,
    CHECKS,
    FITS,
    MATRICES,
    SIGNALS,
    batches,
    pattern,
    write_arrays,
    write_contents,
)
from support.command import run_command
from support.project import ROOT
from support.stored import rows_of
from support.synthetic import write_archive

pytestmark = pytest.mark.takes(0.3)

CONFIG = ROOT / "config/config.yaml"
LENGTH = 30
# 16 digits are not enough to restore any of these numbers.
AWKWARD = (0.1 + 0.2, 1 / 3, 2 / 3 * 1e-7, -1e300 / 7)
# A text that a spreadsheet program would compute.
FORMULA = '=HYPERLINK("http://elsewhere")'
HEADER = {"source": "simulated phantom", "started": "2024-06-03T10:00:00Z", "adc_bits": "10"}
RECORDINGS = {
    "0mm/r01": (21, {**HEADER, "vref_v": "5"}),
    "3mm/r07": (LENGTH, {**HEADER, "vref_v": "5", "site": "-1+2", "wave speed": "25"}),
    "2.5mm/a-1": (17, {"source": "simulated phantom", "note": FORMULA}),
    "2.5mm/a_1": (12, {**HEADER, "started": "2024-06-03 10:00", "note": "bell \x07"}),
    "unlabelled/p": (9, {"started": "last Tuesday"}),
}
REJECTED = "3mm/flat"
_VERDICT = ["recording", "size_mm", "detector", "scheme", "predicted_mm", "rmse_0mm", "rmse_3mm"]
_VERDICT += ["score", "estimate_low_mm", "location_s"]
_LISTED = ["recording", "size_mm", "samples", "duration_s", "status", "reason", "no_verdict"]
_LISTED += ["sha256", "readings_sha256", "source", "site", "session", *BATCH_COLUMNS]


def make_results(results, most=1):
    """Write the results, and return the readings and the matrices by recording.

    Up to so many recordings stand in one batch.
    """
    generator = np.random.default_rng(1)
    made = {SIGNALS: {}, MATRICES: {}, CHECKS: {}, FITS: {}}
    rows = []
    for name, (samples, header) in RECORDINGS.items():
        values = generator.integers(0, 1023, (4, samples)).astype(float)
        values[1, 3] = np.nan
        made[SIGNALS][name] = values if "adc_bits" in header else values / 1000
        made[MATRICES][name] = generator.random((4, LENGTH)) * AWKWARD[0]
        size = "" if name.startswith("unlabelled") else float(name.partition("mm")[0])
        made[CHECKS][name] = {"recording": name, "header": header, "status": "accepted"}
        row = {"recording": name, "size_mm": size, "samples": samples, "status": "accepted"}
        row |= {"duration_s": (samples - 1) / 10, "sha256": f"{samples:064x}", "site": "007"}
        rows.append(row | {"source": header.get("source", "")})
        if size:
            fit = {"recording": name, "size_mm": size, "seed": 1, "first_peak": 5, "lag": 7}
            fit |= {"rmse_initial": 0.5, "rmse": AWKWARD[1], "accepted_moves": 3}
            made[FITS][name] = fit | {"parameters": _parameters(generator)}
    readings, matrices = dict(made[SIGNALS]), dict(made[MATRICES])
    rejected = {"recording": REJECTED, "size_mm": 3.0, "status": "rejected"}
    rows.append(rejected | {"reason": "sensor 2 is constant", "source": FORMULA})
    made[SIGNALS][REJECTED] = np.full((4, LENGTH), np.nan)
    made[CHECKS][REJECTED] = rejected | {"header": {"source": FORMULA}}
    for kind, of_kind in made.items():
        for batch, names in batches(sorted(of_kind), most).items():
            path = results / pattern(kind, alone=most == 1).format(batch=batch)
            contents = {name: of_kind[name] for name in names}
            if kind in (SIGNALS, MATRICES):
                write_arrays(path, contents)
            else:
                write_contents(path, contents, batch)
    named = rows_of([row["recording"] for row in rows], most)
    _table(results / "recordings.csv", _LISTED, [row | named[row["recording"]] for row in rows])
    templates = [{"size_mm": 0.0, "recordings": 0, "parameters": None}]
    templates.append({"size_mm": 3.0, "recordings": 1, "parameters": _parameters(generator)})
    write_json(results / "templates.json", {"templates": templates})
    np.savez(results / "templates.npz", **{"0mm": np.zeros((4, 40)), "3mm": np.eye(4, 40) / 3})
    verdict = {"recording": "3mm/r07", "size_mm": 3.0, "detector": "template"}
    verdict |= {"scheme": "leave_one_out", "predicted_mm": 3.0, "score": AWKWARD[3]}
    verdict |= {"rmse_0mm": AWKWARD[2], "rmse_3mm": float("inf"), "estimate_low_mm": AWKWARD[0]}
    _table(results / "evaluation/predictions.csv", _VERDICT, [verdict])
    rates = {"detector": "template", "size_mm": 3.0, "tp": 17, "recall": 17 / 20}
    rates |= {"recall_low": AWKWARD[1], "one_sided": True}
    for name in RATES:
        _table(results / "evaluation" / f"{name}.csv", list(rates), [rates, rates | {"tp": 3}])
    empty = {f"evaluation/{name}": COLUMNS[name] for name in COLUMNS.keys() - RATES.keys()}
    empty |= {"evaluation/learning": ["detector", "share", "rate"], "detections": _VERDICT}
    empty |= {"passed_over": ["path", "reason"], "sites": ["site", "detector", "passes"]}
    for name, columns in empty.items():
        _table(results / f"{name}.csv", columns, [])
    return readings, matrices


def _parameters(generator):
    lengths = {"amplitude": 4, "vertical_spread": 4, "peak_spacing": 3, "horizontal_spread": 4}
    return {name: generator.random(length).tolist() for name, length in lengths.items()}


def _table(path, columns, rows):
    write_csv(path, columns, [{name: row.get(name) for name in columns} for row in rows])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Make a folder of results, and return it with the readings and the matrices in it."""
    results = tmp_path_factory.mktemp("project") / "results"
    return results, *make_results(results)


@pytest.fixture(scope="module")
def exported(made):
    return gathering.gather(made[0], CONFIG, "all")


@pytest.fixture(scope="module")
def files(exported, tmp_path_factory):
    """Export everything in each format, and return the folder."""
    folder = tmp_path_factory.mktemp("out")
    for kind in formats.FORMATS:
        command.write(exported, kind, folder / kind, force=False)
    return folder


def same(read, written):
    """Check that a column was read exactly as it was written, with its unknown values."""
    if written.dtype == object:
        # Empty text comes back as None from some, and as an empty array from MATLAB's format.
        texts = ["" if value is None or np.size(value) == 0 else str(value) for value in read]
        assert texts == list(written)
    else:
        # What is unknown may come back as None.
        numbers = np.array([np.nan if value is None else value for value in read], dtype=float)
        assert numbers.tobytes() == np.asarray(written, dtype=float).tobytes()


def test_what_is_gathered_is_what_the_results_hold_and_all_of_it_is_described(made, exported):
    results, signals, matrices = made
    readings, matrix, template = exported.arrays.values()
    for name in RECORDINGS:
        assert readings[name].tobytes() == signals[name].tobytes()
        assert matrix[name].tobytes() == matrices[name].tobytes()
    assert readings[REJECTED].shape == (4, 0)
    assert exported.along("readings", "3mm/r07")[:3].tolist() == [0, 0.1, 0.2]
    assert exported.along("template", "3mm")[0] == 1 and template["3mm"].shape == (4, 40)
    cells = read_csv(results / "evaluation/predictions.csv")[0]
    predictions = exported.tables["predictions"]
    assert [float(cells["score"])] == predictions["score"].tolist() == [AWKWARD[3]]
    assert np.isinf(predictions["rmse_3mm"]).all()
    recordings = exported.tables["recordings"]
    assert list(recordings["site"])[:2] == ["007", "007"]
    units = dict(zip(recordings["recording"], recordings["reading_unit"], strict=True))
    assert units == {"0mm/r01": "counts", "3mm/r07": "counts", "2.5mm/a-1": "V"} | {
        "2.5mm/a_1": "counts",
        "unlabelled/p": "V",
        REJECTED: "",
    }
    assert sorted(exported.tables["fits"]["recording"]) == ["2.5mm/a-1", "2.5mm/a_1", "3mm/r07"]
    assert exported.tables["detection"]["one_sided"].dtype == bool
    assert {*exported.tables, *exported.arrays} == described()["tables"].keys()


def test_the_provenance_tells_recordings_configuration_and_code(made, exported):
    told = exported.provenance
    assert told["origin"] == "mixed"
    assert json.loads(told["configuration"]) == read_config_file(CONFIG)
    assert (told["recordings_accepted"], told["recordings_rejected"]) == ("5", "1")
    assert told["project"].startswith("origami-capsule ") and told["numpy"] == np.__version__
    read = exported.tables["files"]
    assert "results/signals/3mm/r07.npy" in set(read["path"])
    assert {len(checksum) for checksum in read["sha256"]} == {64}


def test_the_provenance_of_a_large_archive_stays_short(tmp_path):
    row = {"recording": "3mm/r", "status": "accepted", "sha256": "0"}
    rows = [row | {"recording": f"3mm/r{n}", "source": f"bench {n}"} for n in range(5000)]
    told = gathering.provenance_of(pd.DataFrame(rows), {}, tmp_path / "results", CONFIG, {})
    assert told["sources"].endswith("; and 4980 more")
    # HDF5 keeps no larger attribute.
    assert max(map(len, told.values())) < 64_000


@pytest.mark.parametrize("what", gathering.CHOICES)
def test_each_part_is_exported_alone(made, what):
    part = gathering.gather(made[0], CONFIG, what)
    matrices = {"recordings": ["readings"], "matrices": ["matrix"], "fits": ["template"]}
    everything = [name for names in matrices.values() for name in names]
    assert list(part.arrays) == (everything if what == "all" else matrices.get(what, []))
    assert ("fits" in part.tables) == (what in ("fits", "all"))
    assert ("sizing" in part.tables) == (what in ("evaluation", "all"))
    assert len(part.tables["recordings"]) == len(RECORDINGS) + 1


def test_matlab_reads_named_structures(files, exported, made):
    read = scipy.io.loadmat(files / "mat/all.mat", squeeze_me=True, chars_as_strings=True)

    def field(struct, name):
        return struct[name].item()

    for legal, name in (("x3mm_r07", "3mm/r07"), ("x2_5mm_a_1_1", "2.5mm/a_1")):
        recording = field(read["recordings"], legal)
        assert str(field(recording, "name")) == name
        assert field(recording, "readings").tobytes() == made[1][name].tobytes()
        assert field(recording, "matrix").tobytes() == made[2][name].tobytes()
        assert str(field(recording, "readings_unit")) == "counts"
        assert str(field(recording, "time_unit")) == "s"
    header = field(field(read["recordings"], "x3mm_r07"), "header")
    assert str(field(header, "waveSpeed")) == "25"
    for name, table in exported.tables.items():
        units, columns = field(read["units"], name), field(read["tables"], name)
        for key, values, unit, _ in columns_of(table):
            same(np.atleast_1d(field(columns, key)), values)
            assert str(field(units, key) if unit else "") == unit
    for key, text in exported.provenance.items():
        assert str(field(read["provenance"], key)) == text


def test_matlabs_names_are_legal_and_none_occurs_twice():
    names = ["3mm/r07", "a-b", "a_b", "a+b", "_x", "wave speed", "end", "\u03b1"]
    legal = ["x3mm_r07", "a_b", "a_b_1", "a_b_2", "x_x", "waveSpeed", "xEnd", "x_"]
    assert list(legal_names(names).values()) == legal
    assert list(legal_names(["r" * 80, "r" * 81]).values()) == ["r" * 63, "r" * 61 + "_1"]


def test_excel_shows_each_table_and_computes_nothing(files, exported, made):
    book = openpyxl.load_workbook(files / "xlsx/all.xlsx")
    cells = [cell for sheet in book for row in sheet.iter_rows() for cell in row]
    assert {cell.data_type for cell in cells} == {"s", "n", "b"}
    texts = [cell.value for cell in cells if cell.data_type == "s" and cell.value]
    # A sign before digits alone is a number, as scripts know it, and no formula.
    assert not [text for text in texts if text[0] in "=+-@"]
    assert f" {FORMULA}" in texts
    for name, table in exported.tables.items():
        rows = list(book[name].iter_rows(values_only=True))
        units = [f" [{unit}]" if unit not in ("", "1") else "" for *_, unit, _ in columns_of(table)]
        assert list(rows[0]) == [f"{key}{unit}" for key, unit in zip(table, units, strict=True)]
        for index, (key, values, _, _) in enumerate(columns_of(table)):
            read = [row[index] for row in rows[1:]]
            if key not in ("rmse_3mm", "source", "value"):
                same(read, values)
    assert book["recordings"]["D1"].value == "duration_s [s]"
    assert book["predictions"][f"{get_column_letter(7)}2"].value == "inf"
    rows = {tuple(row[:3]): row[3:] for row in book["readings"].iter_rows(values_only=True)}
    for name, matrix in made[1].items():
        unit = "counts" if "mm/r" in name or name[-2:] == "_1" else "V"
        for sensor, expected in enumerate(matrix, start=1):
            same(rows[name, unit, sensor][: matrix.shape[1]], expected)
    assert dict(book["provenance"].iter_rows(min_row=2, values_only=True)) == exported.provenance


def test_a_sheet_that_is_too_long_is_continued_on_the_next_and_one_too_wide_is_refused(monkeypatch):
    monkeypatch.setattr(formats, "MOST_ROWS", 2)
    monkeypatch.setattr(formats, "_MOST_COLUMNS", 1)
    book = openpyxl.Workbook(write_only=True)
    with pytest.raises(CapsuleError, match=r"wide has 2 columns, .* at most 1; choose"):
        formats.write_sheets(book, "wide", pd.DataFrame({"a": [1], "b": [2]}))
    formats.write_sheets(book, "few", pd.DataFrame({"a": [1, 2, 3, 4, 5]}))
    formats.write_sheets(book, "none", pd.DataFrame(columns=["a"]))
    stream = io.BytesIO()
    book.save(stream)
    sheets = {sheet.title: list(sheet.values) for sheet in openpyxl.load_workbook(stream)}
    few = {"few": [("a",), (1,), (2,)], "few_2": [("a",), (3,), (4,)], "few_3": [("a",), (5,)]}
    assert sheets == few | {"none": [("a",)]}


def test_parquet_holds_each_table_with_its_units(files, exported, made):
    tables = formats.flat_tables(exported, exported.arrays)
    assert {path.stem for path in (files / "parquet").iterdir()} == set(tables)
    for name, table in tables.items():
        read = parquet.read_table(files / "parquet" / f"{name}.parquet")
        assert json.loads(read.schema.metadata[b"provenance"]) == exported.provenance
        for key, values, unit, long_name in columns_of(table):
            same(read[key].to_pylist(), values)
            metadata = read.schema.field(key).metadata
            assert metadata[b"unit"].decode() == unit
            assert metadata[b"long_name"].decode() == long_name
    readings = parquet.read_table(files / "parquet/readings.parquet").to_pandas()
    one = readings[readings["recording"] == "3mm/r07"]
    same(one["sensor_2"], made[1]["3mm/r07"][1])


def test_netcdf_holds_recordings_along_named_axes(files, exported, made):
    path = files / "netcdf/all.nc"
    with xarray.open_dataset(path, engine="h5netcdf") as read:
        assert read["readings"].dims == ("recording", "sensor", "time")
        assert read["matrix"].dims == ("recording", "sensor", "column")
        assert read["template"].dims == ("size", "sensor", "size_column")
        assert read["time"].attrs["units"] == "s"
        assert read["readings"].attrs["units"] == "V or counts"
        assert read["readings"].encoding["zlib"] and read["matrix"].encoding["zlib"]
        for name, signal in made[1].items():
            of_one = read["readings"].sel(recording=name)
            filled = int(read["readings_columns"].sel(recording=name))
            assert of_one.values[:, :filled].tobytes() == signal.tobytes()
            assert np.isnan(of_one.values[:, filled:]).all()
            assert read["matrix"].sel(recording=name).values.tobytes() == made[2][name].tobytes()
        assert np.isnan(read["readings"].sel(recording=REJECTED)).all()
        for key, text in exported.provenance.items():
            assert read.attrs[key] == text
        check_variables(read, exported.tables["recordings"])
    for name, table in exported.tables.items():
        if name != "recordings":
            with xarray.open_dataset(path, group=name, engine="h5netcdf") as read:
                check_variables(read, table)


def check_variables(read, table):
    for name, values, unit, long_name in columns_of(table):
        same(read[name].values, values)
        assert read[name].attrs.get("units", "") == unit
        assert read[name].attrs["long_name"] == long_name


def test_nwb_holds_a_valid_file_for_each_recording_and_one_for_the_tables(files, exported, made):
    legal = legal_names([*RECORDINGS, REJECTED])
    paths = {name: files / "nwb" / f"{legal[name]}.nwb" for name in RECORDINGS}
    assert {*(files / "nwb").iterdir()} == {*paths.values(), files / "nwb/tables.nwb"}
    assert not any(pynwb.validate(path=path) for path in (files / "nwb").iterdir())
    for name, path in paths.items():
        header = RECORDINGS[name][1]
        with pynwb.NWBHDF5IO(path, "r") as opened:
            read = opened.read()
            series = read.acquisition["readings"]
            assert series.data[:].T.tobytes() == made[1][name].tobytes()
            assert (series.unit, series.rate) == ("counts" if "adc_bits" in header else "V", 10.0)
            matrix = read.processing["preprocessing"]["matrix"]
            assert matrix.data[:].T.tobytes() == made[2][name].tobytes()
            assert (read.session_id, json.loads(read.notes)) == (name, exported.provenance)
            known = header.get("started", "").startswith("2024")
            assert ("is not known" in read.session_description) == (not known)
            expected = datetime(2024, 6, 3, 10, tzinfo=UTC) if known else NO_DATE
            assert read.session_start_time == expected
    with pynwb.NWBHDF5IO(files / "nwb/tables.nwb", "r") as opened:
        tables = opened.read().processing["tables"]
        for name, table in exported.tables.items():
            for key, values, unit, _ in columns_of(table):
                column = tables[name][key]
                same(column.data[:], values)
                assert f"[{unit}]" in column.description or not unit


def test_the_lines_for_python_run(files, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    (tmp_path / "export").mkdir()
    for path in files.glob("*/*"):
        (tmp_path / "export" / path.name).symlink_to(path)
    text = (ROOT / "docs/export.md").read_text(encoding="utf-8")
    section = text.partition("## Python\n")[2].partition("\n## ")[0]
    lines = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    values = {}
    exec("\n".join(lines), values)
    values["archive"].close()
    assert values["readings"].shape == (30, 4)
    assert list(values["detection"]["tp"]) == [17, 3]


def test_the_command_writes_once_and_again_only_if_told_to(made, exported, files, tmp_path, capsys):
    call = ["export", "--format", "mat", "--what", "fits", "--out", str(tmp_path / "out")]
    call += ["--results", str(made[0])]
    run_command(*call)
    assert "1 file, " in capsys.readouterr().out
    path = tmp_path / "out/fits.mat"
    path.write_bytes(b"mine")
    with pytest.raises(CapsuleError, match=r"fits\.mat exists; nothing was written.*--force"):
        run_command(*call)
    assert path.read_bytes() == b"mine"
    run_command(*call, "--force")
    assert "fits" in scipy.io.loadmat(path)["tables"].dtype.names
    with pytest.raises(CapsuleError, match=r" exists \(as do [0-9]+ more\); nothing was written"):
        command.write(exported, "parquet", files / "parquet", force=False)


def test_an_archive_in_batches_is_exported_as_one_with_a_job_for_each(exported, tmp_path):
    make_results(tmp_path / "results", 16)
    assert (tmp_path / "results/signals/3mm/batch.npz").exists()
    assert not (tmp_path / "results/signals/3mm/r07.npy").exists()
    whole = gathering.gather(tmp_path / "results", CONFIG, "all")
    assert list(whole.tables) == list(exported.tables)
    paths = list(whole.tables.pop("files")["path"])
    assert "results/signals/3mm/batch.npz" in paths and len(set(paths)) == len(paths)
    for name, table in whole.tables.items():
        pd.testing.assert_frame_equal(table, exported.tables[name])
    for kind, arrays in whole.arrays.items():
        np.testing.assert_equal(arrays, exported.arrays[kind])
        assert list(arrays) == list(exported.arrays[kind])
    assert whole.headers == exported.headers


def test_results_that_no_longer_fit_to_recordings_or_configuration_are_told(tmp_path, capsys):
    results, settings = tmp_path / "results", read_config_file(CONFIG)
    make_results(results)
    rows = read_csv(results / "recordings.csv")
    write_archive(tmp_path / "raw", [row["recording"] for row in rows], samples=50)
    for row in rows:
        content = (tmp_path / f"raw/{row['recording']}.csv").read_bytes()
        row["sha256"] = hashlib.sha256(content).hexdigest()
    write_csv(results / "recordings.csv", list(rows[0]), rows)
    call = ["export", "--format", "parquet", "--what", "fits", "--results", str(results)]
    call += ["--config", str(CONFIG), "--out", tmp_path / "out", "--force"]

    def export(seed):
        made_with = {"recording": settings["recording"], "fit": settings["fit"] | {"seed": seed}}
        write_learned(results / "detectors.json", {}, made_with, results / "templates.npz")
        run_command(*call)
        stored = parquet.read_schema(tmp_path / "out/fits.parquet").metadata[b"provenance"]
        return capsys.readouterr().out, json.loads(stored)["results_out_of_date"]

    printed, changed = export(settings["fit"]["seed"])
    assert "warning" not in printed and changed == "no"
    (tmp_path / "raw/3mm/r07.csv").write_text("another")
    printed, changed = export(77)
    assert changed == f"{CONFIG.as_posix()}; raw/3mm/r07.csv"
    assert f"was made, these came, went or changed: {changed}; make it again" in printed


@pytest.mark.parametrize("kind", formats.FORMATS)
def test_an_archive_without_an_accepted_recording_is_exported_too(tmp_path, kind):
    results = tmp_path / "results"
    make_results(results)
    index = results / "recordings.csv"
    index.write_text(index.read_text().replace(",accepted,", ",rejected,"))
    none = gathering.gather(results, CONFIG, "recordings")
    assert not any(readings.size for readings in none.arrays["readings"].values())
    assert none.long_table("readings").attrs["unit"] == "1"
    written = command.write(none, kind, tmp_path / "out", force=False)
    assert len(written) == len(list((tmp_path / "out").iterdir()))


def test_what_is_missing_or_damaged_is_named_with_how_to_make_it(tmp_path):
    results = tmp_path / "results"
    make_results(results)
    (results / "fits/3mm/r07.json").unlink()
    (results / "evaluation/roc.csv").unlink()
    (results / "signals/3mm/r07.npy").write_bytes(b"cut off")
    for what, told in {
        "fits": r"r07\.json does not exist; .*snakemake -c2",
        "evaluation": r"roc\.csv does not exist; .*snakemake -c2",
        "recordings": r"r07\.npy is damaged .*; delete it",
    }.items():
        with pytest.raises(CapsuleError, match=told):
            gathering.gather(results, CONFIG, what)


def test_a_format_whose_package_is_missing_names_the_extra(exported, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(CapsuleError, match=r"parquet needs pyarrow.*\[formats\]"):
        command.write(exported, "parquet", tmp_path, force=False)
    assert list(tmp_path.iterdir()) == []


def test_a_columns_name_tells_its_unit():
    for name, unit, words in (
        ("rmse_2.5mm", "1", "root mean square error beside the template of 2.5mm"),
        ("bias_mm_low", "mm", "mean error of the estimated size of a detected nodule"),
        ("location_s", "s", "time at which the nodule is located"),
        ("peak_spacing_2", "samples", "sensor 2"),
    ):
        told = describe(name)
        assert told[0] == unit and told[1].endswith(words)
