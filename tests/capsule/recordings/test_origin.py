"""Where recordings come from, by their headers, and one checksum of all."""

import pytest

from capsule.recordings import origin


@pytest.mark.parametrize(
    ("sources", "kind"),
    [
        (["simulated phantom"] * 3, "simulated"),
        (["bench 2", "bench 3"], "recorded"),
        (["bench 2", "Simulated"], "mixed"),
        (["bench 2", ""], "mixed"),
        (["", ""], "unknown"),
        ([], "none"),
    ],
)
def test_the_origin_comes_from_what_the_recordings_say(sources, kind):
    assert origin.origin_of(sources).kind == kind


def test_each_recording_counts_once():
    sources = ["bench 2", "imported from a.csv", "imported from a.csv", "Simulated", ""]
    found = origin.origin_of(sources)
    assert (found.simulated, found.imported, found.recorded, found.silent) == (1, 2, 1, 1)


def test_the_combined_checksum_is_of_sorted_lines():
    first = origin.combined_checksum({"b": "22", "a": "11"})
    assert first == origin.combined_checksum({"a": "11", "b": "22"})
    assert first != origin.combined_checksum({"a": "22", "b": "11"})
