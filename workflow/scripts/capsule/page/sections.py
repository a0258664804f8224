"""Put together the values of all sections of the page from the tables of results."""

from capsule import words
from capsule.evaluation.lead import leading
from capsule.evaluation.more_recordings import more_recordings
from capsule.kinds import Cells, Settings
from capsule.page import (
    cards,
    cells,
    comparison,
    detector_sections,
    evidence,
    first_screen,
    overview,
    provenance,
    recordings,
)
from capsule.page.packing import to_json
from capsule.page.quality_map import quality_cells
from capsule.page.tables import Tables


def page_values(
    tables: Tables,
    stored: evidence.StoredRecordings,
    schema: Settings,
    printed: Settings,
) -> Cells:
    """Return the page's values, except the figures and the facts of this run of the workflow."""
    settings, evaluation = tables.settings, tables.evaluation
    judged, index = settings["evaluation"], tables.index
    schemes, sizes_mm = tables.schemes, evaluation.sizes_mm()
    verdicts = recordings.verdicts_of(evaluation.predictions, tables.detections, schemes)
    lead = leading(
        evaluation.tables["summary"],
        settings["detectors"],
        judged["schemes"],
        settings["report"]["lead"],
    )
    detectors = list(dict.fromkeys([lead.detector, *evaluation.detectors()]))
    compared = comparison.page_values(evaluation.tables, schemes, settings, lead.detector)
    listed = recordings.page_values(
        index,
        verdicts,
        detectors,
        sizes_mm,
        [each["scheme"] for each in compared["compared"]],
        judged["tolerance_mm"],
        quality_cells(stored.described),
    )
    rows = listed["recordings"]
    of_detectors = detector_sections.page_values(tables, lead)
    ours = of_detectors["ours"]
    shown = cards.page_values(tables, lead.detector, schemes[0], stored.described, stored.felt)
    accepted = [row for row in rows if row["accepted"]]
    # The viewer begins with the recording of the first card.
    on_cards = [name for card in shown["cards"] for name in card["names"]]
    viewed = on_cards + [row["recording"] for row in accepted]
    return {
        "archive": overview.archive_name(index),
        **overview.overview(index, tables.passed_over, tables.held_out),
        **of_detectors,
        "confounded": overview.confounded_values(tables.confounded),
        **shown,
        "first": first_screen.page_values(tables, ours, lead),
        **first_screen.meaning_values(ours, judged["prevalence"]),
        **compared,
        **comparison.bench_values(tables.benches, detectors),
        "more": more_recordings(tables, tables.learning, lead.detector),
        "methods": detector_sections.methods_values(tables, ours),
        "settings": settings,
        "references": tables.references,
        "confidence": words.percent(judged["confidence"]),
        "size_confidence": words.percent(judged["size_confidence"]),
        "retest": cells.retest_rows(evaluation.tables["retest"]),
        "templates": tables.templates,
        "largest_mm": sizes_mm[-1],
        **listed,
        "first_shown": viewed[0] if viewed else "",
        "data": to_json(listed["data"]),
        # Made while the page is written: of a large archive it takes 100 MB.
        "evidence": evidence.archive_evidence(
            accepted, verdicts, tables.templates, stored, settings
        ),
        **provenance.page_values(rows, settings, schema, printed),
    }
