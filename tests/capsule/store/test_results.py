"""The files of recordings are written, found and read again, alone or in batches."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from capsule.engine.forks import Forks
from capsule.errors import CapsuleError
from capsule.store import files
from capsule.store.results import (
    CHECKS,
    DESCRIBED_TOGETHER,
    FEATURES,
    FITS,
    MATRICES,
    PLOT_DATA,
    SIGNALS,
    Results,
    batch_size,
    batches,
    described_together,
    left_over,
    pattern,
    read_array,
    write_arrays,
    write_contents,
)

NAMES = [f"{folder}/r{run:02d}" for folder in ("0mm", "3mm") for run in range(1, 8)]
POOL = [f"{folder}/r-{run}" for folder in ("0mm", "2.5mm", "unlabelled") for run in range(99)]
DRAWN = st.sampled_from(POOL)
ARCHIVES = st.sets(DRAWN, max_size=60).map(sorted)
SIZES = st.integers(1, 9)
few = settings(deadline=None, max_examples=40)


def array_of(name):
    """Return the readings of a recording; each has its own length, and one value is missing."""
    values = np.arange(4.0 * int(name[-2:])).reshape(4, -1)
    values[0, 0] = np.nan
    return values


def make_results(folder, size, names=NAMES):
    """Write the results of an archive in batches of a size, and return them."""
    for batch, members in batches(names, size).items():
        for kind in (SIGNALS, MATRICES):
            arrays = {name: array_of(name) for name in members}
            write_arrays(folder / pattern(kind, size).format(batch=batch), arrays)
        for kind in (CHECKS, FITS):
            contents = {name: {"recording": name, "lag": int(name[-2:])} for name in members}
            write_contents(folder / pattern(kind, size).format(batch=batch), contents, batch)
    rows = [{"recording": name, "reason": ""} for name in names]
    files.write_csv(folder / "recordings.csv", ["recording", "reason"], rows)
    return Results(folder, names, size)


@pytest.mark.parametrize(
    ("kind", "size", "expected"),
    [
        (SIGNALS, 1, "signals/{batch}.npy"),
        (MATRICES, 10, "matrices/{batch}.npz"),
        (FITS, 1, "fits/{batch}.json"),
        (CHECKS, 10, "checks/{batch}.json"),
        (FEATURES, 1, "features/{batch}.npz"),
        (PLOT_DATA, 10, "plot_data/{batch}.json"),
    ],
)
def test_a_batch_of_several_has_the_file_of_a_recording_under_its_own_name(kind, size, expected):
    assert pattern(kind, size) == expected


@pytest.mark.parametrize("size", [1, 3, 100])
def test_each_recording_is_read_as_it_was_written(tmp_path, size):
    results = make_results(tmp_path, size)
    for name in NAMES:
        np.testing.assert_array_equal(results.signal(name), array_of(name))
        np.testing.assert_array_equal(results.matrix(name), array_of(name))
    some = NAMES[3::4]
    assert list(results.fits(NAMES[::-1])) == NAMES[::-1]
    assert list(results.checks(some)) == some
    assert {name: fit["lag"] for name, fit in results.fits(NAMES).items()} == {
        name: int(name[-2:]) for name in NAMES
    }


@pytest.mark.parametrize("shape", [(4, 1000), (3, 50), (1, 7)])
def test_an_array_is_read_as_numpy_reads_it(tmp_path, shape):
    arrays = {f"3mm/r{run}": np.random.default_rng(run).normal(size=shape) for run in (1, 2)}
    write_arrays(tmp_path / "batch.npz", arrays)
    write_arrays(tmp_path / "r1.npy", {"3mm/r1": arrays["3mm/r1"]})
    alone = np.load(tmp_path / "r1.npy")
    np.testing.assert_array_equal(read_array(tmp_path / "r1.npy", "3mm/r1"), alone)
    with np.load(tmp_path / "batch.npz") as stored:
        for name in arrays:
            np.testing.assert_array_equal(read_array(tmp_path / "batch.npz", name), stored[name])


def test_forks_read_the_archives_that_their_starter_has_open(tmp_path):
    names = [f"3mm/r{run:02d}" for run in range(1, 81)]
    results = make_results(tmp_path, 100, names)
    results.matrix(names[0])

    def largest(name):
        return float(np.nanmax(results.matrix(name)))

    assert list(Forks(2)(largest, names)) == [4.0 * int(name[-2:]) - 1 for name in names]


@pytest.mark.parametrize("size", [1, 16, 160])
def test_the_size_of_the_batches_is_found_on_disk(tmp_path, size):
    make_results(tmp_path, size)
    found = Results.on_disk(tmp_path)
    assert found.names == tuple(NAMES)
    np.testing.assert_array_equal(found.matrix("3mm/r05"), array_of("3mm/r05"))


def test_another_size_is_found_if_the_configuration_names_it(tmp_path):
    results = make_results(tmp_path, 3)
    assert Results.on_disk(tmp_path, 3).file(FITS, "3mm/r05") == results.file(FITS, "3mm/r05")


def test_a_table_of_the_labelled_recordings_leads_to_the_same_files(tmp_path):
    names = [*NAMES, "unlabelled/p01", "unlabelled/p02"]
    results = make_results(tmp_path, 3, names)
    rows = [{"recording": name} for name in NAMES]
    files.write_csv(tmp_path / "labelled.csv", ["recording"], rows)
    labelled = Results.of_table(tmp_path, tmp_path / "labelled.csv", 3)
    for kind in (SIGNALS, FEATURES):
        assert [labelled.file(kind, name) for name in NAMES] == [
            results.file(kind, name) for name in NAMES
        ]


@settings(deadline=None, max_examples=40)
@given(st.sampled_from([1, 10, 50, 100, 200]), st.integers(1, 400))
def test_the_recordings_of_a_batch_of_describe_lead_to_the_same_files(
    tmp_path_factory, size, count
):
    folder = tmp_path_factory.getbasetemp()
    names = [f"3mm/r{run:03d}" for run in range(count)]
    results = Results(folder, names, size)
    for batch, members in described_together(names, size).items():
        some = Results(folder, members, size, within=batch)
        for kind in (SIGNALS, CHECKS, FEATURES):
            assert [some.file(kind, n) for n in members] == [results.file(kind, n) for n in members]


def test_names_that_are_no_recordings_have_no_file(tmp_path):
    # The list names them with the reason why they were rejected.
    rows = [{"recording": name} for name in ("3mm/r01", "3mm/\\udcff", "3mm/a b:c")]
    files.write_csv(tmp_path / "recordings.csv", ["recording"], rows)
    assert Results.on_disk(tmp_path).names == ("3mm/r01",)


def test_what_a_file_holds_of_some_recordings_is_read_once(tmp_path):
    results, read = Results(tmp_path, NAMES, 1), []

    def read_lengths(path):
        read.append(path.relative_to(tmp_path).as_posix())
        return {"0mm/r01": 1, "3mm/r01": 3, "3mm/r02": 5}

    # No recording is there that was rejected.
    wanted = ["3mm/r01", "0mm/r01", "3mm/r07"]
    assert results.described(FEATURES, wanted, read_lengths) == {"3mm/r01": 3, "0mm/r01": 1}
    assert read == ["features/3mm/batch.npz", "features/0mm/batch.npz"]


# numpy reads a header as Python; this one has lost a bracket.
HEADER = b"\x93NUMPY\x01\x00\x76\x00%-117s\n" % b"{'descr': '<f8', 'shape': 4, 1000), }"


@pytest.mark.parametrize("size", [1, 10])
@pytest.mark.parametrize("content", [b"", b"\x00 garbage", b"PK", b"{}", b"[1]", HEADER, None])
@pytest.mark.parametrize("read", ["matrix", "fit"])
def test_a_damaged_and_a_missing_file_are_named_with_the_remedy(tmp_path, size, content, read):
    results = make_results(tmp_path, size)
    path = results.file(MATRICES if read == "matrix" else FITS, "3mm/r01")
    path.unlink() if content is None else path.write_bytes(content)
    with pytest.raises(CapsuleError) as caught:
        results.matrix("3mm/r01") if read == "matrix" else results.fits(["3mm/r01"])
    if content is None:
        assert (
            str(caught.value) == f"{path} does not exist; make all that is missing: snakemake -c2"
        )
    else:
        assert str(caught.value).startswith(f"{path} is damaged (")
        assert str(caught.value).endswith("); delete it, and make it again: snakemake -c2")
    assert "\n" not in str(caught.value)


def test_a_file_cut_short_is_damaged(tmp_path):
    for size in (1, 10):
        results = make_results(tmp_path / str(size), size)
        path = results.file(SIGNALS, "3mm/r07")
        path.write_bytes(path.read_bytes()[:-20])
        with pytest.raises(CapsuleError, match="is damaged"):
            results.signal("3mm/r07")
        path = results.file(CHECKS, "3mm/r07")
        path.write_bytes(path.read_bytes()[:-3])
        with pytest.raises(CapsuleError, match="is damaged"):
            results.checks(["3mm/r07"])


def left_in(folder, names, size):
    """Return what is left over, without the folder."""
    now, described = batches(names, size), described_together(names, size)
    found = left_over(folder, size, now, described)
    return [path.removeprefix(f"{folder.as_posix()}/") for path in found]


def test_of_an_archive_as_it_is_nothing_is_left_over(tmp_path):
    for size in (1, 3):
        make_results(tmp_path / str(size), size)
        assert left_in(tmp_path / str(size), NAMES, size) == []
    assert left_in(tmp_path / "none", NAMES, 1) == []


def test_files_of_a_recording_that_is_gone_are_left_over(tmp_path):
    make_results(tmp_path, 1)
    files.write_json(tmp_path / "plot_data/2mm/batch.json", {})
    assert left_in(tmp_path, [name for name in NAMES if name != "3mm/r07"], 1) == [
        "checks/3mm/r07.json",
        "fits/3mm/r07.json",
        "matrices/3mm/r07.npy",
        "plot_data/2mm/batch.json",
        "signals/3mm/r07.npy",
    ]


def test_files_of_another_size_are_left_over(tmp_path):
    make_results(tmp_path, 1)
    assert "signals/0mm/r01.npy" in left_in(tmp_path, NAMES, 10)
    assert len(left_in(tmp_path, NAMES, 10)) == 4 * len(NAMES)
    make_results(tmp_path, 10)
    assert len(left_in(tmp_path, NAMES, 1)) == 4 * len(["0mm/batch", "3mm/batch"])


@pytest.mark.parametrize(
    ("recordings", "size"), [(0, 1), (500, 1), (501, 16), (5000, 16), (5001, 160), (10**6, 160)]
)
def test_the_size_of_a_batch_goes_by_the_size_of_the_archive(recordings, size):
    assert batch_size(recordings, "auto") == size


@pytest.mark.parametrize("recordings", [1, 501, 5001])
def test_a_size_that_the_configuration_names_is_taken(recordings):
    assert batch_size(recordings, 7) == 7


def test_a_recording_alone_gives_its_batch_its_name():
    assert batches(["3mm/r02", "0mm/r01"], 1) == {"0mm/r01": ["0mm/r01"], "3mm/r02": ["3mm/r02"]}


def test_the_name_of_a_batch_of_several_tells_its_bits():
    assert list(batches(["0mm/r01", "3mm/r01", "3mm/r02", "3mm/r03"], 2)) == [
        "0mm/batch",
        "3mm/batch-0",
        "3mm/batch-1",
    ]


@few
@given(ARCHIVES, SIZES)
def test_each_recording_is_in_exactly_one_batch_and_none_is_too_large(names, most):
    divided = batches(names, most)
    assert sorted(name for members in divided.values() for name in members) == names
    assert all(1 <= len(members) <= most for members in divided.values())


@few
@given(ARCHIVES, SIZES)
def test_a_batch_holds_recordings_of_one_folder(names, most):
    for batch, members in batches(names, most).items():
        assert {name.partition("/")[0] for name in members} == {batch.partition("/")[0]}


@few
@given(ARCHIVES, DRAWN, SIZES)
def test_a_recording_that_comes_or_goes_changes_or_divides_one_batch(names, another, most):
    others = [name for name in names if name != another]
    without, among = batches(others, most), batches([*others, another], most)
    lost = [members for batch, members in without.items() if among.get(batch) != members]
    made = [members for batch, members in among.items() if without.get(batch) != members]
    assert len(lost) <= 1
    before = [name for members in lost for name in members]
    assert sorted(name for members in made for name in members) == sorted([*before, another])


@few
@given(ARCHIVES, SIZES, SIZES)
def test_a_batch_of_a_small_size_lies_within_one_of_a_larger_size(names, one, other):
    small, large = batches(names, min(one, other)), batches(names, max(one, other))
    batch_of = {name: batch for batch, members in large.items() for name in members}
    assert all(len({batch_of[name] for name in members}) == 1 for members in small.values())


@few
@given(ARCHIVES, SIZES, st.integers(1, 3))
def test_a_larger_batch_is_divided_as_the_whole_archive_is(names, most, times):
    # The rule describe finds the batches behind each of its own in this way.
    parts = {}
    for batch, members in batches(names, times * most).items():
        parts |= batches(members, most, within=batch)
    assert parts == batches(names, most)


@few
@given(st.permutations([f"3mm/r{run:02d}" for run in range(20)]), SIZES)
def test_the_order_of_names_does_not_matter(names, most):
    assert batches(names, most) == batches(sorted(names), most)


@pytest.mark.parametrize("count", [1000, 2000])
def test_batches_are_filled_by_half_and_more_on_average(count):
    assert len(batches([f"3mm/r{run:04d}" for run in range(count)], 100)) <= 2 * count / 100


def test_a_folder_is_described_whole_until_it_is_large():
    runs = [f"3mm/r{run:03d}" for run in range(DESCRIBED_TOGETHER + 1)]
    whole = {"0mm/batch": ["0mm/r01"], "3mm/batch": runs[:-1]}
    assert described_together(["0mm/r01", *runs[:-1]], 1) == whole
    divided = ["0mm/batch", "3mm/batch-0", "3mm/batch-1"]
    assert list(described_together(["0mm/r01", *runs], 10)) == divided
    assert list(described_together(runs, 1000)) == ["3mm/batch"]
