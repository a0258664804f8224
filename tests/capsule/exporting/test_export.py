"""The library of each format reads the exported values, units and provenance."""

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
from pyarrow import parquet

from capsule.detectors.files import write_learned
from capsule.engine.configuration import read_config_file
from capsule.errors import CapsuleError
from capsule.evaluation.columns import COLUMNS
from capsule.exporting import command, formats, gathering
from capsule.exporting.formats import NO_DATE, columns_of, describe, described, legal_names
from capsule.recordings import listing
from capsule.store import results as stored
from capsule.store.files import write_csv, write_json
from support.command import run_command
from support.documents import blocks
from support.project import ROOT
from support.stored import rows_of

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
UNITS = {name: "counts" if "adc_bits" in told else "V" for name, (_, told) in RECORDINGS.items()}
REJECTED = "3mm/flat"
PARAMETERS = {"amplitude": 4, "vertical_spread": 4, "peak_spacing": 3, "horizontal_spread": 4}
VERDICT = {"recording": "3mm/r07", "score": AWKWARD[3], "estimate_low_mm": AWKWARD[0]}
VERDICT |= {"rmse_0mm": AWKWARD[2], "rmse_3mm": float("inf"), "location_s": None}
RATES = {"detector": "template", "tp": 17, "recall": AWKWARD[1], "one_sided": True}
# The tables by their files; those that stay empty hold the names of their columns alone.
TABLES = {f"evaluation/{name}": [RATES, RATES | {"tp": 3}] for name in COLUMNS}
TABLES |= {"evaluation/roc": ["size_mm"], "evaluation/predictions": [VERDICT]}
TABLES |= {"evaluation/learning": ["detector", "share", "rate"], "detections": [*VERDICT]}
TABLES |= {"passed_over": ["path", "reason"], "sites": ["site", "detector", "passes"]}


def make_results(results, most=1):
    """Write the results, and return the readings and the matrices by recording.

    Up to so many recordings stand in one batch.
    """
    generator = np.random.default_rng(1)
    parameters = {name: generator.random(length).tolist() for name, length in PARAMETERS.items()}
    fit = {"seed": 1, "first_peak": 5, "lag": 7, "rmse": AWKWARD[1], "parameters": parameters}
    rejected = {"recording": REJECTED, "size_mm": 3.0, "status": "rejected"}
    rows = [rejected | {"reason": "sensor 2 is constant", "source": FORMULA}]
    checks = {REJECTED: rejected | {"header": {"source": FORMULA}}}
    readings, matrices, fits = {}, {}, {}
    for name, (samples, header) in RECORDINGS.items():
        values = generator.integers(0, 1023, (4, samples)).astype(float)
        values[1, 3] = np.nan
        readings[name] = values if "adc_bits" in header else values / 1000
        matrices[name] = generator.random((4, LENGTH)) * AWKWARD[0]
        size = "" if name.startswith("unlabelled") else float(name.partition("mm")[0])
        row = {"recording": name, "size_mm": size}
        if size:
            fits[name] = row | fit
        row["status"] = "accepted"
        checks[name] = row | {"header": header}
        told = {"samples": samples, "duration_s": (samples - 1) / 10, "site": "007"}
        rows.append(row | told | {"sha256": f"{samples:064x}", "source": header.get("source", "")})
    signals = readings | {REJECTED: np.full((4, LENGTH), np.nan)}
    arrays = {stored.SIGNALS: signals, stored.MATRICES: matrices}
    for kind, of_kind in {**arrays, stored.CHECKS: checks, stored.FITS: fits}.items():
        for batch, names in stored.batches(sorted(of_kind), most).items():
            path = results / stored.pattern(kind, alone=most == 1).format(batch=batch)
            contents = {name: of_kind[name] for name in names}
            if kind in arrays:
                stored.write_arrays(path, contents)
            else:
                stored.write_contents(path, contents, batch)
    unknown = dict.fromkeys([*listing.COLUMNS, *stored.BATCH_COLUMNS])
    named = rows_of([row["recording"] for row in rows], most)
    rows = [unknown | row | named[row["recording"]] for row in rows]
    for name, of_table in {**TABLES, "recordings": rows}.items():
        filled = [row for row in of_table if isinstance(row, dict)]
        write_csv(results / f"{name}.csv", [*(filled or [of_table])[0]], filled)
    templates = [{"size_mm": 0.0, "recordings": 0, "parameters": None}]
    templates.append({"size_mm": 3.0, "recordings": 1, "parameters": parameters})
    write_json(results / "templates.json", {"templates": templates})
    np.savez(results / "templates.npz", **{"0mm": np.zeros((4, 40)), "3mm": np.eye(4, 40) / 3})
    return readings, matrices


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
        assert ["" if each is None or np.size(each) == 0 else each for each in read] == [*written]
    else:
        # What is unknown may come back as None.
        assert np.array([*read], dtype=float).tobytes() == np.asarray(written, float).tobytes()


