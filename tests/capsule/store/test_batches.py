"""An archive is divided into batches by the names of its recordings alone."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from capsule.recordings.names import folder_of
from capsule.store.results import DESCRIBED_TOGETHER, batch_size, batches, divide

POOL = [f"{folder}/r-{run}" for folder in ("0mm", "2.5mm", "unlabelled") for run in range(99)]
DRAWN = st.sampled_from(POOL)
ARCHIVES = st.sets(DRAWN, max_size=60).map(sorted)
SIZES = st.integers(1, 9)


@pytest.mark.parametrize(
    ("recordings", "size"), [(0, 1), (500, 1), (501, 16), (5000, 16), (5001, 160), (10**6, 160)]
)
def test_the_size_of_a_batch_goes_by_the_size_of_the_archive_or_is_configured(recordings, size):
    assert batch_size(recordings, "auto") == size
    assert batch_size(recordings, 7) == 7


@given(ARCHIVES, SIZES, st.randoms())
def test_each_recording_is_in_one_batch_of_its_folder_whatever_the_order(names, most, shuffler):
    divided = batches(names, most)
    assert sorted(name for members in divided.values() for name in members) == names
    for batch, members in divided.items():
        assert 1 <= len(members) <= most
        assert set(map(folder_of, members)) == {folder_of(batch)}
    shuffled = names.copy()
    shuffler.shuffle(shuffled)
    assert batches(shuffled, most) == divided


@given(ARCHIVES, DRAWN, SIZES)
def test_a_recording_that_comes_or_goes_changes_or_divides_one_batch(names, another, most):
    others = [name for name in names if name != another]
    without, among = batches(others, most), batches([*others, another], most)
    lost = [members for batch, members in without.items() if among.get(batch) != members]
    made = [members for batch, members in among.items() if without.get(batch) != members]
    assert len(lost) <= 1
    before = [name for members in lost for name in members]
    assert sorted(name for members in made for name in members) == sorted([*before, another])


@given(ARCHIVES, SIZES, SIZES)
def test_a_batch_of_a_small_size_lies_within_one_of_a_larger_size(names, one, other):
    small, large = batches(names, min(one, other)), batches(names, max(one, other))
    batch_of = {name: batch for batch, members in large.items() for name in members}
    assert all(len({batch_of[name] for name in members}) == 1 for members in small.values())


@pytest.mark.parametrize("count", [1000, 2000])
def test_batches_are_filled_by_half_and_more_on_average(count):
    assert len(batches([f"3mm/r{run:04d}" for run in range(count)], 100)) <= 2 * count / 100


def test_a_folder_is_described_whole_until_it_is_large():
    runs = [f"3mm/r{run:03d}" for run in range(DESCRIBED_TOGETHER + 1)]
    whole = divide(["0mm/r01", *runs[:-1]], "auto")
    assert whole.alone and whole.described == {"0mm/batch": ["0mm/r01"], "3mm/batch": runs[:-1]}
    assert list(whole.batches) == ["0mm/r01", *runs[:-1]]
    assert whole.joined() == whole.described
    parted = divide(["0mm/r01", *runs], 10)
    assert list(parted.described) == ["0mm/batch", "3mm/batch-0", "3mm/batch-1"]
    assert not parted.alone
    # Each batch is joined once, by the one that holds its recordings.
    joined = [batch for names in parted.joined().values() for batch in names]
    assert sorted(joined) == list(parted.batches)
    assert list(divide(runs, 1000).described) == ["3mm/batch"]
