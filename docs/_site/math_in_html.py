r"""Equations as MathML, which browsers draw themselves: no script, no font, no network.

An equation's number is that of its ``\tag``; it stands at the right and can be linked to, as
``#equation-2``.
"""

import re

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

_TAG = re.compile(r"\\tag\{(.+?)\}")
# A line that begins with % is a comment: the equation's label in the paper's source.
_COMMENT = re.compile(r"^\s*%.*\n", re.MULTILINE)
# A prime is drawn high already: as an exponent it would be too small to see.
_PRIMED = re.compile(r"<msup>(<mi[^>]*>[^<]*</mi>)<mi[^>]*>&#x02032;</mi></msup>")


def drawn(source: str, display: str) -> str:
    """Give an equation as MathML."""
    prime = r'<mrow>\1<mo lspace="0" rspace="0">&#x02032;</mo></mrow>'
    return _PRIMED.sub(prime, convert(source, display=display))


def draw_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write an equation within a line."""
    translator.body.append(drawn(node.astext(), "inline"))
    raise nodes.SkipNode


def draw_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write an equation on lines of its own, with its number."""
    source = node.astext() + "\n"
    number = _TAG.search(source)
    equation = drawn(_TAG.sub("", _COMMENT.sub("", source)).strip(), "block")
    name = f' id="equation-{number[1]}"' if number else ""
    label = f'<span class="eqno">({number[1]})</span>' if number else ""
    translator.body.append(f'<div class="math"{name}>{label}{equation}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""
    app.add_html_math_renderer("mathml", (draw_inline, None), (draw_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
