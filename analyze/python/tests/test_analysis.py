"""Analyses of logs, and their tables in other libraries."""

import json
import pickle
import re
import sys
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import tipwatch as tw

ROOT = Path(__file__).resolve().parents[3]
DEMO, DATA = ROOT / "analyze" / "demo", ROOT / "tests" / "data"


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
    frames = pl.DataFrame(analysis.samples), analysis.samples.to_polars()
    of_polars = [frame["load_fl"].to_numpy(allow_copy=False) for frame in frames]
    for view in (*of_polars, np.asarray(analysis.samples["load_fl"])):
        assert view.__array_interface__["data"][0] == first.address


def test_samples_keep_the_columns_that_are_asked_for(analysis, machine):
    kept = ["time_ns", "otf_rl", "load_fl"]
    found = tw.analyze(DEMO / "demo.mcap", machine, columns=kept)
    assert found.samples.columns == kept
    assert pl.DataFrame(found.samples).equals(pl.DataFrame(analysis.samples).select(kept))
    assert found.summary["findings"] == analysis.summary["findings"]
    with pytest.raises(tw.TipwatchError, match='found "load_xx"') as error:
        tw.analyze(DEMO / "demo.mcap", machine, columns=["load_xx"])
    assert error.value.kind == "value"
    for twice in (lambda: tw.analyze(DEMO / "demo.mcap", machine, columns=kept[:1] * 2), lambda: analysis.samples[kept[:1] * 2]):
        with pytest.raises(ValueError, match="once"):
            twice()


def test_events_and_summary_are_those_of_the_program(analysis):
    events = pl.DataFrame(analysis.events).sort("worst")
    assert "lift" in " ".join(events["kind"].to_list())
    assert analysis.summary["findings"][0].startswith("Wheel RL was off the ground")
    assert 0.9 < analysis.valid_share <= 1.0


def test_files_are_those_of_the_program(tmp_path, machine):
    out = tmp_path / "results"
    seen = []
    result = tw.analyze(DEMO / "demo.mcap", machine, out=out, progress=seen.append)
    names = {path.name for path in result.files}
    assert {"samples.parquet", "events.parquet", "summary.json", "report.html", "derived.mcap"} <= names
    assert pl.DataFrame(result.samples).equals(pl.DataFrame(pq.read_table(out / "samples.parquet")))
    assert json.loads((out / "summary.json").read_text())["findings"] == result.summary["findings"]
    assert seen and seen[-1] > 0


