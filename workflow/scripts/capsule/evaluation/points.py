"""Tables for the figures of rates: one row for each point with its interval."""

import pandas as pd

COLUMNS = [
    *("measure", "size_mm", "detector", "scheme"),
    *("hits", "of", "rate", "low", "high", "one_sided"),
]


def detection_points(detection: pd.DataFrame) -> pd.DataFrame:
    """Return precision and recall per size from the table of detection, ours and the paper's."""
    detection = detection.assign(
        positives=detection["tp"] + detection["fp"], of_size=detection["tp"] + detection["fn"]
    )
    frames = [
        _points(detection, "precision", "tp", "positives"),
        _points(detection, "recall", "tp", "of_size"),
    ]
    return pd.concat(frames, ignore_index=True)


def sizing_points(sizing: pd.DataFrame) -> pd.DataFrame:
    """Return the exact and the within-tolerance rate per size from the table of sizing."""
    within = _points(sizing, "within_rate", "within", "recordings")
    within["one_sided"] = sizing["one_sided"].astype(bool).to_numpy()
    return pd.concat(
        [_points(sizing, "exact_rate", "exact", "recordings"), within], ignore_index=True
    )


def negative_points(confusion: pd.DataFrame) -> pd.DataFrame:
    """Return how the recordings without a nodule were classified.

    Parameters
    ----------
    confusion : DataFrame
        Counts and shares for each detector, scheme, true size and predicted size.

    Returns
    -------
    DataFrame
        ``size_mm`` is the predicted size; NaN for no verdict. A detector and scheme without such
        recordings have no row.
    """
    healthy = confusion[confusion["size_mm"] == 0]
    healthy = healthy.assign(
        of=healthy.groupby(["detector", "scheme"], sort=False)["count"].transform("sum"),
        size_mm=healthy["predicted_mm"],
    )
    points = _points(healthy[healthy["of"] > 0], "share", "count", "of")
    return points.assign(measure="classified").reset_index(drop=True)


def _points(table: pd.DataFrame, measure: str, hits: str, of: str) -> pd.DataFrame:
    points = table[["size_mm", "detector", "scheme"]].assign(
        measure=measure,
        hits=table[hits],
        of=table[of],
        rate=table[measure],
        low=table[f"{measure}_low"],
        high=table[f"{measure}_high"],
        one_sided=False,
    )
    return points[COLUMNS]
