"""The list of recordings: which of several with the same readings counts, and near-copies."""

import numpy as np
import pytest

from capsule.errors import CapsuleError
from capsule.recordings import listing
from capsule.recordings.acceptance import fingerprint
from capsule.recordings.listing import nearly_equal
from capsule.recordings.names import Entry, classify
from capsule.recordings.recording import read_recording
from capsule.seeding import generator
from support.project import ROOT
from support.synthetic import make_recording


def checks(readings):
    """Make the checks of accepted recordings with these readings by name."""
    accepted = {"status": "accepted"}
    return {name: accepted | {"readings_sha256": each} for name, each in readings.items()}


def test_of_recordings_with_the_same_readings_the_original_counts_whatever_the_order():
    # Each that does not count, and the one that it copies.
    for copied in (
        # Under two sizes none counts, and a copy does not save a contradiction.
        {"3mm/r01": "4mm/r01", "4mm/r01": "3mm/r01"},
        {"0mm/r01": "4mm/r01", "0mm/r02": "4mm/r01", "4mm/r01": "0mm/r01", "unlabelled/p": ""},
        # The same size, written in another way.
        {"3mm/r01": "", "3.0mm/r01": "3mm/r01"},
        {"3mm/r02": "3mm/r01", "3mm/r01": ""},
        # The original keeps its place whatever the copy sorts before; a label counts more.
        *({"3mm/r01": "", f"3mm/{copy}": "3mm/r01"}
          for copy in ("a-copy-of-r01", "0r01", "r01-copy", "r01.1", "R01+")),
        {"unlabelled/a": "3mm/long-name", "3mm/long-name": ""},
    ):  # fmt: skip
        made = checks(dict.fromkeys(copied, "x") | {"3mm/other": "y"})
        reasons = listing.reasons_of_copies(made)
        assert reasons == listing.reasons_of_copies(dict(reversed(made.items())))
        assert reasons.keys() == {name for name, other in copied.items() if other}
        mislabelled = ", under another size: one of the two is mislabelled"
        for name, reason in reasons.items():
            told = mislabelled * (copied.get(copied[name]) != "")
            assert reason == f"the same content as {copied[name]}{told}"


def test_a_row_says_why_a_header_moves_no_cell_and_a_run_that_is_to_fail_lists_the_rejected():
    made = checks({"3mm/r01": "x", "3mm/old_r01": "x"})
    header = dict.fromkeys(("site", "session", "setup", "source"), "a\x1b[31m")
    told = dict.fromkeys(("size_mm", "samples", "duration_s", "sha256", "reason", "no_verdict"))
    for name, check in made.items():
        check |= told | {"recording": name, "header": header, "marks": []}
    # One is not checked yet, and one is no plain name.
    entries = map(Entry, ("3mm/r01.csv", "3mm/old_r01.csv", "3mm/x.csv", "3mm/x y.csv"))
    copy, kept, other = listing.full_list(classify(entries), made, {}.__getitem__)
    assert (copy["status"], kept["status"], other["size_mm"]) == ("rejected", "accepted", 3.0)
    assert {kept[key] for key in header} == {"a\\x1b[31m"}
    listing.refuse_rejected([kept])
    listed = "  3mm/old_r01: the same content as 3mm/r01\n  3mm/x y.csv: rename the file: "
    with pytest.raises(CapsuleError, match=f"are rejected:\n{listed}.*\nrepair"):
        listing.refuse_rejected([copy, kept, other])


def readings(name):
    return make_recording(3.0, name, samples=400).values


def found_in(archive):
    marks = {name: fingerprint(values) for name, values in archive.items()}
    return listing.near_copies(marks, archive.__getitem__)


