"""A table as CSV, JSON Lines and Parquet, with the same rows."""

import json
from collections.abc import Callable, Iterable
from itertools import islice
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq

from app.analysis.codebook import Column
from app.services.export_package import Package

_ROWS = 5000  # at once
_ARROW = {
    "text": pa.string(),
    "time": pa.string(),
    "integer": pa.int64(),
    "number": pa.float64(),
    "boolean": pa.bool_(),
}
# A text beginning with one of these might be run by a spreadsheet, or be taken for one that was
# made harmless.
_UNSAFE = "^[=+\\-@\t\r\\x00']"


def schema_of(columns: tuple[Column, ...]) -> pa.Schema:
    """The Arrow schema of a table of the codebook."""
    return pa.schema([(column.name, _ARROW[column.kind]) for column in columns])


def as_tables(rows: Iterable[dict[str, Any]], columns: tuple[Column, ...]) -> Iterable[pa.Table]:
    """Rows as Arrow tables, some thousand at a time; what a row does not name is missing."""
    schema, rows = schema_of(columns), iter(rows)
    while part := list(islice(rows, _ROWS)):
        yield pa.Table.from_pydict(
            {
                column.name: [_plain(row.get(column.name), column.kind) for row in part]
                for column in columns
            },
            schema=schema,
        )


def write_sheets(
    package: Package,
    stem: str,
    columns: tuple[Column, ...],
    parts: Callable[[], Iterable[pa.Table]],
) -> int:
    """Write a table three times over, as ``<stem>.csv``, ``.jsonl`` and ``.parquet``.

    Args:
        package: Where to.
        stem: The path without its ending.
        columns: As in the codebook.
        parts: Gives the rows from the first, in parts; asked once for each form, so that no form
            has to be kept while another is written.

    Returns:
        How many rows there are.
    """
    schema = schema_of(columns)
    count = 0
    with (
        package.open(f"{stem}.csv") as file,
        pyarrow.csv.CSVWriter(pa.PythonFile(file, "w"), schema) as sheet,
    ):
        for part in parts():
            count += len(part)
            sheet.write_table(_harmless(part.select(schema.names).cast(schema)))
    with package.open(f"{stem}.jsonl") as file:
        for part in parts():
            for batch in part.select(schema.names).to_batches(_ROWS):
                file.write("".join(json.dumps(row) + "\n" for row in batch.to_pylist()).encode())
    with (
        package.open(f"{stem}.parquet") as file,
        pq.ParquetWriter(pa.PythonFile(file, "w"), schema, compression="zstd") as sheet,
    ):
        for part in parts():
            sheet.write_table(part.select(schema.names).cast(schema))
    return count


def _harmless(table: pa.Table) -> pa.Table:
    """The same with a ' before each text that a spreadsheet might run."""
    for index, column in enumerate(table.schema):
        if column.type == pa.string():
            values = table.column(index)
            is_unsafe = pc.match_substring_regex(values, _UNSAFE)
            if pc.any(is_unsafe).as_py():
                marked = pc.binary_join_element_wise("'", values, "")
                table = table.set_column(index, column, pc.if_else(is_unsafe, marked, values))
    return table


def _plain(value: Any, kind: str) -> Any:
    if value is None or (kind == "number" and not np.isfinite(value)):
        return None
    # Half a character cannot be written to any file.
    return value.encode("utf-8", "replace").decode() if isinstance(value, str) else value
