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


def draw_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write an equation within a line."""
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def draw_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write an equation on lines of its own, with its number."""
    source = node.astext() + "\n"
    number = _TAG.search(source)
    drawn = convert(_TAG.sub("", _COMMENT.sub("", source)).strip(), display="block")
    name = f' id="equation-{number[1]}"' if number else ""
    label = f'<span class="eqno">({number[1]})</span>' if number else ""
    translator.body.append(f'<div class="math"{name}>{label}{drawn}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""
    app.add_html_math_renderer("mathml", (draw_inline, None), (draw_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
