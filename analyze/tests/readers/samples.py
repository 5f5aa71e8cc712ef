"""Reads a samples.parquet with polars, pyarrow and DuckDB.

    pip install polars pyarrow duckdb
    python analyze/tests/readers/samples.py RESULTS EXACT

Both are folders that `tipwatch analyze --out` wrote from the same log, the second with `--precision 64`. All
readers must find the same table; its numbers are those of EXACT rounded to 32 bits, its times the same.
"""

import json
import math
import struct
import sys
from pathlib import Path

try:
    import duckdb
    import polars
    import pyarrow.parquet
except ModuleNotFoundError as missing:
    sys.exit(f"{missing}: pip install polars pyarrow duckdb")


def rounded(number: float | None) -> float | None:
    return None if number is None else struct.unpack("f", struct.pack("f", number))[0]


def main(results: Path, exact: Path) -> None:
    path = results / "samples.parquet"
    by_arrow = pyarrow.parquet.read_table(path)
    tables = {
        "polars": polars.read_parquet(path).to_dict(as_series=False),
        "pyarrow": by_arrow.to_pydict(),
        "duckdb": duckdb.read_parquet(str(path)).to_arrow_table().to_pydict(),
    }
    expected = pyarrow.parquet.read_table(exact / "samples.parquet")
    for name, table in tables.items():
        assert list(table) == expected.column_names, name
    for field in expected.schema:
        values = expected[field.name].to_pylist()
        if str(field.type) == "double":
            values = [rounded(value) for value in values]
        for name, table in tables.items():
            assert table[field.name] == values, f"{name}: {field.name}"
    kinds = {str(field.type) for field in by_arrow.schema}
    assert "float" in kinds and "double" not in kinds, kinds
    units = json.loads(by_arrow.schema.metadata[b"tipwatch.units"])
    assert units["load_fl"] == "N" and units["time_ns"] == "ns"
    assert b"tipwatch.provenance" in by_arrow.schema.metadata
    numbers = [value for value in tables["polars"]["load_fl"] if value is not None]
    assert len(numbers) > 100 and all(math.isfinite(number) for number in numbers)
    print(f"polars, pyarrow, DuckDB: {expected.num_rows} rows, {expected.num_columns} columns equal")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
