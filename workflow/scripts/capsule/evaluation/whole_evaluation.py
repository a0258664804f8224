"""The whole evaluation of an archive: every detector under every scheme, as tables."""

import numpy as np
import pandas as pd

from capsule.detectors.base import TrainingArchive
from capsule.evaluation import learning
from capsule.evaluation.cross_validation import Detectors, Rows, cross_validate, folds_of
from capsule.evaluation.measures import measure_tables
from capsule.kinds import Spread
from capsule.names import sort_key

# The columns of a prediction that the verdict's follow.
KEY = ["recording", "size_mm", "detector", "scheme"]


def evaluate_archive(
    archive: TrainingArchive, index: Rows, spread: Spread = map
) -> dict[str, pd.DataFrame]:
    """Return all tables of the evaluation of an archive, as in results/evaluation/.

    They are ``predictions``, ``learning`` and those of `measure_tables`.

    Parameters
    ----------
    archive, spread
        As in `capsule.evaluation.cross_validation.Detectors` and `cross_validate`.
    index : mapping of str to mapping
        Row in results/recordings.csv of each accepted labelled recording, ordered by content.
    """
    rules, detectors = archive.settings["evaluation"], Detectors(archive)
    folds = folds_of(index, rules)
    rows = cross_validate(detectors, folds, spread)
    predictions = pd.DataFrame(rows, columns=[*KEY, *detectors.columns])
    learned = learning.learning_rows(detectors.learners(), archive, predictions, folds, spread)
    return {
        "predictions": by_name(predictions),
        "learning": pd.DataFrame(learned, columns=learning.COLUMNS),
        **measure_tables(predictions, archive.templates.sizes_mm, rules, index),
    }


def by_name(predictions: pd.DataFrame) -> pd.DataFrame:
    """Return predictions sorted by detector (in order of appearance), then by recording."""
    names = sorted(set(predictions["recording"]), key=sort_key)
    turn = predictions["recording"].map({name: number for number, name in enumerate(names)})
    return predictions.iloc[np.lexsort((turn, pd.factorize(predictions["detector"])[0]))]
