"""Analyses of logs, and their tables in other libraries."""

import json
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import tipwatch as tw

DEMO = Path(__file__).resolve().parents[3] / "analyze" / "demo"


def test_tables_reach_every_library(analysis):
    frame = pl.DataFrame(analysis.samples)
    arrow = pa.table(analysis.samples)
    assert frame.shape == (len(analysis.samples), len(analysis.samples.columns))
    assert arrow.column_names == analysis.samples.columns == frame.columns
    assert analysis.samples.units["load_fl"] == "N"
    pandas = pd.DataFrame.from_arrow(arrow) if hasattr(pd.DataFrame, "from_arrow") else arrow.to_pandas()
    assert len(pandas) == frame.height
    found = duckdb.sql("select min(otf_rl), count(*) from arrow").fetchall()
    assert found == [(frame["otf_rl"].min(), frame.height)]


def test_tables_are_not_copied(analysis):
    first, second = (pa.table(analysis.samples)["load_fl"].chunk(0).buffers()[1] for _ in range(2))
    assert first.address == second.address


def test_events_and_summary_are_those_of_the_program(analysis):
    events = pl.DataFrame(analysis.events).sort("worst")
    assert "lift" in " ".join(events["kind"].to_list())
    assert analysis.summary["findings"][0].startswith("Wheel RL was off the ground")
    assert 0.9 < analysis.valid_share <= 1.0


def test_files_are_those_of_the_program(tmp_path, machine):
    out = tmp_path / "results"
    seen = []
    result = tw.analyze(DEMO / "demo.mcap", machine, out=out, precision=32, progress=seen.append)
    names = {path.name for path in result.files}
    assert {"samples.parquet", "events.parquet", "summary.json", "report.html", "derived.mcap"} <= names
    assert pl.DataFrame(result.samples).equals(pl.DataFrame(pq.read_table(out / "samples.parquet")))
    assert json.loads((out / "summary.json").read_text())["findings"] == result.summary["findings"]
    assert seen and seen[-1] > 0


def test_errors_are_those_of_the_program(tmp_path, machine):
    with pytest.raises(tw.TipwatchError, match="nothing.mcap"):
        tw.analyze(tmp_path / "nothing.mcap", machine)
    with pytest.raises(tw.TipwatchError, match='expected estimator smoother or causal, found "both"'):
        tw.analyze(DEMO / "demo.mcap", machine, estimator="both")
    with pytest.raises(tw.TipwatchError, match="expected a positive rate"):
        tw.analyze(DEMO / "demo.mcap", machine, rate=-1.0)


def test_the_program_is_in_the_package():
    from tipwatch import _tipwatch

    assert _tipwatch.main(["tipwatch", "--version"]) == 0
    assert _tipwatch.main(["tipwatch", "no-such-command"]) == 2


def test_errors_are_also_those_of_python(tmp_path, machine):
    with pytest.raises(FileNotFoundError) as missing:
        tw.analyze(tmp_path / "nothing.mcap", machine)
    assert isinstance(missing.value, tw.TipwatchError) and missing.value.kind == "not_found"
    with pytest.raises(ValueError, match="expected a positive rate") as wrong:
        tw.analyze(DEMO / "demo.mcap", machine, rate=-1.0)
    assert wrong.value.kind == "value"


def test_columns_reach_numpy(analysis):
    samples = analysis.samples
    column = samples["load_fl"]
    loads = np.asarray(column)
    assert column.unit == "N" and len(column) == len(loads) == len(samples)
    expected = pl.DataFrame(samples)["load_fl"].to_numpy()
    assert np.array_equal(loads, expected, equal_nan=True)
    assert np.asarray(samples["time_ns"]).dtype == np.int64
    assert "load_fl" in samples and "load_xx" not in samples
    with pytest.raises(KeyError, match="load_xx"):
        samples["load_xx"]
    with pytest.raises(TypeError, match="column of numbers"):
        np.asarray(analysis.events["kind"])
    assert len(samples.head(3)) == 3
    assert samples.to_polars().equals(pl.DataFrame(samples))
    assert samples.to_arrow().equals(pa.table(samples))
    assert len(samples.to_pandas()) == len(samples)
    html = samples._repr_html_()
    assert "<th>load_fl<br>[N]</th>" in html or "<th>time_ns<br>[ns]</th>" in html
    assert html.count("<tr>") == 6
