"""Whether nodules or their sizes follow from a key of the header, by the documented rule."""

from collections import Counter
from itertools import islice

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import hypergeom

from capsule.evaluation.confounded import (
    KEYS,
    OWN,
    Told,
    confounded_keys,
    in_words,
    of_values,
    spoken_for,
)
from capsule.recordings.recording import rate_of, source_of, split_header
from capsule.seeding import generator
from support.project import ROOT

SIZES = (1.0, 2.0, 3.0, 4.0, 5.0)


def told(pairs, place=lambda number: f"place {number}"):
    """Return what values tell, from pairs of a value and a size; each is a place of its own."""
    names = [f"{size:g}mm/{number}" for number, (_, size) in enumerate(pairs)]
    values, sizes_mm = zip(*pairs, strict=True)
    places = [place(number) for number in range(len(names))]
    return of_values(
        "session",
        dict(zip(names, values, strict=True)),
        dict(zip(names, map(float, sizes_mm), strict=True)),
        dict(zip(names, places, strict=True)),
    )


def healthy(value, count=20):
    return [(value, 0.0)] * count


def nodules(value, each=20, sizes_mm=SIZES):
    return [(value, size) for size in sizes_mm for _ in range(each)]


def alone(pairs):
    """Give each recording a value of its own."""
    return [(f"value {number}-{size}", size) for number, (_, size) in enumerate(pairs)]


def test_healthy_recordings_from_one_source_and_nodules_from_another_are_told_apart():
    found = told([*healthy("A"), *nodules("B")])
    assert found.nodules == Told(100, 100, 20, 20)
    assert found.of_any and found.nodules_mm == SIZES
    # All nodules are from one source: of which size they are does not follow.
    assert found.sizes_mm == ()
    assert found.counts == {"B": dict.fromkeys(SIZES, 20), "A": {0.0: 20}}
    assert found.what() == "whether there is a nodule"


@pytest.mark.parametrize("healthy_count", [1, 2, 4])
def test_a_few_recordings_are_told_apart_too_if_every_one_is(healthy_count):
    assert told([*healthy("A", healthy_count), *nodules("B", 1)]).of_any


def test_one_value_for_all_tells_nothing():
    assert not told([*healthy("A"), *nodules("A")])
    assert not told([*healthy(""), *nodules("")])


def test_a_value_of_its_own_for_each_recording_tells_nothing_of_a_new_one():
    found = told(alone([*healthy(""), *nodules("")]))
    assert not found
    assert found.counts == {OWN: {0.0: 20, **dict.fromkeys(SIZES, 20)}}


@pytest.mark.parametrize(
    "pairs",
    [
        [*healthy("A"), *alone(nodules(""))],
        [*alone(healthy("")), *nodules("B")],
    ],
    ids=["nodules", "healthy"],
)
def test_values_of_single_places_are_told_from_a_common_one(pairs):
    assert told(pairs).nodules == Told(100, 100, 20, 20)


def test_a_session_for_each_size_is_confounded_with_nodule_and_size():
    found = told([*healthy("day 0"), *((f"day {each}", each) for _, each in nodules(""))])
    assert found.of_any and found.nodules_mm == found.sizes_mm == SIZES


def test_a_session_for_each_nodule_size_with_healthy_recordings_tells_the_size_alone():
    pairs = [pair for each in SIZES for pair in healthy(f"day {each}")]
    pairs += [(f"day {each}", each) for _, each in nodules("")]
    found = told(pairs)
    assert not found.of_any and not found.nodules_mm
    assert found.sizes_mm == SIZES
    assert found.what() == "the size of nodules of 1, 2, 3, 4 and 5 mm"


def test_several_sessions_with_all_sizes_tell_nothing():
    sessions = [f"day {day}" for day in range(4)]
    pairs = [pair for each in sessions for pair in healthy(each, 5) + nodules(each, 5)]
    assert not told(pairs)
    # Nor does a further session of a few more recordings of each kind.
    assert not told([*pairs, *healthy("day 4", 2), *nodules("day 4", 1)])
    # Nor does a rare size of one day, which has all other sizes too.
    assert not told([*pairs, *[("day 1", 2.5)] * 5])


@pytest.mark.parametrize(
    ("apart", "confounded"), [(0, False), (10, False), (13, False), (14, True), (18, True)]
)
def test_a_part_of_the_healthy_recordings_has_a_source_without_nodules(apart, confounded):
    found = told([*healthy("A", apart), *healthy("B", 20 - apart), *nodules("B")])
    assert bool(found) == found.of_any == confounded
    if confounded:
        # The nodules' source holds at most a third of the healthy share: it speaks for nodules.
        assert found.nodules == Told(100, 100, apart, 20)