AT = np.arange(400)
ALIKE = {
    "ohms of the divider": lambda run: 12000.0 * (1024.0 / run - 1.0),
    "a piece missing": lambda run: np.where(AT // 15 == 7, np.nan, run),
    "a fault": lambda run: np.where(AT // 60 == 3, 512 + AT % 3, run),
    "all at once": lambda run: (np.where(AT == 9, 0, run)[[1, 0, 3, 2], 2:-99] / 204.6).round(3),
}


@pytest.mark.parametrize("change", ALIKE.values(), ids=ALIKE)
def test_a_run_that_is_the_same_but_for_little_is_found(change):
    archive = {f"3mm/r{run:02d}": readings(f"3mm/r{run:02d}") for run in range(12)}
    archive["4mm/r03"] = change(readings("3mm/r03"))
    found = {"3mm/r03": ["4mm/r03"], "4mm/r03": ["3mm/r03"]}
    assert found_in(archive) == found_in(dict(reversed(archive.items()))) == found


@pytest.mark.parametrize("cut", [0, 40])
def test_runs_are_the_same_if_all_their_sensors_correlate(cut):
    # Of eight sections, three are quiet: their low correlation counts as that of the others.
    quiet = np.where(AT < 150, 0.01, 1.0)
    # At 0.15 the correlation is sqrt(1 / (1 + 0.15^2)) = 0.989.
    for noise, scale, same in ((0.1, 1.0, True), (0.15, 1.0, False), (0.08, quiet, False)):
        numbers = np.random.default_rng(1)
        one = scale * numbers.normal(size=(4, 400))
        other = (one + noise * numbers.normal(size=one.shape))[[2, 0, 3, 1], cut:]
        other[:, 50:60] = np.nan
        assert nearly_equal(one, other) == nearly_equal(other, one) == same


def test_copies_of_copies_belong_together():
    archive = {f"3mm/r{run}": readings(f"3mm/r{run}") for run in range(9)}
    archive |= {f"5mm/cut{cut:02d}": archive["3mm/r2"][:, cut:] for cut in range(1, 21)}
    found = found_in(archive)
    assert set(found) == {"3mm/r2", *(name for name in archive if name.startswith("5mm"))}
    assert all(len(others) == 20 for others in found.values())


def test_runs_with_a_wave_are_found_by_their_noise_and_different_ones_are_no_copies():
    archive = {}
    for path in sorted((ROOT / "raw").glob("[05]mm/?[01][16].csv")):
        with path.open("rb") as stream:
            archive[path.stem + path.parent.name] = read_recording(stream, 4).values
    assert found_in(archive) == {}
    # Kills: a lag at which a neighbour, or another period of the wave, fits better than the noise.
    for name, run in archive.items():
        part = run[::-1, 3 * run.shape[1] // 10 :] * 5 / 1023
        assert found_in({"run": run, "part": part}) == {"run": ["part"], "part": ["run"]}, name
    first, *others = archive.values()
    assert not any(nearly_equal(first, other) for other in others)


def test_at_least_half_of_the_shorter_recording_must_overlap():
    for rows, same in ((200, True), (199, False)):
        run = generator(1, "overlap").normal(size=(2, 800 - rows))
        # The last rows of the first are the first rows of the second; both have 400.
        assert nearly_equal(run[:, :400], run[:, 400 - rows :]) == same


def test_sections_without_a_change_have_no_correlation():
    run, still = np.zeros((2, 400)), np.ones((2, 400))
    run[:, 300:] = generator(1, "still").normal(size=(2, 100))
    assert nearly_equal(run, 3 * run + 5) and not nearly_equal(still, still)
    assert found_in({name: np.tile([1.0, 2.0], (4, 10)) for name in "ab"}) == found_in({}) == {}


def test_one_in_eight_marks_is_kept_and_each_takes_33_readings():
    run = generator(1, "marks").normal(size=(1, 8032))
    assert 900 < fingerprint(run).size < 1100
    assert fingerprint(np.vstack([run, run[:, ::-1]])).size > 1800
    # Of a pattern and its inverse, repeated and missing readings, there is the same mark.
    for same in (np.kron(-run, [1, np.nan]), np.repeat(run, 2, axis=1)):
        assert np.array_equal(fingerprint(same), fingerprint(run))
    for samples, most in ((32, 0), (33, 1)):
        runs = generator(1, "short").normal(size=(60, 1, samples))
        assert max(fingerprint(each).size for each in runs) == most


def test_recordings_that_share_a_quarter_of_the_shorter_list_are_compared():
    run = generator(1, "quarter").normal(size=(2, 300))
    for first, alike in ((75, {"one": ["other"], "other": ["one"]}), (76, {})):
        marks = {"one": np.arange(100), "other": np.arange(first, 275), "none": np.arange(0)}
        assert listing.near_copies(marks, lambda name: run) == alike
