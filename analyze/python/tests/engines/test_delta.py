"""The data set as Delta tables."""

import json
import re
import shutil
import threading
from pathlib import Path

import duckdb
import polars as pl
from conftest import MACHINE
from deltalake import DeltaTable

import tipwatch as tw
from tipwatch import delta


def table_of(uri, kind):
    return pl.from_arrow(DeltaTable(f"{uri}/{kind}").to_pyarrow_dataset().to_table())


def same(table, parquet, keys):
    columns = sorted(parquet.columns)
    return table.select(columns).sort(keys).equals(parquet.select(columns).cast(table.select(columns).schema).sort(keys))


def test_the_tables_have_the_rows_of_the_data_set_once(logs, tmp_path):
    out, uri = tmp_path / "fleet", str(tmp_path / "delta")
    fleet = tw.screen(logs, machine=MACHINE, out=out)
    assert delta.write(fleet, uri) == delta.write(out, uri), "the same rows are not committed again"
    parquet = pl.read_parquet(fleet.logs_uri)
    assert same(table_of(uri, "logs"), parquet, ["path"])
    # partitions, and a machine and a day that nobody knows
    assert DeltaTable(f"{uri}/logs").metadata().partition_columns == ["machine", "day"]
    assert table_of(uri, "logs")["day"].null_count() == parquet["day"].null_count()
    rows = table_of(uri, "logs")
    assert duckdb.sql("select count(*) from rows").fetchall() == [(len(rows),)]

    # a late log, a copy of another and a new version of the program: rows are replaced, none is doubled
    before = DeltaTable(f"{uri}/logs").version()
    shutil.copy(logs / "coverage_02.mcap", logs / "late_copy.mcap")
    shutil.copy(MACHINE.parent / "coverage_09.mcap", logs / "late.mcap")
    tw.screen(logs, machine=MACHINE, out=out, resume=True)
    for file in out.glob("state/*.json"):
        record = json.loads(file.read_text())
        if record["path"].endswith("coverage_05.mcap"):
            record["tipwatch_version"] = "99.0.0"
            file.with_name(file.name.replace(record["analysis_version"], "f" * 16)).write_text(
                json.dumps({**record, "analysis_version": "f" * 16})
            )
    from tipwatch import _tipwatch

    _tipwatch.FleetTask(out, machine=MACHINE).gather(out, [], 0.5, policy=None, fail_on=None, prune=False)
    delta.write(out, uri)
    rows = table_of(uri, "logs")
    assert rows["path"].is_unique().all() and rows["log_id"].drop_nulls().is_unique().all()
    assert len(rows) == len(parquet) + 1 and rows["copies"].sum() == 2
    newest = rows.filter(pl.col("path").str.ends_with("coverage_05.mcap"))
    assert newest["tipwatch_version"].to_list() == ["99.0.0"]
    assert len(pl.from_arrow(DeltaTable(f"{uri}/logs", version=before).to_pyarrow_dataset().to_table())) == len(parquet)


def test_events_are_a_table_of_their_own(tmp_path):
    fleet = tw.screen(MACHINE.parent / "tiny_lift.mcap", machine=MACHINE.parent / "tiny_lift.toml", out=tmp_path / "fleet")
    versions = delta.write(fleet, str(tmp_path / "delta"))
    assert versions.keys() == {"events", "logs"}
    events = pl.read_parquet(fleet.events_uri)
    assert len(events) > 0
    assert same(table_of(tmp_path / "delta", "events"), events, ["path", "start_ns", "kind", "subject"])


def test_writers_at_the_same_time_all_end_with_one_table(logs, tmp_path):
    outs = []
    for number in range(4):
        part = tmp_path / f"logs_{number}"
        part.mkdir()
        shutil.copy(logs / f"coverage_{number:02}.mcap", part)
        outs.append(tmp_path / f"fleet_{number}")
        tw.screen(part, machine=MACHINE, out=outs[-1])
    uri, failures = str(tmp_path / "delta"), []

    def write(out):
        try:
            delta.write(out, uri)
        except Exception as error:  # noqa: BLE001
            failures.append(error)

    writers = [threading.Thread(target=write, args=(out,)) for out in outs]
    [writer.start() for writer in writers]
    [writer.join() for writer in writers]
    assert not failures
    # one of them came last; its rows are there, and only they
    assert len(table_of(uri, "logs")) == 1
    # a commit for each writer at least, after the creation
    assert len(DeltaTable(f"{uri}/logs").history()) >= 5


def test_the_query_of_the_book_runs(logs, tmp_path, monkeypatch, capsys):
    book = Path(__file__).resolve().parents[4] / "book/src/howto/engines.md"
    blocks = re.findall(r"```python \(not run: it needs deltalake[^\n]*\n(.*?)```", book.read_text(), re.S)
    assert len(blocks) == 1
    tw.screen(logs, machine=MACHINE, out=tmp_path / "fleet")
    monkeypatch.chdir(tmp_path)
    exec(blocks[0], {})
    told = capsys.readouterr().out
    assert "shape: (1, 2)" in told and "failed" in told, told