@pytest.mark.parametrize(("apart", "confounded"), [(5, False), (11, False), (12, True), (20, True)])
def test_a_part_of_the_nodules_of_one_size_has_a_source_of_its_own(apart, confounded):
    others = nodules("A", 20, (1.0, 2.0, 4.0, 5.0))
    found = told([*healthy("A"), *others, *nodules("A", 20 - apart, (3.0,)), *[("B", 3.0)] * apart])
    assert not found.of_any
    assert found.nodules_mm == ((3.0,) if confounded else ())
    if confounded:
        assert found.what() == "whether there is a nodule of 3 mm"


def test_recordings_of_one_place_count_once_and_never_tell_each_other():
    # Ten passes over each of two healthy places, and over each of three with a nodule.
    pairs = [*healthy("A"), *[("B", 3.0)] * 30]
    found = told(pairs, lambda number: f"place {number // 10}")
    assert found.nodules == Told(3, 3, 2, 2)
    # If each place has its own session, no other place has it.
    own = [(f"session {number // 10}", size) for number, (_, size) in enumerate(pairs)]
    assert not told(own, lambda number: f"place {number // 10}")


def test_a_place_with_several_values_counts_in_parts():
    pairs = [*healthy("A", 10), *nodules("B", 2), ("A", 1.0), ("B", 1.0)]
    found = told(pairs, lambda number: f"place {min(number, 20)}")
    assert found.nodules == Told(10.5, 11, 10, 10)
    assert found.nodules.chance() == pytest.approx(hypergeom(21, 11, 10).sf(9))


def test_without_both_classes_nothing_is_told():
    assert not told(healthy("A"))
    assert not told(nodules("A", 20, (3.0,)))
    # Nodules alone can still give their sizes away.
    assert told([*nodules("A", 20, (1.0,)), *nodules("B", 20, (2.0,))]).sizes_mm == (1.0, 2.0)


@pytest.mark.parametrize(("found", "passed"), [(0, 12), (3, 9), (7, 7), (9, 12), (9, 0)])
def test_chance_is_fishers_exact_test(found, passed):
    called = found + 12 - passed
    expected = hypergeom(9 + 12, 9, called).sf(found - 1)
    assert Told(found, 9, passed, 12).chance() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("counts", "values", "most"),
    [((20, 100), 5, 0.01), ((20, 100), 40, 0.01), ((8, 40), 6, 0.03), ((6, 6), 2, 0.03)],
)
def test_values_that_are_dealt_at_random_seldom_warn(counts, values, most):
    numbers, warned, archives = generator(1, "dealt", *map(str, counts), str(values)), 0, 200
    sizes_mm = [0.0] * counts[0] + [SIZES[number % 5] for number in range(counts[1])]
    for _ in range(archives):
        dealt = numbers.integers(0, values, len(sizes_mm))
        warned += bool(told([(f"v{v}", size) for v, size in zip(dealt, sizes_mm, strict=True)]))
    # Three standard errors more.
    assert warned / archives <= most + 3 * (most * (1 - most) / archives) ** 0.5


ARCHIVES = st.lists(
    st.tuples(st.sampled_from("ABCDE"), st.sampled_from((0.0, 1.0, 3.0))), min_size=1
)


def rows_of(pairs):
    return {
        f"{size:g}mm/{number}": {
            "status": "accepted",
            "no_verdict": "",
            "source": value,
            "near_copies": "",
        }
        for number, (value, size) in enumerate(pairs)
    }


@settings(max_examples=60, deadline=None)
@given(ARCHIVES, st.randoms())
def test_the_order_of_the_recordings_changes_nothing(pairs, random):
    rows = list(rows_of(pairs * 3).items())
    expected = confounded_keys(dict(rows), [])
    random.shuffle(rows)
    assert confounded_keys(dict(rows), []) == expected


@settings(max_examples=60, deadline=None)
@given(ARCHIVES, st.permutations("ABCDE"))
def test_the_names_of_the_values_change_nothing(pairs, names):
    pairs = pairs * 3
    new = dict(zip("ABCDE", names, strict=True))
    one, other = told(pairs), told([(new[value], size) for value, size in pairs])
    assert other.counts == {new.get(value, value): of for value, of in one.counts.items()}
    assert (other.nodules, other.nodules_mm) == (one.nodules, one.nodules_mm)
    assert other.sizes_mm == one.sizes_mm


def test_recordings_that_do_not_teach_do_not_count():
    rows = rows_of([*healthy("A"), *nodules("B")])
    (found,) = confounded_keys(rows, [])
    assert (found.key, sum(map(Counter.total, found.counts.values()))) == ("source", 120)
    for change in ({"status": "rejected"}, {"no_verdict": "no wave"}, {"session": "late"}):
        changed = {
            name: row | (change if name.startswith("0mm") else {}) for name, row in rows.items()
        }
        assert confounded_keys(changed, ["late"]) == []
    renamed = {name.replace("0mm", "unlabelled"): row for name, row in rows.items()}
    assert confounded_keys(renamed, []) == []


