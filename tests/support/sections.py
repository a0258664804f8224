"""Put together and render sections of the page, for tests of what they say."""

import functools
import html

import numpy as np
import pandas as pd
import yaml

from capsule.evaluation import columns, learning
from capsule.page import sections
from capsule.page.files import read_frame
from capsule.page.render import environment
from capsule.page.tables import Tables
from capsule.store import files
from support.evaluated import index_of, read_paper
from support.project import ROOT
from support.stored import Described

REPORT = ROOT / "workflow" / "report"
CONFIG = yaml.safe_load((ROOT / "config/config.yaml").read_text(encoding="utf-8"))
SCHEMA = files.read_json(ROOT / "workflow/schemas/config.schema.json")


def page_of(evaluation, *rows, settings=CONFIG):
    """Return what the page says of an evaluation and of recordings without signals.

    The rows are those of `support.evaluated.index_of`.
    """
    tables = Tables(
        index=index_of(*rows),
        settings=settings,
        passed_over=pd.DataFrame(columns=["path", "reason"]),
        detections=pd.DataFrame(columns=["recording", "detector", "predicted_mm", "rmse_0mm"]),
        sites=pd.DataFrame(columns=columns.SITES),
        templates=[],
        evaluation=evaluation,
        learning=pd.DataFrame(columns=learning.COLUMNS),
        benches=files.read_csv(REPORT / "benches.csv"),
        references=(REPORT / "references.bib").read_text(encoding="utf-8"),
        printed=read_paper(),
        schema=SCHEMA,
        described=Described(),
        fits={},
        matrix=lambda name: np.zeros((4, settings["preprocessing"]["length"])),
    )
    page = sections.page_values(tables)
    # The page takes them once, while it is written; a test looks at them several times.
    return page | {"evidence": list(page["evidence"])}


@functools.cache
def compiled():
    """Return what fills in templates; it is kept, since compiling takes long."""
    return environment(read_frame(REPORT)[0])


def section(name, **page):
    """Return a section as the browser shows its texts, with its tags."""
    # The frame imports the macros for all sections.
    frame = compiled().loader.mapping["report.html.j2"].splitlines()
    imports = [line for line in frame if line.startswith("{% from ")]
    text = "\n".join([*imports, f'{{% include "sections/{name}.html.j2" %}}'])
    return html.unescape(compiled().from_string(text).render(page=page))
