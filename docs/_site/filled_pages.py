"""What a page takes from the code when the site is built, in the place of a comment.

| comment in the page | what the site shows there |
|---|---|
| ``<!-- filled: configuration -->`` | config/README.md, which a test holds to the schema |
| ``<!-- filled: options -->`` | what each command prints for ``--help`` |
| ``<!-- filled: contents -->`` | the site's contents, from the lines of links on its first page |
| ``<!-- filled: public names -->`` | the names that ``import capsule`` offers |
| ``<!-- filled: keys of lab.yaml -->`` | the keys of its schema |
| ``<!-- filled: modules of capsule.NAME -->`` | the modules of a package, by their docstrings |

What stands between ``<!-- source -->`` and ``<!-- /source -->`` is for readers of the source alone.
"""

import json
import os
import re
from collections.abc import Callable
from inspect import unwrap
from pathlib import Path
from unittest import mock

import study_phantom
import teach_scorer
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

import capsule
from capsule.commands.cli import COMMANDS, build_parser, subparsers
from capsule.engine.configuration import allowed_values

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "workflow" / "scripts"
# Programs for people that are no subcommands of `capsule`.
STUDIES = (study_phantom, teach_scorer)
BOARDS = ("logger", "peristalsis", "fold")
_FILLED = re.compile(r"<!-- filled: (.+?) -->")
_SOURCE_ALONE = re.compile(r"<!-- source -->.*?<!-- /source -->\n?", re.DOTALL)
# A caption of the contents with its pages, as "**The bench**: [The bench](bench.md) · ...".
_CAPTION = re.compile(r"^\*\*([^*]+)\*\*: (\[.+?)\n\n", re.MULTILINE | re.DOTALL)
_PAGE = re.compile(r"\]\((\S+)\.md\)")
_STUDY = re.compile(r"\]\((\.\./workflow/[^)]+\.md)\)")
# Where a page links to a file of the project that has a page of its own in the site.
_PAGES = {"../README.md": "index.md", "../config/README.md": "configuration.md"}


def contents() -> str:
    """Give the contents of the site, which its first page lists for its readers."""
    text = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    lists = []
    for caption, links in _CAPTION.findall(text):
        pages = "\n".join(_PAGE.findall(links))
        lists.append(f"```{{toctree}}\n:hidden:\n:caption: {caption}\n\n{pages}\n```")
    return "\n".join(lists)


def configuration() -> str:
    """Give the page on the configuration, with links as they are from docs/.

    Its table stands in three columns: five are wider than a page. A unit of 1 goes without saying.
    """
    text = (ROOT / "config" / "README.md").read_text(encoding="utf-8")
    text = re.sub(
        r"^\| (.+?) \| (.*?) ?\| (.*?) ?\| (.+?) \| (.+) \|$",
        lambda row: f"| {row[1]} {row[2]} | {row[4]} {row[3].strip('1')} | {row[5]} |",
        text.replace("|---|---|---|---|---|", "|---|---|---|"),
        flags=re.MULTILINE,
    )
    text = re.sub(r"\((workflow/studies/\S+\.md)\)", r"([measured](../\1))", text)
    return text.partition("\n")[2].replace("](../docs/", "](")


def options() -> str:
    """Give what each command prints for --help."""
    parts = []
    with mock.patch.dict(os.environ, {"COLUMNS": "90"}):
        for word, parser in subparsers(build_parser(tuple(COMMANDS))).items():
            parts += [f"## capsule {word}", _as_text(parser.format_help())]
        for study in STUDIES:
            parser = study.build_parser()
            parser.prog = f"{study.__name__}.py"
            parts += [f"## {parser.prog}", _as_text(parser.format_help())]
    return "\n\n".join(parts)


