"""Put together the values of all sections of the page from the results."""

from capsule import words
from capsule.evaluation.answers import more_recordings
from capsule.kinds import Cells
from capsule.page import (
    cards,
    cells,
    comparison,
    detector_sections,
    evidence,
    overview,
    provenance,
    recordings,
)
from capsule.page.packing import to_json
from capsule.page.tables import Tables


def page_values(tables: Tables) -> Cells:
    """Return the page's values, except the figures and the facts of this run of the workflow."""
    settings, evaluation, index = tables.settings, tables.evaluation, tables.index
    judged, lead, schemes = settings["evaluation"], tables.lead.detector, tables.schemes
    compared = comparison.page_values(evaluation.tables, schemes, settings, lead)
    listed = recordings.page_values(tables)
    data = listed["data"] | {"schemes": [each["scheme"] for each in compared["compared"]]}
    accepted = [row for row in listed["recordings"] if row["accepted"]]
    shown = cards.page_values(tables)
    # The viewer begins with the recording of the first card.
    on_cards = [name for card in shown["cards"] for name in card["names"]]
    viewed = on_cards + [row["recording"] for row in accepted]
    return {
        "archive": overview.archive_name(index),
        **overview.overview(index, tables.passed_over, tables.held_out),
        **detector_sections.page_values(tables),
        "confounded": overview.confounded_values(tables.confounded),
        **shown,
        **compared,
        "benches": comparison.bench_rows(tables.benches, [lead, *evaluation.detectors()]),
        "more": more_recordings(tables, tables.learning, lead),
        "settings": settings,
        "references": tables.references,
        "confidence": words.percent(judged["confidence"]),
        "size_confidence": words.percent(judged["size_confidence"]),
        "retest": cells.retest_rows(evaluation.tables["retest"]),
        "templates": tables.templates,
        "largest_mm": evaluation.sizes_mm()[-1],
        **listed,
        "first_shown": viewed[0] if viewed else "",
        "data": to_json(data),
        # Made while the page is written: of a large archive it takes 100 MB.
        "evidence": evidence.archive_evidence(accepted, tables),
        **provenance.page_values(tables),
    }
