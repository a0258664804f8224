"""Render single sections of the page, for tests of their words."""

import html

from capsule.page.files import read_frame
from capsule.page.render import environment
from support.project import ROOT


def section(name, **page):
    """Return a section as the browser shows its texts, with its tags."""
    templates = read_frame(ROOT / "workflow" / "report").templates
    template = environment(templates).get_template(f"sections/{name}.html.j2")
    return html.unescape(template.render(page=page))
