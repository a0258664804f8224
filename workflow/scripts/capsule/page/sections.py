"""Put together the values of all sections of the page from the tables of results."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import pandas as pd

from capsule import words
from capsule.evaluation.lead import leading
from capsule.evaluation.paper import Evaluation
from capsule.kinds import Cells, Row, Settings
from capsule.page import (
    archive_evidence,
    benches,
    cells,
    comparison,
    confounded_table,
    detector_sections,
    methods,
    more_recordings,
    overview,
    page_data,
    patients,
    places,
    provenance,
    recordings,
    trust,
)
from capsule.page.beside import FilesBeside
from capsule.page.packing import to_json


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
        The tables of `capsule.evaluation.measures`, by name.
    learning : DataFrame
        The rates reached with parts of the archive, from `capsule.evaluation.learning`.
    benches : sequence of mapping
        The detectors' rates on other benches, from workflow/report/benches.csv.
    references : str
        workflow/report/references.bib.
    """

    index: pd.DataFrame
    passed_over: pd.DataFrame
    detections: pd.DataFrame
    sites: pd.DataFrame
    templates: Sequence[Row]
    evaluation: Evaluation
    judgements: Mapping[str, pd.DataFrame]
    learning: pd.DataFrame
    benches: Sequence[Row]
    references: str


def page_values(
    tables: Tables,
    stored: archive_evidence.Stored | FilesBeside,
    settings: Settings,
    schema: Settings,
    printed: Settings,
) -> Cells:
    """Return the page's values, except the figures and the facts of this run of the workflow.

    Parameters
    ----------
    tables : Tables
        The tables.
    stored : Stored or FilesBeside
        The stored results of the accepted recordings, or the files beside the page that hold them.
    settings, schema : mapping
        The configuration and its JSON Schema.
    printed : mapping
        Content of paper.yaml.

    Returns
    -------
    dict
    """
    judged, evaluation = settings["evaluation"], tables.evaluation
    rates = detector_sections.Rates(evaluation, tables.judgements, tables.index, settings)
    schemes = rates.schemes
    verdicts = recordings.verdicts_by_recording(evaluation.predictions, tables.detections)
    lead = leading(
        evaluation.predictions, settings["detectors"], judged["schemes"], settings["report"]["lead"]
    )
    detectors = detector_sections.lead_first(evaluation.detectors(), lead)
    listed = recordings.page_values(tables.index, verdicts, lead.detector, schemes, judged)
    largest_mm, origin = evaluation.sizes_mm()[-1], overview.labelled_origin(tables.index)
    told = patients.page_values(
        tables.index,
        tables.detections,
        tables.sites,
        lead.detector,
        stored.quality,
        largest_mm,
    )
    of_detectors = detector_sections.page_values(rates, lead, printed["sizing_tolerance_mm"])
    beside, inside = None, []
    if isinstance(stored, FilesBeside):
        beside = {"folder": stored.folder, "files": stored.files, "each": stored.each}
    else:
        accepted = archive_evidence.accepted_rows(listed["recordings"])
        sizes_mm = evaluation.sizes_mm()
        evidence = archive_evidence.archive_evidence(accepted, verdicts, sizes_mm, stored, settings)
        inside = [(each.name, each.joined()) for each in evidence]
    return {
        **overview.overview(tables.index, tables.passed_over, rates.held_out),
        **of_detectors,
        "confounded": confounded_table.page_values(rates.confounded),
        "patients": told,
        "trust": of_detectors["trust"]
        if rates.confounded
        else trust.of_rows(
            [*told["rows"], *told["folded"]],
            of_detectors["trust"],
            tables.judgements["retest"].query("detector == @lead.detector"),
            schemes,
            judged,
            origin,
        ),
        **comparison.page_values(tables.judgements, schemes, settings, lead.detector),
        **benches.page_values(tables.benches, detectors, origin),
        **more_recordings.page_values(rates, tables.learning),
        "methods": methods.methods_sentences(rates, lead, printed["equations"]),
        "references": tables.references,
        "confidence": words.percent(judged["confidence"]),
        "size_confidence": words.percent(judged["size_confidence"]),
        "places": places.place_rows(tables.sites, largest_mm),
        "retest": places.retest_rows(tables.judgements["retest"]),
        "templates": cells.template_rows(tables.templates),
        "detections": cells.detection_rows(tables.detections, largest_mm),
        **listed,
        "data": to_json(
            page_data.page_data(
                listed["recordings"],
                verdicts,
                detectors,
                evaluation.sizes_mm(),
                schemes,
                judged["tolerance_mm"],
            )
            | {"beside": beside}
        ),
        "beside": beside,
        "evidence": inside,
        **provenance.page_values(listed["recordings"], settings, schema, printed),
    }