def check_tables(tables, read):
    """Check the values and the unit of each column, as a function reads them by two names."""
    for name, table in tables.items():
        for key, values, unit, _ in columns_of(table):
            found, told = read(name, key)
            same(found, values)
            same([told], np.array([unit], dtype=object))


def test_what_is_gathered_is_what_the_results_hold_and_all_of_it_is_described(exported):
    # The tests of the formats compare all samples.
    arrays = exported.arrays
    assert arrays["readings"][REJECTED].shape == (4, 0)
    assert arrays["template"]["3mm"].shape == (4, 40)
    assert exported.along("readings", "3mm/r07")[:3].tolist() == [0, 0.1, 0.2]
    assert exported.along("template", "3mm")[0] == 1
    predictions, recordings = exported.tables["predictions"], exported.tables["recordings"]
    assert predictions["score"].tolist() == [AWKWARD[3]] and np.isinf(predictions["rmse_3mm"][0])
    assert list(recordings["site"])[:2] == ["", "007"]
    units = dict(zip(recordings["recording"], recordings["reading_unit"], strict=True))
    assert units == {REJECTED: "", **UNITS}
    assert sorted(exported.tables["fits"]["recording"]) == ["2.5mm/a-1", "2.5mm/a_1", "3mm/r07"]
    assert exported.tables["detection"]["one_sided"].dtype == bool
    assert {*exported.tables, *exported.arrays} == described()["tables"].keys()


def test_the_provenance_tells_recordings_configuration_and_code(exported, tmp_path):
    told = exported.provenance
    assert (told["origin"], told["results_out_of_date"]) == ("mixed", "no")
    assert json.loads(told["configuration"]) == read_config_file(CONFIG)
    assert (told["recordings_accepted"], told["recordings_rejected"]) == ("5", "1")
    assert told["project"].startswith("origami-capsule ") and told["numpy"] == np.__version__
    read = exported.tables["files"]
    assert "results/signals/3mm/r07.npy" in set(read["path"])
    assert {len(checksum) for checksum in read["sha256"]} == {64}
    # HDF5 keeps no attribute above 64 kB, so of many names some are told.
    rows = [(f"3mm/r{n}", "accepted", "0", f"bench {n}") for n in range(5000)]
    listed = pd.DataFrame(rows, columns=["recording", "status", "sha256", "source"])
    told = gathering.provenance_of(listed, {}, tmp_path / "results", CONFIG, {})
    assert told["sources"].endswith("; and 4980 more")


@pytest.mark.parametrize("what", gathering.CHOICES)
def test_each_part_is_exported_alone(made, what):
    part = gathering.gather(made[0], CONFIG, what)
    kinds = {"readings": "recordings", "matrix": "matrices", "template": "fits"}
    assert list(part.arrays) == [name for name, kind in kinds.items() if what in (kind, "all")]
    assert ("fits" in part.tables) == (what in ("fits", "all"))
    assert ("sizing" in part.tables) == (what in ("evaluation", "all"))
    assert len(part.tables["recordings"]) == len(RECORDINGS) + 1


