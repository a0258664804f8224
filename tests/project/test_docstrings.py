"""Docstrings are plain English: they begin with a verb or a noun, and their sentences are short."""

import ast
import inspect
import re

import pytest

from support.project import ROOT

SCRIPTS = ROOT / "workflow" / "scripts"
MODULES = [path.relative_to(SCRIPTS).as_posix() for path in sorted(SCRIPTS.rglob("*.py"))]
# "Return whether ..." and "Return the ..." are the common forms for these beginnings.
UNCLEAR = ("Give", "Tell", "Hand", "Say", "What", "Whether", "How", "Where", "Its")
MOST_WORDS = 35
_DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
# The space after a sentence, but not after an abbreviation, as in "et al. 2019".
_END = re.compile(r"(?<=[.!?:;])\s+(?=[^a-z0-9])")


def docstrings(source):
    """Yield the name and the docstring of the module, and of each class and function in it."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, _DOCUMENTED) and (text := ast.get_docstring(node)):
            yield getattr(node, "name", "the module"), text


def paragraphs(text):
    """Return the paragraphs of a docstring; list items and indented texts are paragraphs too."""
    blocks, last = [], None
    for line in text.splitlines():
        indent = len(line) - len(line.lstrip())
        if not line.strip() or set(line.strip()) == {"-"}:
            last = None
        elif indent == last and not line.lstrip().startswith("- "):
            blocks[-1] += f" {line.strip()}"
        else:
            blocks.append(line.strip())
            last = indent
    return blocks


def long_sentences(text):
    """Return the sentences of a docstring that have too many words."""
    sentences = [part for block in paragraphs(text) for part in _END.split(block)]
    return [each for each in sentences if len(re.findall(r"\w\S*", each)) > MOST_WORDS]


@pytest.mark.parametrize("module", MODULES)
def test_docstrings_are_plain(module):
    faults = []
    for name, text in docstrings((SCRIPTS / module).read_text(encoding="utf-8")):
        if text.split()[0] in UNCLEAR:
            faults.append(f"{name} begins with {text.split()[0]!r}: {text.splitlines()[0]}")
        faults += [f"{name}: over {MOST_WORDS} words: {each}" for each in long_sentences(text)]
    assert not faults, "\n".join(faults)


def test_an_unclear_beginning_and_a_long_sentence_are_found():
    long = " ".join(["word"] * (MOST_WORDS + 1))
    source = inspect.cleandoc(
        f'''
        def f(x):
            """Give it.

            {long}.

            Parameters
            ----------
            x
                Short. {long}
                and more.
            """
        '''
    )
    ((name, text),) = docstrings(source)
    assert name == "f"
    assert text.split()[0] in UNCLEAR
    assert [each.split()[-1] for each in long_sentences(text)] == ["word.", "more."]
    short = long.removesuffix(" word").capitalize()
    assert not long_sentences(f"{short}. {short}.")
