"""The data set of a fleet as Delta tables. Needs the packages deltalake and pyarrow: ``pip install 'tipwatch[delta]'``."""

from __future__ import annotations

import hashlib
import random
import time
from collections.abc import Mapping
from os import PathLike

from tipwatch._errors import error
from tipwatch._tipwatch import Fleet, TipwatchError

try:
    import pyarrow as pa
    import pyarrow.dataset as ds
    import pyarrow.fs as fs
    from deltalake import CommitProperties, DeltaTable, write_deltalake
    from deltalake.exceptions import CommitFailedError, DeltaError, TableNotFoundError
except ModuleNotFoundError as missing:
    text = f"expected the packages deltalake and pyarrow, found not both: pip install 'tipwatch[delta]' ({missing})"
    raise error("package", text) from missing

_CONTENT = "tipwatch.content"


def write(
    fleet: Fleet | str | PathLike[str],
    table: str,
    *,
    storage_options: Mapping[str, str] | None = None,
    attempts: int = 10,
) -> dict[str, int]:
    """Writes the data set of a fleet as two Delta tables, ``<table>/logs`` and ``<table>/events``.

    Each table is replaced by one commit, so a reader sees the rows of one gathering: rows of an old version of the program
    are gone, and repeated logs do not double. Older versions of the table stay readable. The commit is left out if the
    table already has these rows. A table has no partitions, which would be a file for each machine and day: the files tell
    readers which machines and days they have. One that has partitions, of an earlier version, loses them.

    Parameters
    ----------
    fleet : Fleet or path
        The result of ``screen``, or its folder or URL.
    table : str
        Folder or URL of the tables; it is created.
    storage_options : mapping, optional
        Credentials and settings of the bucket, as ``deltalake`` takes them.
    attempts : int
        Attempts for a commit that another writer came before.

    Returns
    -------
    dict
        The version of each table by its name.

    Raises
    ------
    TipwatchError
        There is no data set (also a ``FileNotFoundError``), or the commit failed in all attempts.
    """
    out = fleet.logs_uri.removesuffix("/logs/*.parquet") if isinstance(fleet, Fleet) else str(fleet)
    system, root = fs.FileSystem.from_uri(out) if "://" in out else (fs.LocalFileSystem(), out)
    if system.get_file_info(f"{root}/screen.json").type != fs.FileType.File:
        raise error("not_found", f"{out}: expected a complete data set, found no screen.json; gather it first")
    options = dict(storage_options or {})
    # events first: a reader that joins finds the events of every log
    return {
        kind: _replaced(f"{table.rstrip('/')}/{kind}", _rows(system, f"{root}/{kind}"), options, attempts)
        for kind in ("events", "logs")
        if system.get_file_info(f"{root}/{kind}").type == fs.FileType.Directory
    }


def _rows(system: fs.FileSystem, folder: str) -> pa.Table:
    """The rows of a table with the types that Delta has."""
    rows = ds.dataset(folder, filesystem=system, format="parquet").to_table()
    schema = pa.schema([pa.field(field.name, _type(field.type), field.nullable) for field in rows.schema])
    rows = rows.cast(schema)
    # the order of files is that of a listing
    keys = [name for name in ("machine", "day", "path", "start_ns", "kind", "subject") if name in schema.names]
    return rows.sort_by([(key, "ascending") for key in keys]).replace_schema_metadata(None)


def _type(of: pa.DataType) -> pa.DataType:
    """The type that Delta has for another: no counts, and no texts and lists with places of 64 bits or views."""
    if pa.types.is_unsigned_integer(of):
        return pa.int64()
    if pa.types.is_large_string(of) or of == pa.string_view():
        return pa.string()
    if pa.types.is_list(of) or pa.types.is_large_list(of):
        return pa.list_(_type(of.value_type))
    return of


def _replaced(uri: str, rows: pa.Table, options: dict[str, str], attempts: int) -> int:
    """Replaces the rows of a table; returns its version."""
    content = _digest(rows)
    for attempt in range(1, attempts + 1):
        try:
            # the table exists before rows are written: two first writers would otherwise both create it
            table = _opened(uri, rows.schema, options)
            if table.history(1)[0].get(_CONTENT) == content and not table.metadata().partition_columns:
                return table.version()
            properties = CommitProperties(custom_metadata={_CONTENT: content}, max_commit_retries=0)
            # None would keep the partitions of the table
            write_deltalake(
                table, rows, mode="overwrite", schema_mode="overwrite", partition_by=[], commit_properties=properties
            )
            return DeltaTable(uri, storage_options=options).version()
        except (CommitFailedError, DeltaError) as failure:
            if attempt == attempts:
                raise TipwatchError(f"{uri}: no commit in {attempts} attempts: {failure}") from failure
            # other writers wait for other times
            time.sleep(random.uniform(0.0, min(0.1 * 2**attempt, 5.0)))
    raise error("value", f"expected attempts of at least 1, found {attempts}")


def _opened(uri: str, schema: pa.Schema, options: dict[str, str]) -> DeltaTable:
    try:
        return DeltaTable(uri, storage_options=options)
    except TableNotFoundError:
        return DeltaTable.create(uri, schema, mode="ignore", storage_options=options)


def _digest(rows: pa.Table) -> str:
    sink = pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, rows.schema) as stream:
        stream.write_table(rows.combine_chunks())
    return hashlib.sha256(sink.getvalue()).hexdigest()
