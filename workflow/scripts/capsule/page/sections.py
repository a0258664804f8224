"""Put together the values of all sections of the page from the tables of results."""

from collections.abc import Sequence
from dataclasses import dataclass

import pandas as pd

from capsule import words
from capsule.evaluation.lead import leading
from capsule.kinds import Cells, Row, Settings, Spread
from capsule.page import (
    cells,
    comparison,
    detector_sections,
    evidence,
    more_recordings,
    overview,
    patients,
    provenance,
    recordings,
)
from capsule.page.packing import to_json
from capsule.page.rates import Rates


@dataclass(frozen=True)
class Tables(Rates):
    """The tables of results that the page shows, besides the rates.

    Attributes
    ----------
    passed_over, detections, sites : DataFrame
        results/passed_over.csv, detections.csv and sites.csv.
    templates : sequence of mapping
        Those of results/templates.json.
    learning : DataFrame
        The rates reached with parts of the archive, from `capsule.evaluation.learning`.
    benches : sequence of mapping
        The detectors' rates on other benches, from workflow/report/benches.csv.
    references : str
        workflow/report/references.bib.
    """

    passed_over: pd.DataFrame
    detections: pd.DataFrame
    sites: pd.DataFrame
    templates: Sequence[Row]
    learning: pd.DataFrame
    benches: Sequence[Row]
    references: str


def page_values(
    tables: Tables,
    stored: evidence.StoredRecordings,
    schema: Settings,
    printed: Settings,
    spread: Spread = map,
) -> Cells:
    """Return the page's values, except the figures and the facts of this run of the workflow.

    Parameters
    ----------
    tables : Tables
        The tables.
    stored : StoredRecordings
        The stored results of the accepted recordings.
    schema : mapping
        The JSON Schema of the configuration.
    printed : mapping
        Content of paper.yaml.
    spread : callable
        As in `capsule.page.evidence.archive_evidence`.
    """
    settings, evaluation = tables.settings, tables.evaluation
    judged, index = settings["evaluation"], tables.index
    schemes, sizes_mm = tables.schemes, evaluation.sizes_mm()
    verdicts = recordings.all_verdicts(evaluation.predictions, tables.detections)
    lead = leading(
        evaluation.tables["summary"],
        settings["detectors"],
        judged["schemes"],
        settings["report"]["lead"],
    )
    detectors = detector_sections.lead_first(evaluation.detectors(), lead)
    listed = recordings.page_values(
        index, verdicts, detectors, sizes_mm, schemes, judged["tolerance_mm"]
    )
    rows = listed["recordings"]
    largest_mm = sizes_mm[-1]
    told = patients.page_values(
        index, tables.detections, tables.sites, lead.detector, stored.qualities, largest_mm
    )
    listed_patients = [*told["rows"], *told["folded"]]
    of_detectors = detector_sections.page_values(tables, lead, printed["sizing_tolerance_mm"])
    said = evidence.verdicts_by_recording(evaluation.predictions, tables.detections)
    accepted = [row for row in rows if row["accepted"]]
    return {
        **overview.overview(index, tables.passed_over, tables.held_out),
        **of_detectors,
        "confounded": overview.confounded_values(tables.confounded),
        "patients": told,
        "single_passes": not all(row["site"] for row in listed_patients),
        "together": patients.together_values(
            listed_patients,
            evaluation.tables["retest"].query("detector == @lead.detector"),
            schemes,
            judged["confidence"],
        ),
        **comparison.page_values(evaluation.tables, schemes, settings, lead.detector),
        **comparison.bench_values(tables.benches, detectors),
        **more_recordings.page_values(tables, tables.learning),
        "methods": detector_sections.methods_values(tables, of_detectors["ours"]),
        "settings": settings,
        "references": tables.references,
        "confidence": words.percent(judged["confidence"]),
        "size_confidence": words.percent(judged["size_confidence"]),
        "sites": tables.sites,
        "retest": cells.retest_rows(evaluation.tables["retest"]),
        "templates": tables.templates,
        "detections": tables.detections,
        "largest_mm": largest_mm,
        "detectors": detectors,
        "schemes": schemes,
        **listed,
        "data": to_json(listed["data"]),
        # Made while the page is written: of a large archive it takes 100 MB.
        "evidence": evidence.archive_evidence(accepted, said, largest_mm, stored, settings, spread),
        **provenance.page_values(rows, settings, schema, printed),
    }
