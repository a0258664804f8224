"""Type names for values that come from files: settings, and rows of result tables.

The types are wide, because the content of a file is known only after it is read. This module
imports nothing heavy, because the Snakefile checks the configuration at every start.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

#: A part of config.yaml, of its schema, or of the paper's printed tables, by name.
Settings: TypeAlias = Mapping[str, Any]

#: A row of a table, by column: text, a number, or nothing.
Row: TypeAlias = Mapping[str, Any]

#: Keywords for matplotlib: the look of a line, a mark or an area.
Look: TypeAlias = Mapping[str, Any]

#: A row that is being made, or the values that the report's template reads, by name.
Cells: TypeAlias = dict[str, Any]
