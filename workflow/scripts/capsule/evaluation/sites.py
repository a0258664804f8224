"""Several passes over one site, judged together by their mean score.

The paper's capsule goes back to a suspicious place. The mean over several passes scatters less than
a single score. Passes over one site with another label are another site.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pandas as pd

from capsule.detectors.calibrate import rank_threshold
from capsule.detectors.registry import detector_row
from capsule.detectors.verdicts import row_verdict
from capsule.evaluation.columns import SITES
from capsule.evaluation.cross_validation import Rows, choosing_scheme
from capsule.kinds import Cells, Settings

_OF_A_NODULE = {
    "estimate_mm": "mean",
    "location_mm": "median",
    "estimate_low_mm": "mean",
    "estimate_high_mm": "mean",
}


def site_table(
    predictions: pd.DataFrame, detections: Sequence[Cells], index: Rows, rules: Settings
) -> pd.DataFrame:
    """Return each detector's verdict on every site with several recordings, by `site_verdicts`.

    The places of predictions.csv teach the thresholds of several passes. The detections are the
    rows of detections.csv, whose size is not known. The index has the rows of recordings.csv, with
    ``site``, in the order of the passes; the rules are section ``evaluation``. The columns are
    `SITES`, of which ``unlike_recording`` names the first pass that is not familiar.
    """
    judged = predictions[predictions["scheme"] == choosing_scheme(rules["schemes"])]
    verdicts = pd.concat([judged, pd.DataFrame(detections)])
    turn = {recording: number for number, recording in enumerate(index)}
    named = {recording: row["site"] or recording for recording, row in index.items()}
    verdicts = verdicts.assign(site=verdicts["recording"].map(named))
    answers = verdicts[verdicts["familiar"].isin(["yes", "no"])]
    strange = answers[answers["familiar"] == "no"].drop_duplicates("site").set_index("site")
    why = ["unfamiliar_because", "unlike_value", "unlike_least", "unlike_most"]
    unlike = strange[["recording", *why]].rename(columns={"recording": "unlike_recording"})
    made = []
    for detector, rows in verdicts.groupby("detector", sort=False):
        # The order of the sites is that of the verdicts.
        number = rows.groupby(["site", "size_mm"], sort=False, dropna=False).ngroup()
        order = np.lexsort((rows["recording"].map(turn), number))
        made.append(site_verdicts(rows.iloc[order], detector, rules["specificity"]))
    table = pd.concat(made) if made else pd.DataFrame(columns=SITES)
    table = table[table["recordings"] > 1]
    known = np.where(table["site"].isin(answers["site"]), "yes", "")
    table["familiar"] = np.where(table["site"].isin(unlike.index), "no", known)
    for name, told in unlike.items():
        table[name] = table["site"].map(told)
    table["verdict"] = [str(row_verdict(row)) for row in table.to_dict("records")]
    return table[SITES]


def site_verdicts(rows: pd.DataFrame, detector: str, specificity: float) -> pd.DataFrame:
    """Return a detector's verdicts on sites from all their passes.

    The threshold is also learned from means. Each mean is over as many passes of another healthy
    site as this site has. A healthy site with fewer passes gives the mean of all its passes, which
    makes the threshold rather too high.

    The rows are the detector's verdicts, with ``site``, in the order of the sites and of their
    passes. The result has one row for each site, with the columns `SITES` but whether it is
    familiar:

    - ``passes``: how many of them have a score; ``score`` is their mean.
    - ``detected``: whether the score is above the threshold; None for no verdict.
    - ``estimate_mm``, ``location_mm``: mean size, and median location, of the passes in which a
      nodule is detected. NaN if none is detected at the site, or in no single pass.
    - ``estimate_low_mm``, ``estimate_high_mm``: mean ends of the intervals of these passes. The
      interval does not shrink with more passes, because the mean does not reduce an error that the
      nodule's set-up causes in all of them. It is rather too wide.
    """
    of_site = rows.groupby(["site", "size_mm"], sort=False, dropna=False)
    table = of_site.agg(
        recordings=("score", "size"), passes=("score", "count"), score=("score", "mean")
    )
    table = table.reset_index().assign(detector=detector)
    healthy = rows[(rows["size_mm"] == 0) & rows["score"].notna()]
    turn = healthy.groupby("site").cumcount()

    @cache
    def means(passes: int) -> pd.Series:
        return healthy[turn < passes].groupby("site")["score"].mean()

    def threshold(site: str, passes: int) -> float:
        # The healthy passes over a site that also has other passes do not teach these, either.
        others = means(passes).drop(site, errors="ignore").to_numpy()
        return rank_threshold(others, np.arange(others.size), specificity)

    fixed = detector_row(detector).fixed_threshold
    learned = [*map(threshold, table["site"], table["passes"])] if fixed is None else fixed
    table["threshold"] = learned
    detected = table["score"] > table["threshold"]
    known = table["score"].notna() & table["threshold"].notna()
    table["detected"] = detected.astype(object).where(known, None)
    of_nodule = of_site.agg(_OF_A_NODULE).reset_index(drop=True).where(detected)
    return pd.concat([table, of_nodule], axis="columns")


def detections_by_passes(
    rows: pd.DataFrame, detector: str, count: int, specificity: float
) -> pd.DataFrame:
    """Return the verdicts on labelled sites if each is judged by its first `count` passes.

    No verdict counts as nothing detected. Sites with fewer passes are left out, and all sites if no
    threshold can be learned from as many passes. For the parameters see `site_verdicts`.
    """
    of_site = rows.groupby(["site", "size_mm"])
    enough = of_site["score"].transform("size") >= count
    verdicts = site_verdicts(rows[enough & (of_site.cumcount() < count)], detector, specificity)
    if verdicts["detected"].isna().all():
        verdicts = verdicts.iloc[:0]
    return verdicts.assign(detected=verdicts["detected"].eq(True))
