"""What the page says, put together from the tables of results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule.evaluation.beside_paper import Evaluation
from capsule.page import cells, comparison, detector_sections, overview, places, provenance


@dataclass(frozen=True)
class Tables:
    """The tables of results that the page shows.

    Attributes
    ----------
    index, passed_over, detections, sites : DataFrame
        results/recordings.csv, passed_over.csv, detections.csv and sites.csv.
    templates : sequence of mapping
        Those of results/templates.json.
    evaluation : Evaluation
        The rates, ours and the paper's.
    judgements : mapping of str to DataFrame
        The tables of `capsule.evaluation.tables`, by name.
    """

    index: pd.DataFrame
    passed_over: pd.DataFrame
    detections: pd.DataFrame
    sites: pd.DataFrame
    templates: Sequence[Mapping]
    evaluation: Evaluation
    judgements: Mapping[str, pd.DataFrame]


def page_values(
    found: Tables,
    verdicts: Mapping[str, list[dict]],
    settings: Mapping,
    schema: Mapping,
    printed: Mapping,
) -> dict:
    """Give the page's values, but for figures, signals, and how it was made.

    Parameters
    ----------
    found : Tables
        The tables.
    verdicts : mapping of str to list of dict
        From `capsule.page.recordings.verdicts_by_recording`.
    settings, schema : mapping
        The configuration and its JSON Schema.
    printed : mapping
        Content of paper.yaml.

    Returns
    -------
    dict
    """
    configuration = provenance.configuration_table(settings, schema, printed["settings"])
    return {
        **overview.overview(found.index, found.passed_over),
        **detector_sections.judgement(found.evaluation, found.index, verdicts, settings, printed),
        **comparison.page_values(found.judgements, settings),
        "places": places.place_rows(found.sites),
        "retest": places.retest_rows(found.judgements["retest"]),
        "templates": cells.template_rows(found.templates),
        "detections": cells.detection_rows(found.detections),
        "configuration": configuration,
        "differences": provenance.differences(configuration),
    }
