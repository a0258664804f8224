"""Put together the values of all sections of the page from the tables of results."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial

import pandas as pd

from capsule import words
from capsule.evaluation.lead import leading
from capsule.kinds import Cells, Row, Settings
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
from capsule.page.packing import deflated, inflated, to_json
from capsule.page.rates import Rates

# Writes the two texts of each accepted recording, and returns what the page says of the files.
WriteBeside = Callable[[Sequence[Row], Callable[[Iterable[Row]], Iterable[tuple[str, str]]]], Cells]


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
    write: WriteBeside | None = None,
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
    write : callable, optional
        `capsule.page.beside.write_beside` with its folder: what the page draws goes there.
    """
    settings, evaluation = tables.settings, tables.evaluation
    judged, index = settings["evaluation"], tables.index
    schemes, sizes_mm = tables.schemes, evaluation.sizes_mm()
    verdicts = recordings.all_verdicts(evaluation.predictions, tables.detections)
    lead = leading(
        evaluation.predictions, settings["detectors"], judged["schemes"], settings["report"]["lead"]
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
    accepted = [row for row in rows if row["accepted"]]
    texts = partial(
        evidence.archive_evidence,
        verdicts=evidence.verdicts_by_recording(evaluation.predictions, tables.detections),
        sizes_mm=sizes_mm,
        stored=stored,
        settings=settings,
    )
    beside, inside = None, []
    if write:
        beside = write(accepted, lambda some: ((a, deflated(b)) for a, b in texts(some)))
    else:
        # Both parts as one JSON object.
        joined = (f"{inflated(alone)[:-1]},{others[1:]}" for alone, others in texts(accepted))
        inside = [(row["recording"], text) for row, text in zip(accepted, joined, strict=True)]
    return {
        **overview.overview(index, tables.passed_over, tables.held_out),
        **of_detectors,
        "confounded": overview.confounded_values(tables.confounded),
        "patients": told,
        "single_passes": not all(row["site"] for row in listed_patients),
        "together": patients.together_values(
            listed_patients,
            tables.judgements["retest"].query("detector == @lead.detector"),
            schemes,
            judged["confidence"],
        ),
        **comparison.page_values(tables.judgements, schemes, settings, lead.detector),
        **comparison.bench_values(tables.benches, detectors),
        **more_recordings.page_values(tables, tables.learning),
        "methods": detector_sections.methods_values(tables, lead, of_detectors["ours"]),
        "settings": settings,
        "references": tables.references,
        "confidence": words.percent(judged["confidence"]),
        "size_confidence": words.percent(judged["size_confidence"]),
        "places": cells.place_rows(tables.sites, largest_mm),
        "retest": cells.retest_rows(tables.judgements["retest"]),
        "templates": tables.templates,
        "detections": cells.detection_rows(tables.detections),
        "largest_mm": largest_mm,
        **listed,
        "data": to_json(listed["data"] | {"beside": beside}),
        "beside": beside,
        "evidence": inside,
        **provenance.page_values(rows, settings, schema, printed),
    }
