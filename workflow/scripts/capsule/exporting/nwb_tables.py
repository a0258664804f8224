"""Write the tables of an NWB file."""

from typing import TYPE_CHECKING

import numpy as np

from capsule.exporting.exported import Exported, long_table

if TYPE_CHECKING:
    import pynwb


def add_tables(file: "pynwb.NWBFile", exported: Exported) -> None:
    """Add every table to an NWB file, and the templates as one more table."""
    from hdmf.common import DynamicTable, VectorData

    module = file.create_processing_module("tables", "tables of the archive")
    templates = [each for each in exported.matrices if each.of == "size"]
    for table in (*exported.tables, *map(long_table, templates)):
        columns = [
            VectorData(
                name=column.name,
                description=f"{column.long_name} [{column.unit}]" if column.unit else "text",
                data=column.values if column.values.dtype != object else _texts(column.values),
            )
            for column in table.columns
        ]
        module.add(DynamicTable(name=table.name, description=table.long_name, columns=columns))


def _texts(values: np.ndarray) -> list[str] | np.ndarray:
    # HDF5 cannot infer that a column without rows holds text.
    return [str(each) for each in values] if values.size else np.array([], dtype="S1")
