"""Recordings of one site and near copies are one place."""

import itertools

import numpy as np

from capsule.recordings.places import places_of


def passage(site="", near_copies=""):
    return {"site": site, "near_copies": near_copies}


def test_passes_over_a_site_and_near_copies_are_one_place():
    rows = {
        "3mm/a": passage("here"),
        "3mm/b": passage("here"),
        "3mm/c": passage("there", "3mm/b 3mm/gone"),
        "3mm/d": passage("there"),
        "3mm/e": passage("elsewhere"),
    }
    found = places_of(rows)
    assert {found[name] for name in ("3mm/a", "3mm/b", "3mm/c", "3mm/d")} == {"3mm/a"}
    assert found["3mm/e"] == "3mm/e"


def test_places_are_the_connected_components_for_any_rows():
    """Compare with the components found slowly: join whatever is linked until nothing changes."""
    numbers = np.random.default_rng(3)
    for _ in range(200):
        names = [f"3mm/r{number}" for number in range(8)]
        rows = {
            name: passage(
                numbers.choice(["", "a", "b", "c", "d"]),
                " ".join(numbers.choice(names, numbers.integers(0, 2))),
            )
            for name in names
        }
        slowly = {name: {name} for name in names}
        for _ in names:
            for one, other in itertools.permutations(names, 2):
                linked = rows[one]["site"] and rows[one]["site"] == rows[other]["site"]
                if linked or other in rows[one]["near_copies"].split():
                    both = slowly[one] | slowly[other]
                    for name in both:
                        slowly[name] = both
        found = places_of(rows)
        for one, other in itertools.combinations(names, 2):
            assert (found[one] == found[other]) == (other in slowly[one])
