"""The whole evaluation of an archive: every detector under every scheme, as tables."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from capsule.detectors.training import TrainingArchive
from capsule.evaluation import learning, rates
from capsule.evaluation.all_tables import all_tables
from capsule.evaluation.columns import COLUMNS
from capsule.evaluation.folds import group_folds, scheme_folds
from capsule.evaluation.predictions import Detectors, by_folds
from capsule.evaluation.rows import as_text, by_detector, number
from capsule.kinds import Row, Settings, Spread
from capsule.naming import sizes_of, sort_key


class Table(NamedTuple):
    """A table that is ready to be written.

    Attributes
    ----------
    columns : sequence of str
    rows : sequence of mapping
        The rows; each holds all columns.
    """

    columns: Sequence[str]
    rows: Sequence[Row]


def evaluate_archive(
    archive: TrainingArchive, index: Mapping[str, Mapping[str, str]], spread: Spread = map
) -> dict[str, Table]:
    """Return all tables of the evaluation of an archive.

    Parameters
    ----------
    archive : TrainingArchive
        As in `capsule.evaluation.predictions.Detectors`.
    index : mapping of str to mapping
        Row in results/recordings.csv of each accepted labelled recording, ordered by content.
    spread : callable
        As in `capsule.evaluation.predictions.by_folds`.

    Returns
    -------
    dict of str to Table
        ``predictions``, ``group_predictions``, ``learning`` and the tables of rates, as in
        results/evaluation/.
    """
    rules, detectors = archive.settings["evaluation"], Detectors(archive)
    sizes_mm = sizes_of(index)
    schemes = scheme_folds(rules["schemes"], index, rules["most_folds"])
    groups = [group_folds(key, index, rules["most_folds"]) for key in rules["groups"]]
    rows = by_folds(detectors, sizes_mm, [*schemes, *filter(None, groups)], spread)
    made = [row for row in rows if row["scheme"] in rules["schemes"]]
    grouped = [row for row in rows if row["scheme"] not in rules["schemes"]]
    columns = prediction_columns(detectors.columns)
    learned = learning.learning_rows(detectors.learners(), archive, made, spread)
    return {
        "predictions": Table(columns, by_detector(made, sort_key)),
        "group_predictions": Table(columns, by_detector(grouped, sort_key)),
        "learning": Table(learning.COLUMNS, learned),
        **rate_tables(made, archive.templates.sizes_mm, rules),
    }


def prediction_columns(columns: Iterable[str]) -> list[str]:
    """Return the columns of a prediction: recording, detector and scheme, then the verdict's."""
    return ["recording", "size_mm", "detector", "scheme", *columns]


def rate_tables(
    predictions: Sequence[Row], sizes_mm: Sequence[float], rules: Settings
) -> dict[str, Table]:
    """Return the tables of rates; `rules` is the section ``evaluation`` of the configuration."""
    counted = {key: rules[key] for key in ("schemes", "tolerance_mm", "confidence")}
    made = rates.tables(predictions, sizes_mm, **counted)
    return {name: Table(rates.COLUMNS[name], rows) for name, rows in made.items()}


def rate_detectors(
    predictions: Iterable[Sequence[Row]],
    index: Mapping[str, Mapping[str, str]],
    settings: Settings,
    spread: Spread = map,
) -> dict[str, Table]:
    """Return the tables that rate the detectors, made from their predictions.

    Parameters
    ----------
    predictions : iterable of sequence of mapping
        The rows of ``predictions`` and of ``group_predictions``, from `evaluate_archive`.
    index : mapping of str to mapping
        As in `evaluate_archive`.
    settings : mapping
        Section ``evaluation`` of the configuration.
    spread : callable
        As in `capsule.evaluation.all_tables.all_tables`.

    Returns
    -------
    dict of str to Table
        The tables of `capsule.evaluation.columns.COLUMNS`.
    """
    turn = {name: place for place, name in enumerate(index)}
    sites = {name: row["site"] for name, row in index.items()}
    nodule_at_mm = {name: number(row["nodule_at_mm"]) for name, row in index.items()}
    rows = [row for each in predictions for row in by_detector(as_text(each), turn.__getitem__)]
    made = all_tables(rows, sites, nodule_at_mm, settings, spread)
    return {
        name: Table(list(each[0]) if each else COLUMNS[name], each) for name, each in made.items()
    }