@pytest.mark.parametrize("key", KEYS)
def test_each_key_is_looked_at_and_a_missing_line_is_a_value(key):
    rows = rows_of([*healthy("same"), *nodules("same")])
    told_by = {name: row | ({key: "7"} if name[0] != "0" else {}) for name, row in rows.items()}
    if key == "source":
        for name, row in told_by.items():
            row["source"] = "7" if name[0] != "0" else ""
    (found,) = confounded_keys(told_by, [])
    assert found.key == key
    assert set(found.counts) == {"", "7"}
    assert in_words([found]) == f"whether there is a nodule follows from the {KEYS[key]}"


@pytest.mark.parametrize("held_out", [["simulated-1000000"], []], ids=str)
def test_nothing_follows_from_the_headers_of_the_shipped_archive(held_out):
    rows = {}
    for path in sorted((ROOT / "raw").glob("*mm/*.csv")):
        with path.open(encoding="utf-8") as stream:
            header, _ = split_header([line.rstrip("\n") for line in islice(stream, 20)])
        row = {"status": "accepted", "source": source_of(header), "rate_hz": rate_of(header)}
        row |= {key: header.get(key, "") for key in ("session", "site", "unit")}
        rows[f"{path.parent.name}/{path.stem}"] = row
    assert len(rows) == 280
    assert confounded_keys(rows, held_out) == []


def test_versions_of_a_simulator_are_sources_but_its_seeds_are_not():
    source = "simulated phantom, version {}, seed {}"
    seeds = [source.format(5, 1 + (size > 0)) for _, size in [*healthy(""), *nodules("")]]
    sizes_mm = [size for _, size in [*healthy(""), *nodules("")]]
    assert confounded_keys(rows_of(list(zip(seeds, sizes_mm, strict=True))), []) == []
    versions = [source.format(4 + (size > 0), number) for number, size in enumerate(sizes_mm)]
    (found,) = confounded_keys(rows_of(list(zip(versions, sizes_mm, strict=True))), [])
    assert set(found.counts) == {"simulated phantom, version 4", "simulated phantom, version 5"}


def test_what_follows_from_several_keys_is_one_clause():
    by_source = told([*healthy("A"), *nodules("B")])
    by_day = told([(f"day {each}", each) for _, each in [*nodules(""), *healthy("")]])
    assert in_words([]) == ""
    assert in_words([by_source, by_day]) == (
        "whether there is a nodule follows from the session and from the session"
    )


@pytest.mark.parametrize(
    ("found", "passed", "too_well"),
    [(32, 32, True), (31, 32, False), (40, 24, True), (24, 40, True), (40, 23, False)],
)
def test_a_value_tells_too_well_from_a_mean_rate_of_four_fifths_on(found, passed, too_well):
    assert Told(found, 40, passed, 40).too_well() == too_well


def test_a_value_tells_too_well_only_if_chance_hardly_does_and_the_less_the_more_tests():
    # Of 4 and 4 places, all right by chance: 1 of 70. Of 5 and 5: 1 of 252.
    assert Told(4, 4, 4, 4).chance() == pytest.approx(1 / 70)
    assert not Told(4, 4, 4, 4).too_well()
    assert Told(5, 5, 5, 5).chance() == pytest.approx(1 / 252)
    assert Told(5, 5, 5, 5).too_well() and Told(5, 5, 5, 5).too_well(2)
    assert not Told(5, 5, 5, 5).too_well(3)
    assert not Told(0, 0, 5, 5).too_well() and not Told(5, 5, 0, 0).too_well()
    assert Told(4, 4, 4, 4).all_right and not Told(4, 4, 3.5, 4).all_right
    assert not Told(0, 0, 4, 4).all_right


@pytest.mark.parametrize(("healthy", "spoken"), [(2, 1.0), (3, None)])
def test_a_value_speaks_for_a_class_that_has_it_three_times_as_often(healthy, spoken):
    # The recording that is asked is of its own place, which does not count.
    classes = {f"n{number}": 1.0 for number in range(11)}
    classes |= {f"h{number}": 0.0 for number in range(10)}
    values = {name: "a" for name in classes}
    values |= {"n0": "b", "n1": "b", "n2": "b", "n3": "b"}
    # Six of the ten others have it: a share of 0.6, and 2 of 10 healthy ones one of 0.2.
    values |= {f"h{number}": "b" for number in range(healthy, 10)}
    places = {name: name for name in classes}
    assert spoken_for(classes, values, places)["n10"] == spoken
