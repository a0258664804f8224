"""Where recordings come from, by their headers, and one checksum of all."""

import pytest

from capsule.recordings import origin


@pytest.mark.parametrize(
    ("sources", "kind", "counts"),
    [
        (["simulated phantom"] * 3, "simulated", (3, 0, 0, 0)),
        (["bench 2", "bench 3"], "recorded", (0, 0, 2, 0)),
        (["bench 2", "Simulated"], "mixed", (1, 0, 1, 0)),
        (["imported from a.csv"] * 2, "imported", (0, 2, 0, 0)),
        (["bench 2", " ", "imported from a.csv"], "mixed", (0, 1, 1, 1)),
        (["", ""], "unknown", (0, 0, 0, 2)),
        ([], "none", (0, 0, 0, 0)),
    ],
)
def test_the_origin_comes_from_what_the_recordings_say_and_each_counts_once(sources, kind, counts):
    found = origin.origin_of(sources)
    told = (found.simulated, found.imported, found.recorded, found.silent)
    assert (found.kind, told) == (kind, counts)


def test_the_combined_checksum_is_of_sorted_lines():
    first = origin.combined_checksum({"b": "22", "a": "11"})
    assert first == origin.combined_checksum({"a": "11", "b": "22"})
    assert first != origin.combined_checksum({"a": "22", "b": "11"})