def lab_keys() -> str:
    """Give the keys of lab.yaml as a table, from their schema."""
    keys = json.loads((ROOT / "workflow/schemas/lab.schema.json").read_text("utf-8"))["properties"]
    rows = ["| key, option | allowed | unit | meaning |", "|---|---|---|---|"]
    for key, part in keys.items():
        named = f"`{key}`, `--{key.replace('_', '-')}`"
        cells = [named, allowed_values(part, keys), part.get("unit", ""), part["description"]]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def library() -> str:
    """Give the entries of all public names."""
    entries: dict[str, list[str]] = {"Functions": [], "Classes": [], "Errors": []}
    for name in dir(capsule):
        if name.endswith("Error"):
            entries["Errors"] += [f".. autoexception:: capsule.{name}", ""]
        elif name[0].isupper():
            entries["Classes"] += [f".. autoclass:: capsule.{name}", "   :members:", ""]
        else:
            entries["Functions"] += [f".. autofunction:: capsule.{name}", ""]
    parts = [f"## {title}\n\n{_as_directives(lines)}" for title, lines in entries.items()]
    return "\n\n".join(parts)


def modules(package: str) -> str:
    """Give the entries of all modules of a package, without those of packages in it."""
    folder = SCRIPTS.joinpath(*package.split("."))
    parts = []
    for path in sorted(folder.glob("*.py")):
        if path.stem not in ("__init__", "__main__"):
            module = f"{package}.{path.stem}"
            public = _public_of(module)
            lines = [f".. automodule:: {module}", "   :members:"]
            lines += [f"   :exclude-members: {', '.join(public)}"] if public else []
            lines += ["", *(f"Offered as :py:obj:`capsule.{name}`.\n" for name in public)]
            parts += [f"## {module}", _as_directives(lines)]
    return "\n\n".join(parts)


def _public_of(module: str) -> list[str]:
    """List what stands on the page of public names, and so not on that of its module."""
    return [name for name in dir(capsule) if unwrap(getattr(capsule, name)).__module__ == module]


def _escaped(line: str) -> str:
    """Put a backslash before each bar outside backticks."""
    parts = line.split("`")
    return "`".join(
        [part.replace("|", "\\|") if i % 2 == 0 else part for i, part in enumerate(parts)]
    )


def _as_text(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```"


def _as_directives(lines: list[str]) -> str:
    return "\n".join(["```{eval-rst}", *lines, "```"])


_FILLINGS: dict[str, Callable[[], str]] = {
    "configuration": configuration,
    "contents": contents,
    "keys of lab.yaml": lab_keys,
    "options": options,
    "public names": library,
}


def filled(text: str) -> str:
    """Fill a page, and lead its links to the site's own pages."""

    def filling(comment: re.Match[str]) -> str:
        what = comment[1]
        return modules(what.split()[-1]) if what.startswith("modules of ") else _FILLINGS[what]()

    text = _FILLED.sub(filling, _SOURCE_ALONE.sub("", text))
    for file, page in _PAGES.items():
        text = text.replace(f"]({file}", f"]({page}")
    # The studies are no pages of the site; it offers them as files.
    return _STUDY.sub(r"](path:\1)", text)


def setup(app: Sphinx) -> dict[str, bool]:
    """Tell Sphinx."""

    def fill(app: Sphinx, page: str, source: list[str]) -> None:
        source[0] = filled(source[0])

    def escape(app: Sphinx, kind: str, name: str, of: object, how: object, text: list[str]) -> None:
        """Let |x| be a magnitude; in a docstring's markup it would be a name to replace."""
        text[:] = [_escaped(line) for line in text]

    def stale(app: Sphinx, env: BuildEnvironment, *_: object) -> list[str]:
        """Return the pages whose content stands elsewhere: their own files do not change."""
        return [
            page
            for page in env.found_docs
            if _FILLED.search(Path(env.doc2path(page)).read_text(encoding="utf-8"))
        ]

    app.connect("source-read", fill)
    app.connect("env-get-outdated", stale)
    # Before napoleon takes the docstring apart.
    app.connect("autodoc-process-docstring", escape, priority=400)
    # Examples of what the boards say, marked by the board.
    for board in BOARDS:
        app.add_lexer(board, TextLexer)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