def test_samples_of_many_rows_are_those_of_the_file(tmp_path, machine):
    result = tw.analyze(DEMO / "demo.mcap", machine, out=tmp_path, rate=4000)
    assert len(result.samples) > 70_000 and result.samples.to_arrow()["load_fl"].num_chunks == 2
    assert pl.DataFrame(result.samples).equals(pl.DataFrame(pq.read_table(tmp_path / "samples.parquet")))


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
    assert str(missing.value).count("No such file") == 1, "a cause is told once"
    with pytest.raises(FileNotFoundError, match="found nothing there$"):
        tw.screen(tmp_path / "nothing", machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet")
    with pytest.raises(ValueError, match="expected a positive rate") as wrong:
        tw.analyze(DEMO / "demo.mcap", machine, rate=-1.0)
    assert wrong.value.kind == "value"


def test_errors_have_the_kind_of_what_is_wrong(tmp_path, machine):
    binary = tmp_path / "machine.toml"
    binary.write_bytes(b"\x89 no text")
    (tmp_path / "logs").mkdir()
    asked = dict(machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet")
    calls = {
        "machine": [lambda: tw.Machine(tmp_path), lambda: tw.Machine(binary), lambda: tw.analyze(DEMO / "demo.mcap", binary)],
        "value": [
            lambda: tw.screen([], **asked),
            lambda: tw.screen(tmp_path / "*.xyz", **asked),
            lambda: tw.screen(tmp_path / "logs", **asked),
            lambda: tw.analyze("s3://bucket/a//b.mcap", machine),
            lambda: tw.analyze(Path("s3://bucket/b.mcap"), machine),
        ],
    }
    for kind, all_of_kind in calls.items():
        for call in all_of_kind:
            with pytest.raises(ValueError) as wrong:
                call()
            assert isinstance(wrong.value, tw.TipwatchError) and wrong.value.kind == kind, str(wrong.value)
    with pytest.raises(ValueError, match="^expected logs"):
        tw.screen([], **asked)
    tw.screen(DATA / "tiny.mcap", **asked)
    with pytest.raises(FileExistsError, match="use resume=True") as again:
        tw.screen(DATA / "tiny.mcap", **asked)
    assert again.value.kind == "exists"
    with pytest.raises(FileNotFoundError, match="expected the records of an earlier run"):
        tw.screen(gather=True, out=tmp_path / "nothing")
    assert tw.TipwatchError("made by a caller").kind == "error"


def test_errors_name_paths_as_they_are(tmp_path, machine):
    log = tmp_path / "site--out.mcap"
    with pytest.raises(FileNotFoundError, match="site--out.mcap"):
        tw.analyze(log, machine)
    log.write_bytes(b"\xff\xd8 a photograph")
    with pytest.raises(tw.TipwatchError, match="site--out.mcap.*set_read_options"):
        tw.analyze(log, machine)


def test_an_engine_that_is_not_installed_is_an_import_error(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    monkeypatch.delitem(sys.modules, "tipwatch._engines._ray", raising=False)
    with pytest.raises(ImportError, match="expected the package ray for runner 'ray'") as missing:
        tw.screen(DATA / "tiny.mcap", machine=DATA / "tiny_lift.toml", out=tmp_path / "fleet", runner="ray")
    assert missing.value.kind == "package"


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
    assert html.count("<tr>") == 21 and "(the first 20 shown)" in html


def in_chunks(table, rows):
    """The same table in chunks of so many rows."""
    arrow, sink = pa.table(table), pa.BufferOutputStream()
    with pa.ipc.new_stream(sink, arrow.schema) as stream:
        for batch in arrow.to_batches(max_chunksize=rows):
            stream.write_batch(batch)
    return tw.Table._of_parts(sink.getvalue().to_pybytes())


def address(array):
    return np.asarray(array).__array_interface__["data"][0]


def test_numpy_reads_the_memory_of_a_column(analysis):
    times, loads = analysis.samples["time_ns"], analysis.samples["load_fl_sigma"]
    for column in (times, loads):
        view = np.asarray(column, copy=False)
        assert address(view) == address(pa.table(analysis.samples)[column.name].chunk(0).to_numpy(zero_copy_only=True))
        assert not view.flags.writeable and np.array(column).flags.writeable
        assert np.array_equal(view, column.to_list())
    assert np.asarray(loads, dtype=np.float32).dtype == np.float32
    # the view outlives its column
    assert np.asarray(analysis.samples.head(9)["load_fl_sigma"])[3] == loads[3]
    for column in (in_chunks(analysis.samples, 500)["time_ns"], analysis.events["lead_s"]):
        with pytest.raises(ValueError, match="in one chunk of which none is missing"):
            np.asarray(column, copy=False)
    assert np.isnan(np.asarray(analysis.events["lead_s"])).sum() == analysis.events["lead_s"].to_list().count(None) > 0


def test_parts_of_a_table_in_chunks_are_not_copied(analysis):
    samples = in_chunks(analysis.samples, 100)
    whole, part = pa.table(samples)["time_ns"], pa.table(samples[150:350])["time_ns"]
    assert [len(chunk) for chunk in part.chunks] == [50, 100, 50]
    found = [chunk.to_numpy(zero_copy_only=True) for chunk in part.chunks]
    expected = [chunk.to_numpy(zero_copy_only=True) for chunk in whole.chunks[1:4]]
    expected[0] = expected[0][50:]
    assert [address(chunk) for chunk in found] == [address(chunk) for chunk in expected]
    frame = analysis.samples.to_polars()
    for rows in (slice(3, 9), slice(None, None, 7), slice(None, None, -1), slice(5, 2), slice(-450, None), slice(99, 101)):
        assert samples[rows].to_polars().equals(frame[rows]), rows
        assert samples["time_ns"][rows].to_list() == frame["time_ns"][rows].to_list()


def test_a_column_is_a_series_and_an_array(analysis):
    for samples in (analysis.samples, in_chunks(analysis.samples, 500), analysis.samples[:0]):
        column, expected = samples["load_fl"], samples.to_polars()["load_fl"]
        assert pl.Series("load_fl", column).equals(expected) and pl.Series(column).dtype == pl.Float32
        assert pa.array(column).type == pa.chunked_array(column).type == pa.float32()
        assert pa.array(column).to_pylist() == expected.to_list()


def test_near_names_are_suggested(analysis, machine):
    told = r'found "laod_fl". Did you mean \["load_fl"'
    with pytest.raises(KeyError, match=told):
        analysis.samples["laod_fl"]
    with pytest.raises(ValueError, match=told):
        # before the log is read
        tw.analyze("nowhere.mcap", machine, columns=["time_ns", "laod_fl"])
    with pytest.raises(KeyError) as wrong:
        analysis.samples["nothing of this kind"]
    assert "Did you mean" not in str(wrong.value)
    assert tw.analyze(DEMO / "demo.mcap", machine, columns="load_fl").samples.columns == ["load_fl"]


def test_a_notebook_shows_what_a_reader_can_use(analysis):
    html = analysis.events._repr_html_()
    cells = re.findall("<td>([^<]*)</td>", html)
    assert len(analysis.events.columns) > 12 and "<th>…</th>" in html and cells.count("…") == len(analysis.events)
    assert all(len(cell) <= 24 for cell in cells), cells
    assert "<th>load_fl<br>[N]</th>" in analysis.samples["load_fl"]._repr_html_()
    assert "…" not in analysis.samples[["load_fl"]]._repr_html_()


@pytest.mark.parametrize("method, package", [("to_pandas", "pyarrow"), ("to_arrow", "pyarrow"), ("to_polars", "polars")])
def test_a_package_that_is_not_installed_is_named(analysis, monkeypatch, method, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ImportError, match=f"expected {package} for Table.{method}, found none: pip install {package}") as missing:
        getattr(analysis.samples, method)()
    assert isinstance(missing.value, tw.TipwatchError) and missing.value.kind == "package"


def test_results_travel_between_processes(analysis, machine, tmp_path):
    copy = pickle.loads(pickle.dumps(analysis))
    assert copy.samples.to_polars().equals(analysis.samples.to_polars())
    assert copy.events.to_polars().equals(analysis.events.to_polars())
    assert copy.samples.units == analysis.samples.units
    assert (copy.summary, copy.notes, copy.valid_share) == (analysis.summary, analysis.notes, analysis.valid_share)
    column = pickle.loads(pickle.dumps(analysis.samples["load_fl"]))
    assert column.unit == "N" and np.array_equal(column, analysis.samples["load_fl"], equal_nan=True)
    posture = machine.evaluate(machine.zero_posture, what="all")
    again = pickle.loads(pickle.dumps(posture))
    assert again.names == posture.names and np.array_equal(again.load, posture.load)
    assert again.describe("load") == posture.describe("load")
    fleet = tw.screen(DEMO / "demo.mcap", machine=machine, out=tmp_path / "fleet", reports="none")
    copy = pickle.loads(pickle.dumps(fleet))
    assert copy.totals == fleet.totals and copy.page == fleet.page and len(copy.logs) == 1


def test_values_of_a_column_are_those_of_python(analysis):
    events, frame = analysis.events, analysis.events.to_polars()
    for name in ("kind", "start_ns", "worst", "split_dependent", "load_min", "doubted_by"):
        assert events[name].to_list() == frame[name].to_list()


def test_a_long_table_has_few_chunks(analysis):
    # 1800 rows come in blocks of 512
    assert analysis.samples.to_arrow()["load_fl"].num_chunks == 1


def test_options_are_those_of_the_program():
    log, machine = DATA / "tiny_lift.mcap", DATA / "tiny_lift.toml"
    result = tw.analyze(
        log, machine, model="closed-form", closed_form_input="accelerometer", apply_clock_offsets="estimated",
        quasi_static="never", monte_carlo=20, terms=True,
    )
    options = result.summary["options"]
    assert options["closed_form_input"] == "accelerometer" and options["apply_clock_offsets"] == "estimated"
    assert options["quasi_static"] == "never" and options["monte_carlo"] == 20
    assert result.summary["monte_carlo"] is not None
    assert any(name.startswith("term_1_") for name in result.samples.columns)
    with pytest.raises(ValueError, match="expected monte_carlo from 1 to 10000, found 0"):
        tw.analyze(log, machine, monte_carlo=0)
    with pytest.raises(ValueError, match="expected quasi_static auto or always or never, found \"often\""):
        tw.analyze(log, machine, quasi_static="often")


def test_what_tables_do_not_state_can_be_said(tmp_path):
    samples = tw.read(DATA / "tiny_lift.mcap", DATA / "tiny_lift.toml").to_polars()
    table = samples.select((pl.col("time_ns") // 1_000_000).alias("clock"), "lift.position")
    table.write_csv(tmp_path / "drive.csv")
    with pytest.raises(tw.TipwatchError, match="not a log: expected"):
        tw.read(tmp_path / "drive.csv", DATA / "tiny_lift.toml")
    try:
        tw.set_read_options(time_column="clock", time_unit="ms")
        # it is a log now, though not one of this machine
        with pytest.raises(tw.TipwatchError, match="joint_states"):
            tw.read(tmp_path / "drive.csv", DATA / "tiny_lift.toml")
    finally:
        tw.set_read_options()
    with pytest.raises(ValueError, match="time_unit: expected s, ms, us, ns, min, h or days, found \"weeks\""):
        tw.set_read_options(time_unit="weeks")


def test_columns_and_tables_are_indexed_like_sequences(analysis):
    samples = analysis.samples
    column, expected = samples["load_fl"], samples["load_fl"].to_list()
    assert (column[0], column[-1], len(column)) == (expected[0], expected[-1], len(expected))
    assert list(column) == expected
    for part in (slice(3, 9), slice(None, None, 7), slice(None, None, -1), slice(5, 2), slice(-4, None)):
        assert column[part].to_list() == expected[part]
        assert samples[part].to_polars().equals(samples.to_polars()[part])
    assert column[3:9].unit == "N"
    two = samples[["time_ns", "load_fl"]]
    assert two.columns == ["time_ns", "load_fl"] and len(two) == len(samples) and two.units["load_fl"] == "N"
    for wrong in (len(column), -len(column) - 1):
        with pytest.raises(IndexError, match=f"expected a row below {len(column)}, found {wrong}"):
            column[wrong]
    with pytest.raises(KeyError, match="load_xx"):
        samples[["time_ns", "load_xx"]]
    with pytest.raises(TypeError, match="expected the name of a column, a list of names or a slice of rows, found int"):
        samples[0]
    with pytest.raises(TypeError, match="expected a row or a slice of rows, found str"):
        column["load_fl"]


def test_an_analysis_shows_its_findings(analysis):
    first, *others = analysis.summary["findings"]
    assert first in repr(analysis) and f"and {len(others)} more findings" in repr(analysis)
    html = analysis._repr_html_()
    assert html.count("<li>") == len(others) + 1 and "Wheel RL was off the ground" in html


def test_what_is_no_log_and_what_is_no_query_are_values(machine, tmp_path):
    (tmp_path / "photo.mcap").write_bytes(b"\xff\xd8\xff\xe0 a photograph")
    with pytest.raises(ValueError, match="not a log") as wrong:
        tw.analyze(tmp_path / "photo.mcap", machine)
    assert isinstance(wrong.value, tw.TipwatchError) and wrong.value.kind == "log"
    fleet = tw.screen(DEMO / "demo.mcap", machine=machine, out=tmp_path / "fleet", reports="none")
    for sql in ("SELEKT 1", "SELECT nothing FROM logs", "SELECT * FROM machines"):
        with pytest.raises(ValueError) as wrong:
            fleet.query(sql)
        assert isinstance(wrong.value, tw.TipwatchError) and wrong.value.kind == "query", sql


def test_texts_name_keywords_and_no_flags(machine, tmp_path):
    tw.screen(DEMO / "demo.mcap", machine=machine, out=tmp_path / "fleet", reports="none")
    with pytest.raises(tw.TipwatchError, match="use resume=True to continue it"):
        tw.screen(DEMO / "demo.mcap", machine=machine, out=tmp_path / "fleet", reports="none")
    (tmp_path / "photo.mcap").write_bytes(b"\xff\xd8\xff\xe0 a photograph")
    with pytest.raises(tw.TipwatchError) as wrong:
        tw.analyze(tmp_path / "photo.mcap", machine)
    assert "set_read_options(time_column=...)" in str(wrong.value) and "--" not in str(wrong.value)
