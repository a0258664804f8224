"""Render the HTML page from its templates, with a policy that blocks all foreign code."""

import base64
import hashlib
from collections.abc import Iterator, Mapping

from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup

from capsule import words
from capsule.kinds import Row


def environment(templates: Mapping[str, str]) -> Environment:
    """Return what renders templates: it escapes every value, and refuses unknown names.

    The templates see `capsule.words` as ``words``, to write values in words.
    """
    made = Environment(
        loader=DictLoader(templates),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.globals["words"] = words
    return made


def render_page(templates: Mapping[str, str], style: str, script: str, page: Row) -> Iterator[str]:
    """Return the parts of the HTML page, which a large page is written by.

    Style and script may not contain the end tag of their element; the templates are by name.
    Every value is escaped, and an unknown name in a template is an error. Values that the templates
    take as they are, are JSON from `capsule.page.packing.to_json`, in which no tag can begin.

    The page's Content-Security-Policy allows this style and this script by their checksums, and
    images inside the page. It forbids all else: network, inline handlers and foreign scripts. It
    also protects if a text from a recording's header slips through the escaping.
    """
    for name, text in (("style", style), ("script", script)):
        if f"</{name}" in text.casefold():
            raise ValueError(f"the {name} holds its own end tag and would break the page")
    policy = [
        "default-src 'none'",
        "img-src data:",
        f"style-src {_allowed(style)}",
        f"script-src {_allowed(script)}",
        "base-uri 'none'",
        "form-action 'none'",
    ]
    template = environment(templates).get_template("report.html.j2")
    return template.generate(
        page=page,
        style=Markup(style),
        script=Markup(script),
        policy=Markup("; ".join(policy)),
    )


def _allowed(text: str) -> str:
    """Return the policy's source expression that allows an inline element with this text."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"
