"""Whether nodules or their sizes follow from a key of the header, by the documented rule."""

from collections import Counter

import pytest

from capsule.evaluation.confounded import KEYS, OWN, confounded_keys, in_words, of_values

SIZES = (1.0, 2.0, 3.0, 4.0, 5.0)


def told(pairs, place=lambda number: number):
    """Return what values tell, from pairs of a value and a size; each is a place of its own."""
    values, sizes_mm = (dict(enumerate(each)) for each in zip(*pairs, strict=True))
    return of_values("session", values, sizes_mm, {number: place(number) for number in values})


def healthy(value, count=20):
    return [(value, 0.0)] * count


def nodules(value, each=20, sizes_mm=SIZES):
    return [(value, size) for size in sizes_mm for _ in range(each)]


def alone(pairs):
    """Give each recording a value of its own."""
    return [(f"value {number}-{size}", size) for number, (_, size) in enumerate(pairs)]


EACH_DAY = [pair for n in range(4) for pair in healthy(f"day {n}", 5) + nodules(f"day {n}", 5)]
OF_DAYS = [(f"day {size:g}", size) for _, size in nodules("")]
BOTH_OF_DAYS = [*OF_DAYS, *(pair for size in SIZES for pair in healthy(f"day {size:g}"))]


@pytest.mark.parametrize(
    ("pairs", "of_nodules", "sizes_mm"),
    [
        pytest.param([*healthy("A"), *nodules("B")], True, (), id="two sources"),
        pytest.param([*healthy("A", 1), *nodules("B", 1)], True, (), id="a few recordings"),
        pytest.param(alone([*healthy(""), *nodules("")]), False, (), id="a value for each"),
        pytest.param([*healthy("A"), *alone(nodules(""))], True, (), id="healthy in common"),
        pytest.param([*alone(healthy("")), *nodules("B")], True, (), id="nodules in common"),
        pytest.param([*healthy("day 0"), *OF_DAYS], True, SIZES, id="a session for each size"),
        pytest.param(BOTH_OF_DAYS, False, SIZES, id="a session for each size, with healthy ones"),
        pytest.param(EACH_DAY, False, (), id="each session has all"),
        pytest.param([*EACH_DAY, ("day 4", 0.0), ("day 4", 1.0)], False, (), id="a small session"),
        # Kills: any other chance. Four healthy places meet with (24/124)^4 = 0.0014, five with
        # 0.0003; one in a hundred, by five sessions and two classes, is 0.001.
        pytest.param([*EACH_DAY, *healthy("day 4", 4)], False, (), id="four healthy ones"),
        pytest.param([*EACH_DAY, *healthy("day 4", 5)], True, (), id="a session of healthy ones"),
        pytest.param([*EACH_DAY, *[("day 1", 2.5)] * 5], False, (), id="a rare size of one day"),
        pytest.param([*healthy("A"), *nodules("A"), *[("B", 3.0)] * 3], False, (), id="by chance"),
        pytest.param([*healthy("A"), *nodules("A"), *[("B", 3.0)] * 9], False, (3.0,), id="a size"),
        pytest.param(healthy("A"), False, (), id="healthy alone"),
        pytest.param(nodules("A", 20, (3.0,)), False, (), id="one size alone"),
        pytest.param([("A", 1.0)] * 20 + [("B", 2.0)] * 20, False, (1.0, 2.0), id="sizes"),
    ],
)
def test_a_value_of_one_class_alone_is_found(pairs, of_nodules, sizes_mm):
    found = told(pairs)
    assert (found.nodules, found.sizes_mm) == (of_nodules, sizes_mm)
    # Each recording is counted by its value, and those of single places together.
    values = Counter(value for value, _ in pairs)
    counted = Counter((OWN if values[value] == 1 else value, size) for value, size in pairs)
    assert {(v, size): n for v, of in found.counts.items() for size, n in of.items()} == counted
    totals = [of.total() for of in found.counts.values()]
    assert totals == sorted(totals, reverse=True)


def test_recordings_of_one_place_count_once():
    # Ten passes over each of two healthy places, and over each of three with a nodule.
    pairs = [*healthy("A"), *[("B", 3.0)] * 30]
    assert told(pairs, lambda number: number // 10).nodules
    # Sixteen recordings of one value are few, if they are passes over two places.
    mixed = [*healthy("A"), *nodules("A"), *[("B", 0.0)] * 16]
    assert told(mixed).nodules
    assert not told(mixed, lambda number: number if number < 120 else -(number // 8)).nodules
    # If each place has its own session, no other place has it.
    own = [(number // 10, size) for number, (_, size) in enumerate(pairs)]
    assert not told(own, lambda number: number // 10).nodules


def rows_of(pairs):
    usual = {"status": "accepted", "no_verdict": "", "near_copies": ""}
    return {f"{size:g}mm/{n}": usual | {"source": value} for n, (value, size) in enumerate(pairs)}


def test_recordings_that_do_not_teach_do_not_count():
    rows = rows_of([*healthy("A"), *nodules("B")])
    (found,) = confounded_keys(rows, [])
    assert (found.key, sum(map(Counter.total, found.counts.values()))) == ("source", 120)
    for change in ({"status": "rejected"}, {"no_verdict": "no wave"}, {"session": "late"}):
        changed = {name: row | (change if name[0] == "0" else {}) for name, row in rows.items()}
        assert confounded_keys(changed, ["late"]) == []
    renamed = {name.replace("0mm", "unlabelled"): row for name, row in rows.items()}
    assert confounded_keys(renamed, []) == []


def test_each_key_is_looked_at_and_a_missing_line_is_a_value():
    rows = rows_of([*healthy("same"), *nodules("same")])
    for key, said in KEYS.items():
        changed = {name: row | {key: "7" * (name[0] != "0")} for name, row in rows.items()}
        (found,) = confounded_keys(changed, [])
        assert (found.key, set(found.counts)) == (key, {"", "7"})
        assert in_words([found]) == f"whether there is a nodule follows from the {said}"
    # What follows from several keys is one clause.
    said = in_words([found, found, told(BOTH_OF_DAYS)])
    assert said.count("follows from") == 2 and "nodules of 1, 2, 3, 4 and 5 mm" in said
    # Versions of a simulator are sources, but its seeds are not.
    source, pairs = "simulated phantom, version {}, seed {}", [*healthy(""), *nodules("")]
    seeds = [(source.format(5, 1 + (size > 0)), size) for _, size in pairs]
    assert confounded_keys(rows_of(seeds), []) == []
    versions = [(source.format(4 + (each > 0), n), each) for n, (_, each) in enumerate(pairs)]
    (found,) = confounded_keys(rows_of(versions), [])
    assert set(found.counts) == {"simulated phantom, version 4", "simulated phantom, version 5"}