def test_matlab_reads_named_structures(files, exported, made):
    read = scipy.io.loadmat(files / "mat/all.mat", simplify_cells=True)
    for legal, name in (("x3mm_r07", "3mm/r07"), ("x2_5mm_a_1_1", "2.5mm/a_1")):
        told = read["recordings"][legal]
        assert (told["name"], told["readings_unit"], told["time_unit"]) == (name, "counts", "s")
        assert told["readings"].tobytes() == made[1][name].tobytes()
        assert told["matrix"].tobytes() == made[2][name].tobytes()
    assert read["recordings"]["x3mm_r07"]["header"]["waveSpeed"] == "25"
    tables, units = read["tables"], read["units"]
    check_tables(exported.tables, lambda at, key: (np.atleast_1d(tables[at][key]), units[at][key]))
    assert read["provenance"] == exported.provenance


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
    assert not [text for text in texts if text[0] in "=+-@"] and f" {FORMULA}" in texts
    assert book["recordings"]["D1"].value == "duration_s [s]"
    for name, table in exported.tables.items():
        columns = zip(columns_of(table), book[name].iter_cols(values_only=True), strict=True)
        for (key, values, unit, _), (head, *read) in columns:
            assert head == (key if unit in ("", "1") else f"{key} [{unit}]")
            if key == "rmse_3mm":
                assert read == ["inf"] * len(table)
            elif key not in ("source", "value"):
                same(read, values)
    rows = {tuple(row[:3]): row[3:] for row in book["readings"].iter_rows(values_only=True)}
    for name, matrix in made[1].items():
        for sensor, expected in enumerate(matrix, start=1):
            same(rows[name, UNITS[name], sensor][: matrix.shape[1]], expected)
    assert dict(book["provenance"].iter_rows(min_row=2, values_only=True)) == exported.provenance


def test_a_sheet_that_is_too_long_is_continued_on_the_next_and_one_too_wide_is_refused(monkeypatch):
    monkeypatch.setattr(formats, "MOST_ROWS", 2)
    monkeypatch.setattr(formats, "_MOST_COLUMNS", 1)
    book, stream = openpyxl.Workbook(write_only=True), io.BytesIO()
    with pytest.raises(CapsuleError, match=r"wide has 2 columns, .* at most 1; choose"):
        formats.write_sheets(book, "wide", pd.DataFrame({"a": [1], "b": [2]}))
    formats.write_sheets(book, "few", pd.DataFrame({"a": [1, 2, 3]}))
    formats.write_sheets(book, "none", pd.DataFrame(columns=["a"]))
    book.save(stream)
    sheets = {sheet.title: list(sheet.values) for sheet in openpyxl.load_workbook(stream)}
    assert sheets == {"few": [("a",), (1,), (2,)], "few_2": [("a",), (3,)], "none": [("a",)]}


def test_parquet_holds_each_table_with_its_units(files, exported, made):
    tables = formats.flat_tables(exported, exported.arrays)
    read = {path.stem: parquet.read_table(path) for path in (files / "parquet").iterdir()}
    assert read.keys() == tables.keys()

    def column(name, key):
        metadata = read[name].schema.field(key).metadata
        assert metadata[b"long_name"].decode() == describe(key)[1]
        return read[name][key].to_pylist(), metadata[b"unit"].decode()

    check_tables(tables, column)
    for each in read.values():
        assert json.loads(each.schema.metadata[b"provenance"]) == exported.provenance
    readings = read["readings"].to_pandas()
    same(readings[readings["recording"] == "3mm/r07"]["sensor_2"], made[1]["3mm/r07"][1])


def test_netcdf_holds_recordings_along_named_axes(files, exported, made):
    read = xarray.load_datatree(files / "netcdf/all.nc", engine="h5netcdf")
    for array, axis in (("readings", "time"), ("matrix", "column")):
        assert read[array].dims == ("recording", "sensor", axis) and read[array].encoding["zlib"]
    assert read["template"].dims == ("size", "sensor", "size_column")
    assert (read["time"].attrs["units"], read["readings"].attrs["units"]) == ("s", "V or counts")
    for name, signal in made[1].items():
        of_one = read["readings"].sel(recording=name)
        filled = int(read["readings_columns"].sel(recording=name))
        assert of_one.values[:, :filled].tobytes() == signal.tobytes()
        assert np.isnan(of_one.values[:, filled:]).all()
        assert read["matrix"].sel(recording=name).values.tobytes() == made[2][name].tobytes()
    assert np.isnan(read["readings"].sel(recording=REJECTED)).all()
    assert exported.provenance.items() <= read.attrs.items()

    def variable(name, key):
        each = (read if name == "recordings" else read[name].to_dataset(inherit=False))[key]
        assert each.attrs["long_name"] == describe(key)[1]
        return each.values, each.attrs.get("units", "")

    check_tables(exported.tables, variable)


