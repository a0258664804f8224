"""The page itself: a template filled in, with a policy that lets nothing else run."""

import base64
import hashlib
from collections.abc import Mapping

from jinja2 import DictLoader, Environment, StrictUndefined
from markupsafe import Markup


def render_page(template: str, style: str, script: str, page: Mapping) -> str:
    """Fill in the template; every value is escaped, and an unknown name is an error.

    The page's Content-Security-Policy allows this style and this script by their checksums, images
    inside the page, and nothing else: no network, no inline handler, no foreign script, even if
    a text from a recording's header slipped through the escaping.

    Parameters
    ----------
    template : str
        The Jinja template; ``page`` holds the values, ``style``, ``script`` and ``policy`` what
        belongs to the frame.
    style, script : str
        The page's CSS and JavaScript; neither may hold the end tag of its element.
    page : mapping
        The values. ``data`` and the second parts of ``evidence`` are JSON from
        `capsule.page.evidence.to_json`, which no tag can begin in.

    Returns
    -------
    str
        The HTML page.
    """
    for name, text in (("style", style), ("script", script)):
        if f"</{name}" in text.casefold():
            raise ValueError(f"the {name} holds its own end tag and would break the page")
    environment = Environment(
        loader=DictLoader({"report": template}),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    policy = "; ".join(
        [
            "default-src 'none'",
            "img-src data:",
            f"style-src {_allowed(style)}",
            f"script-src {_allowed(script)}",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    frame = {"style": Markup(style), "script": Markup(script), "policy": Markup(policy)}
    if "evidence" in page:
        carried = [(name, Markup(content)) for name, content in page["evidence"]]
        page = {**page, "data": Markup(page["data"]), "evidence": carried}
    return environment.get_template("report").render(page=page, **frame)


def _allowed(text: str) -> str:
    """Give the source expression that allows an inline element of exactly this text."""
    digest = hashlib.sha256(text.encode("utf-8")).digest()
    return f"'sha256-{base64.b64encode(digest).decode('ascii')}'"


def image_address(svg: bytes) -> str:
    """Give an SVG file as an address that an image inside the page can have."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg).decode("ascii")
