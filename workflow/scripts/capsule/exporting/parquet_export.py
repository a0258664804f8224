"""Export to Parquet: one file for each table; its metadata holds the units and the provenance."""

import json
from collections.abc import Callable
from functools import partial
from typing import BinaryIO

from capsule.exporting.exported import Exported, Table, long_table


def contents(exported: Exported) -> dict[str, Callable[[BinaryIO], None]]:
    """Return the names of the files, with the functions that write them."""
    tables = [*exported.tables, *map(long_table, exported.matrices)]
    return {f"{table.name}.parquet": partial(_write, table, exported) for table in tables}


def _write(table: Table, exported: Exported, stream: BinaryIO) -> None:
    import pyarrow
    from pyarrow import parquet

    # An unknown value becomes null. The type is given, so that a column without text is still text.
    arrays = [
        pyarrow.array(
            column.values,
            type=pyarrow.string() if column.values.dtype == object else None,
            from_pandas=True,
        )
        for column in table.columns
    ]
    fields = [
        pyarrow.field(
            column.name,
            array.type,
            metadata={"unit": column.unit, "long_name": column.long_name},
        )
        for column, array in zip(table.columns, arrays, strict=True)
    ]
    metadata = {"long_name": table.long_name, "provenance": json.dumps(exported.provenance)}
    schema = pyarrow.schema(fields, metadata=metadata)
    parquet.write_table(pyarrow.table(arrays, schema=schema), stream, compression="zstd")