def test_nwb_holds_a_valid_file_for_each_recording_and_one_for_the_tables(files, exported, made):
    legal = legal_names([*RECORDINGS, REJECTED])
    paths = {name: files / "nwb" / f"{legal[name]}.nwb" for name in RECORDINGS}
    assert {*(files / "nwb").iterdir()} == {*paths.values(), files / "nwb/tables.nwb"}
    for path in (paths["3mm/r07"], files / "nwb/tables.nwb"):
        assert not pynwb.validate(path=path)
    for name, path in paths.items():
        with pynwb.NWBHDF5IO(path, "r", load_namespaces=False) as opened:
            read = opened.read()
            series = read.acquisition["readings"]
            assert series.data[:].T.tobytes() == made[1][name].tobytes()
            assert (series.unit, series.rate) == (UNITS[name], 10.0)
            matrix = read.processing["preprocessing"]["matrix"]
            assert matrix.data[:].T.tobytes() == made[2][name].tobytes()
            assert (read.session_id, json.loads(read.notes)) == (name, exported.provenance)
            known = RECORDINGS[name][1].get("started", "").startswith("2024")
            assert ("is not known" in read.session_description) == (not known)
            expected = datetime(2024, 6, 3, 10, tzinfo=UTC) if known else NO_DATE
            assert read.session_start_time == expected
    with pynwb.NWBHDF5IO(files / "nwb/tables.nwb", "r") as opened:
        tables = opened.read().processing["tables"]

        def column(name, key):
            _, bracket, unit = tables[name][key].description.rpartition("[")
            return tables[name][key].data[:], unit.rstrip("]") if bracket else ""

        check_tables(exported.tables, column)


def test_the_lines_for_python_run(files, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    (tmp_path / "export").mkdir()
    for path in files.glob("*/*"):
        (tmp_path / "export" / path.name).symlink_to(path)
    (block,) = (each for each in blocks(ROOT / "docs/export.md") if each.is_python)
    exec(block.text, values := {})
    values["archive"].close()
    assert values["readings"].shape == (30, 4)
    assert list(values["detection"]["tp"]) == [17, 3]


def test_the_command_writes_once_and_again_only_if_told_to(made, exported, files, tmp_path, capsys):
    call = "export", "--format", "mat", "--what", "fits", "--out", tmp_path, "--results", made[0]
    run_command(*call)
    assert "1 file, " in capsys.readouterr().out
    path = tmp_path / "fits.mat"
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
    whole = gathering.gather(tmp_path / "results", CONFIG, "all")
    paths = list(whole.tables["files"]["path"])
    assert "results/signals/3mm/batch.npz" in paths and len(set(paths)) == len(paths)
    for name in whole.tables.keys() - {"files"}:
        pd.testing.assert_frame_equal(whole.tables[name], exported.tables[name])
    np.testing.assert_equal(whole.arrays, exported.arrays)
    orders = [[list(parts) for parts in each.arrays.values()] for each in (whole, exported)]
    assert orders[0] == orders[1] and list(whole.tables) == list(exported.tables)


def test_what_changed_since_the_results_were_made_is_told(made, tmp_path, monkeypatch, capsys):
    settings, changed, learned = read_config_file(CONFIG), ["raw/r07.csv"], tmp_path / "learned"
    monkeypatch.setattr(gathering.OfArchive, "DETECTORS", learned)
    monkeypatch.setattr(gathering, "changed_recordings", lambda *_: changed.copy())
    call = "--what=fits", "--config", CONFIG, "--results", made[0], "--out", tmp_path, "--force"
    for seed, told in ((0, changed[0]), (1, f"{CONFIG.as_posix()}; {changed[0]}")):
        fit = settings["fit"] | {"seed": settings["fit"]["seed"] + seed}
        write_learned(learned, {}, settings | {"fit": fit}, made[0] / "templates.npz")
        run_command("export", "--format=parquet", *call)
        assert f"or changed: {told}; make it again" in capsys.readouterr().out
        metadata = parquet.read_schema(tmp_path / "fits.parquet").metadata
        assert json.loads(metadata[b"provenance"])["results_out_of_date"] == told


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
    (results / "signals/3mm/r07.npy").write_bytes(b"cut off")
    with pytest.raises(CapsuleError, match=r"r07\.json does not exist; .*snakemake -c2"):
        gathering.gather(results, CONFIG, "fits")
    with pytest.raises(CapsuleError, match=r"r07\.npy is damaged .*; delete it"):
        gathering.gather(results, CONFIG, "recordings")


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
