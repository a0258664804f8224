"""How the manual is built: `make docs`, or `python -m sphinx -W docs build/site`."""

import sys
import tomllib
from pathlib import Path

from matplotlib import get_data_path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
CODE = [ROOT / "workflow" / "scripts", ROOT / "workflow" / "studies"]
sys.path[:0] = map(str, [HERE / "_site", *CODE])

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

project = "Origami capsule"
author = "the maintainers of the origami capsule"
version = release = PROJECT["version"]

extensions = [
    "myst_parser",  # pages in Markdown
    "sphinx.ext.autodoc",  # the library's reference from its docstrings
    "sphinx.ext.napoleon",  # ... which are in numpydoc's style
    "math_in_html",  # equations without a script or a network
    "filled_pages",  # what pages take from the code: options, modules, configuration
]
exclude_patterns = ["_site", "examples"]

# A heading of these levels can be linked to, as on the pages' host: page.md#its-words.
myst_heading_anchors = 4
# Equations stand in blocks that begin with ```math.
myst_fence_as_directive = ["math"]
# ... and between dollars within a line.
myst_enable_extensions = ["dollarmath"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings name types, shapes and units
# scikit-learn makes these methods, with references into its own manual.
autodoc_default_options = {"exclude-members": "set_fit_request"}
napoleon_google_docstring = False
toc_object_entries = False  # a page's contents are its headings; a quarter of the build's time
napoleon_use_ivar = True
default_role = "literal"
# Attributes of several classes may share a name.
suppress_warnings = ["ref.python"]

html_theme = "furo"
html_title = f"Origami capsule {release}"
# matplotlib brings the font along.
html_static_path = ["_site/equations.css", f"{get_data_path()}/fonts/ttf/DejaVuSerif.ttf"]
html_css_files = ["equations.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False  # no licence has been chosen
html_math_renderer = "mathml"
