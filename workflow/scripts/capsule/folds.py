"""Which recordings may teach the detector that judges a recording: the evaluation's schemes."""

from collections.abc import Mapping, Sequence

import numpy as np

GROUP_KEYS = {"leave_one_site_out": "site", "leave_one_session_out": "session"}


def groups_of(
    scheme: str, names: Sequence[str], headers: Mapping[str, Mapping[str, str]]
) -> list[str] | None:
    """Name each recording's group: what is left out when it is judged.

    Parameters
    ----------
    scheme : str
        ``leave_one_out``, ``resubstitution``, ``leave_one_site_out`` or ``leave_one_session_out``.
    names : sequence of R str
        The recordings.
    headers : mapping of str to mapping
        The header lines of each recording; one that names no site (session) is its own group.

    Returns
    -------
    list of R str, or None
        None where the scheme says nothing of its own: all recordings are of one group, so nothing
        would be left to learn from, or each is a group by itself, as in ``leave_one_out``.
    """
    if scheme not in GROUP_KEYS:
        return list(names)
    key = GROUP_KEYS[scheme]
    # A mark no header can hold keeps unnamed recordings apart from groups of the same name.
    groups = [headers[name].get(key) or f"\x00{name}" for name in names]
    return groups if 1 < len(set(groups)) < len(groups) else None


def training_masks(scheme: str, groups: Sequence[str]) -> np.ndarray:
    """Tell which recordings teach the detector that judges each recording.

    Parameters
    ----------
    scheme : str
        As in `groups_of`; with ``resubstitution`` all of them do.
    groups : sequence of R str
        From `groups_of`.

    Returns
    -------
    (R, R) array of bool
        Row r is the training fold of recording r.
    """
    labels = np.unique(np.array(groups), return_inverse=True)[1]
    if scheme == "resubstitution":
        return np.ones((labels.size, labels.size), dtype=bool)
    return labels[:, np.newaxis] != labels[np.newaxis, :]
