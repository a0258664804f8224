"""Names of the kinds of values that come from files: a settings table, a row of a result table.

What a configuration file or a table holds is known only once it is read, so the values have no
narrower type here. Imports nothing heavy: the Snakefile checks the configuration at every start.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

#: A part of config.yaml, of its schema, or of the paper's printed tables, by name.
Settings: TypeAlias = Mapping[str, Any]

#: A row of a table, by column: text, a number, or nothing.
Row: TypeAlias = Mapping[str, Any]

#: How matplotlib is to draw a line, a mark or an area: its keywords.
Look: TypeAlias = Mapping[str, Any]

#: A row that is being made, or the values that the report's template reads, by name.
Cells: TypeAlias = dict[str, Any]
