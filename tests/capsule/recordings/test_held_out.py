"""Held-out sessions judge only; sources, places, and one checksum of all recordings."""

from unittest import mock

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

from capsule.errors import CapsuleError
from capsule.recordings import held_out as held
from capsule.recordings import origin
from capsule.store import files

HELD_OUT = ["spring", "=2+2"]
COLUMNS = "time_s,sensor_1\n0,1\n"
# The session of each recording of a table; the same patient is judged anyway.
SESSIONS = {
    "3mm/r02": "autumn",
    "3mm/r01": "spring",
    "0mm/r02": "spring",
    "unlabelled/patient": "spring",
    "0mm/r01": "",
    "3mm/r03": None,
    "3mm/r04": float("nan"),
}
ROWS = {name: {"recording": name, "session": session} for name, session in SESSIONS.items()}


def test_a_labelled_recording_of_a_named_session_is_held_out_and_the_others_teach_in_order():
    teaching = [name for name in ROWS if name not in ("3mm/r01", "0mm/r02")]
    assert list(held.teaching(ROWS, HELD_OUT)) == teaching
    assert held.teaching(ROWS, []) == ROWS


def test_a_session_that_no_labelled_recording_names_is_told():
    rows = [ROWS[name] for name in ("3mm/r02", "unlabelled/patient", "3mm/r04")]
    assert held.unknown_sessions(rows, ["spring", "autumn", "=x"]) == ["spring", "=x"]
    rows.append({"recording": "0mm/r01", "session": " =x"})
    assert held.unknown_sessions(rows, ["autumn", "=x"]) == []


LONG = "".join(f"# note {number}: {'x' * 60}\n" for number in range(100))


def test_the_first_lines_of_a_file_tell_its_session(tmp_path):
    for content, session in (
        (f"\ufeff# session:  spring \r\n{COLUMNS}", "spring"),
        (f"# session: =2+2\n{COLUMNS}", " =2+2"),
        (f"{LONG}# session: spring\n{COLUMNS}", "spring"),
        (f"#{'é' * 1100}: 1\n# session: spring\n{COLUMNS}", "spring"),
        # The second line is cut by the end of what is read at first.
        (f"# session: spring\n{'#' * 2015}\n# session: spring\n{COLUMNS}", "spring"),
        *((content, "") for content in (COLUMNS, f"{COLUMNS}# session: spring\n", "", "\0")),
        # It is rejected, since it names two; and since its header is too long.
        (f"# session: autumn\n# session: spring\n{COLUMNS}", ""),
        (f"{LONG * 3}# session: spring\n{COLUMNS}", ""),
    ):
        (tmp_path / "r01.csv").write_bytes(content.encode())
        assert held.session_of(tmp_path / "r01.csv") == session, content[:40]


def test_of_a_file_without_lines_little_is_read(tmp_path):
    """Such a file can be larger than the memory, and every start of the workflow meets it."""
    (path := tmp_path / "r01.csv").write_bytes(bytes(10**6))
    with mock.patch.object(files, "read_beginning", wraps=files.read_beginning) as reading:
        assert held.session_of(path) == ""
    assert max(call.args[1] for call in reading.call_args_list) < 200_000


def test_the_recordings_of_nodules_that_teach_are_fitted(tmp_path):
    for name, session in SESSIONS.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / f"{name}.csv").write_text(f"# session: {session}\n{COLUMNS}")
    runs = [f"3mm/r0{number}" for number in range(1, 5)]
    fitted = {"3mm/batch": runs, "3mm/gone": ["3mm/r09"], "3mm/spring": runs[:1]}
    batches = {"0mm/batch": ["0mm/r01", "0mm/r02"], "unlabelled/batch": ["unlabelled/patient"]}
    assert held.fitted(batches | fitted, tmp_path, []) == fitted
    taught = {"3mm/batch": runs[1:], "3mm/gone": ["3mm/r09"]}
    assert held.fitted(batches | fitted, tmp_path, HELD_OUT) == taught


def test_what_teaches_comes_in_the_order_of_its_contents_or_nothing_can_and_each_says_why(tmp_path):
    columns = ["recording", "status", "reason", "no_verdict", "readings_sha256", "session"]
    unused = [
        ("0mm/r01", "accepted", "", "", "1", ""),
        ("3mm/r02", "rejected", "the file is empty", "", "", "spring"),
        ("3mm/r03", "accepted", "", "there is no wave", "0", ""),
        ("3mm/r04", "accepted", "", "", "3", "autumn"),
    ]
    used = [("2mm/r01", "accepted", "", "", "9", ""), ("3mm/r01", "accepted", "", "", "2", "")]
    files.write_cells(table := tmp_path / "labelled.csv", columns, [*used, *unused])
    assert held.recordings_with_fits(table) == ["3mm/r01", "3mm/r04", "2mm/r01"]
    assert held.recordings_with_fits(table, ["autumn"]) == ["3mm/r01", "2mm/r01"]
    files.write_cells(table, columns, unused)
    told = "no recording of a nodule can be used, .*\n  rejected: raw/3mm/r02: the file is empty\n"
    told += (
        "  not judged: raw/3mm/r03: there is no wave\n  held out: raw/3mm/r04: .* session autumn$"
    )
    with pytest.raises(CapsuleError, match=told):
        held.recordings_with_fits(table, ["autumn"])


def test_places_are_the_connected_components_for_any_rows():
    numbers, names = np.random.default_rng(3), np.array([f"3mm/r{each}" for each in range(8)])
    for _ in range(100):
        sites = numbers.choice(["", "a", "b", "c", "d"], 8)
        copies = numbers.random((8, 8)) < 0.06
        # Of a recording without a row, nothing is known.
        rows = {
            name: {"site": site, "near_copies": " ".join(["3mm/gone", *names[some]])}
            for name, site, some in zip(names, sites, copies, strict=True)
        }
        linked = copies | (sites[:, np.newaxis] == sites) & (sites != "")
        _, part, of = np.unique(connected_components(linked, directed=False)[1], True, True)
        # A place has the name of the first recording of its component.
        assert origin.places_of(rows) == dict(zip(names, names[part[of]], strict=True))


def test_the_origin_comes_from_what_the_recordings_say_and_each_counts_once():
    for sources, kind, counts in (
        (["simulated phantom"] * 3, "simulated", (3, 0, 0, 0)),
        (["bench 2", "bench 3"], "recorded", (0, 0, 2, 0)),
        (["bench 2", "Simulated"], "mixed", (1, 0, 1, 0)),
        (["imported from a.csv"] * 2, "imported", (0, 2, 0, 0)),
        (["bench 2", " ", "imported from a.csv"], "mixed", (0, 1, 1, 1)),
        (["", ""], "unknown", (0, 0, 0, 2)),
        ([], "none", (0, 0, 0, 0)),
    ):
        found = origin.origin_of(sources)
        told = (found.simulated, found.imported, found.recorded, found.silent)
        assert (found.kind, told) == (kind, counts)


def test_the_combined_checksum_is_of_sorted_lines():
    sums = ({"b": "22", "a": "11"}, {"a": "11", "b": "22"}, {"a": "22", "b": "11"})
    one, same, other = map(origin.combined_checksum, sums)
    assert one == same != other
