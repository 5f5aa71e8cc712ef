"""Hands a long table to pyarrow, polars and NumPy: prints the addresses of its buffers, and time and memory of each.

    PYTHONPATH=... python analyze/python/tests/handover.py [ROWS]
"""

import resource
import sys
import time
from pathlib import Path

import numpy as np
import polars as pl
import pyarrow as pa

import tipwatch as tw

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"
# the log lasts so long (s)
LOG_S = 11.0


def main():
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 100_000
    table = tw.read(DATA / "tiny_lift.mcap", DATA / "tiny_lift.toml", rate=rows / LOG_S)
    before = memory()
    arrow, arrow_s = timed(lambda: pa.table(table))
    frame, frame_s = timed(lambda: pl.DataFrame(table))
    names = [field.name for field in arrow.schema if pa.types.is_floating(field.type)]
    chunks = arrow.column(names[0]).num_chunks
    same = 0
    for name in names:
        of_arrow = [chunk.buffers()[1].address for chunk in arrow.column(name).chunks]
        of_frame = [chunk.to_arrow().buffers()[1].address for chunk in frame[name].get_chunks()]
        # one chunk that is known throughout is one array
        numbers = arrow.column(name).chunk(0).to_numpy(zero_copy_only=False)
        assert len(numbers)
        same += of_arrow == of_frame
    whole = next(name for name in names if arrow.column(name).null_count == 0)
    array = arrow.column(whole).chunk(0).to_numpy(zero_copy_only=True)
    assert array.__array_interface__["data"][0] == arrow.column(whole).chunk(0).buffers()[1].address
    assert same == len(names), f"{same} of {len(names)} columns have the same addresses"
    print(f"{len(table)} rows, {len(arrow.schema)} columns in {chunks} blocks, {arrow.nbytes / 1e6:.0f} MB")
    print(f"all {same} columns of numbers at the same addresses in pyarrow and polars, {whole} in NumPy, too")
    print(f"pyarrow {1e3 * arrow_s:.1f} ms, polars {1e3 * frame_s:.1f} ms, {(memory() - before) / 1e6:.0f} MB more memory at the peak")
    assert np.isfinite(array[:1]).all()


def timed(call):
    started = time.perf_counter()
    return call(), time.perf_counter() - started


def memory():
    """Largest resident set so far (bytes)."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


if __name__ == "__main__":
    main()
