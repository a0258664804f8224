"""Places: recordings of one site or near copies of each other are one unit."""

import itertools

import numpy as np

from capsule.places import places_of


def row(site="", near_copies=""):
    return {"site": site, "near_copies": near_copies}


def test_a_recording_that_shares_nothing_is_a_place_of_its_own():
    rows = {"0mm/a": row(), "3mm/b": row("here")}
    assert places_of(rows) == {"0mm/a": "0mm/a", "3mm/b": "3mm/b"}


def test_passes_over_a_site_and_near_copies_are_one_place():
    rows = {
        "3mm/a": row("here"),
        "3mm/b": row("here"),
        "3mm/c": row("there", "3mm/b 3mm/gone"),
        "3mm/d": row("there"),
        "3mm/e": row("elsewhere"),
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
            name: row(
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
