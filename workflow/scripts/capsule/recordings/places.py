"""Find which recordings are of one place.

Passes over one place share its gut wall and its nodule. If one pass teaches a detector, the verdict
on another pass is not independent. So a place is the unit that is left out, counted and weighed.
"""

from collections.abc import Mapping


def places_of(rows: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Return the place of each recording.

    Recordings are of one place if their headers name the same site, or if they are near copies of
    each other. Both relations are joined: a near copy brings its whole site with it.

    Parameters
    ----------
    rows : mapping of str to mapping
        The rows of recordings.csv, with ``site`` and ``near_copies``. Names of recordings that have
        no row are passed over.

    Returns
    -------
    dict of str to str
        Two recordings have the same text exactly if they are of one place. The text is the name of
        the place's first recording, so it does not depend on what other places hold.
    """
    place = {name: name for name in rows}
    first_of_site: dict[str, str] = {}
    for name, row in rows.items():
        near = [other for other in row.get("near_copies", "").split() if other in place]
        if row.get("site"):
            near.append(first_of_site.setdefault(row["site"], name))
        for other in near:
            one, two = _root(place, name), _root(place, other)
            place[two] = one
    members: dict[str, list[str]] = {}
    for name in rows:
        members.setdefault(_root(place, name), []).append(name)
    return {name: names[0] for names in members.values() for name in names}


def _root(place: dict[str, str], name: str) -> str:
    while place[name] != name:
        name = place[name]
    return name
