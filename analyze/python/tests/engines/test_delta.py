"""The data set as Delta tables."""

import json
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import duckdb
import polars as pl
import pytest
from conftest import MACHINE
from deltalake import CommitProperties, DeltaTable, write_deltalake

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
    # one file, whatever machines and days there are
    assert len(DeltaTable(f"{uri}/logs").file_uris()) == 1
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

    _tipwatch.FleetTask(out, machine=MACHINE).gather(out, 0.5, policy=None, fail_on=None, prune=False)
    delta.write(out, uri)
    rows = table_of(uri, "logs")
    assert rows["path"].is_unique().all() and rows["log_id"].drop_nulls().is_unique().all()
    assert len(rows) == len(parquet) + 1 and rows["copies"].sum() == 2
    newest = rows.filter(pl.col("path").str.ends_with("coverage_05.mcap"))
    assert newest["tipwatch_version"].to_list() == ["99.0.0"]
    assert len(pl.from_arrow(DeltaTable(f"{uri}/logs", version=before).to_pyarrow_dataset().to_table())) == len(parquet)


def test_a_table_with_partitions_loses_them_and_keeps_its_versions(logs, tmp_path):
    out, uri = tmp_path / "fleet", str(tmp_path / "delta")
    parquet = pl.read_parquet(tw.screen(logs, machine=MACHINE, out=out).logs_uri)
    delta.write(out, uri)
    # as the version before wrote it, with the same rows
    rows, last = DeltaTable(f"{uri}/logs").to_pyarrow_table(), DeltaTable(f"{uri}/logs").history(1)[0]
    shutil.rmtree(f"{uri}/logs")
    write_deltalake(
        f"{uri}/logs", rows, partition_by=["machine", "day"],
        commit_properties=CommitProperties(custom_metadata={delta._CONTENT: last[delta._CONTENT]}),
    )
    assert len(DeltaTable(f"{uri}/logs").file_uris()) > 1
    assert delta.write(out, uri)["logs"] == 1
    table = DeltaTable(f"{uri}/logs")
    assert table.metadata().partition_columns == [] and len(table.file_uris()) == 1
    assert same(table_of(uri, "logs"), parquet, ["path"])
    assert DeltaTable(f"{uri}/logs", version=0).to_pyarrow_table().num_rows == len(parquet)
    assert delta.write(out, uri)["logs"] == 1


def test_what_is_missing_has_a_kind(tmp_path):
    with pytest.raises(FileNotFoundError, match="expected a complete data set") as missing:
        delta.write(tmp_path, str(tmp_path / "delta"))
    assert missing.value.kind == "not_found"
    without = "import sys; sys.modules['deltalake'] = None\ntry:\n import tipwatch.delta\nexcept ImportError as error:\n print(error.kind)"
    told = subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=True)
    assert told.stdout == "package\n"


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
