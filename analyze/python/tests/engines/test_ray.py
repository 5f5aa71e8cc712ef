"""Fleets on a Ray cluster of two nodes with a worker each."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest
import ray
from conftest import MACHINE, check_every_log_once, contents, faulty, finished, kill_worker_of, rows
from ray.cluster_utils import Cluster

import tipwatch as tw
from tipwatch._engines import _ray


@pytest.fixture(scope="module")
def cluster(server):
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    for _ in range(2):
        cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster
    ray.shutdown()
    cluster.shutdown()


def test_the_data_set_is_that_of_threads(cluster, logs, out, of_threads):
    told = []
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", progress=lambda *counts: told.append(counts))
    assert contents(out) == of_threads(logs)
    check_every_log_once(fleet, out, logs, {})
    assert told[0] == (0, 10) and told[-1] == (10, 10)
    # nothing is begun over an earlier run by mistake, and nothing is done twice
    with pytest.raises(tw.TipwatchError, match="resume=True"):
        tw.screen(logs, machine=MACHINE, out=out, runner="ray")
    before = finished(out)
    tw.screen(logs, machine=MACHINE, out=out, runner="ray", resume=True)
    after = finished(out)
    assert {path for path in before if before[path] != after[path]} == {str(logs / "photo.mcap")}


def test_logs_of_a_bucket_are_those_of_a_folder(cluster, logs, tmp_path, of_threads):
    import boto3

    client = boto3.client("s3")
    for log in logs.iterdir():
        client.upload_file(str(log), "fleets", f"{tmp_path.name}/logs/{log.name}")
    place = f"s3://fleets/{tmp_path.name}"
    fleet = tw.screen(f"{place}/logs", machine=MACHINE, out=f"{place}/fleet", runner="ray")
    found = rows(f"{place}/fleet")
    assert set(found["path"]) == {f"{place}/logs/{log.name}" for log in logs.iterdir()} - copies(found, place)
    assert fleet.totals["copies"] == 1
    assert found.filter(status="failed").select("path", "failure").rows() == [(f"{place}/logs/photo.mcap", "log")]
    # the results of the same logs in a folder
    local = tmp_path / "local"
    tw.screen(logs, machine=MACHINE, out=local)
    numbers = [name for name, of in found.schema.items() if of.is_float()]
    names = found["path"].str.split("/").list.last()
    there = found.with_columns(name=names).sort("name")
    here = rows(local).with_columns(name=pl.col("path").str.split("/").list.last()).sort("name")
    assert len(numbers) > 5 and there.select(numbers).equals(here.select(numbers), null_equal=True)


def copies(found, place):
    """The path of the two with equal content that has no row."""
    both = {f"{place}/logs/{name}.mcap" for name in ("coverage_00", "coverage_00_again")}
    return both - set(found["path"])


def test_lost_workers_cost_no_other_log(cluster, logs, out, tmp_path, monkeypatch):
    (logs / "abort.mcap").write_bytes((logs / "coverage_01.mcap").read_bytes() + b"\0")
    traces = tmp_path / "traces"
    traces.mkdir()
    monkeypatch.setattr(_ray, "analyse", faulty(str(traces), aborting=["abort.mcap"], slow=["coverage_03.mcap"]))
    kill_worker_of(traces, "coverage_03.mcap")
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", retries=1)
    check_every_log_once(fleet, out, logs, {"abort.mcap": "worker_lost"})
    # both had a second worker; the killed one's log was analysed by it
    assert [len(list(traces.glob(f"{log}.*"))) for log in ("abort.mcap", "coverage_03.mcap")] == [2, 2]
    assert "WorkerCrashedError" in rows(out).filter(failure="worker_lost")["reason"][0]
    # a worker that survives the log replaces the failure by its result
    monkeypatch.undo()
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", resume=True)
    check_every_log_once(fleet, out, logs, {})


def test_a_killed_driver_loses_nothing(cluster, logs, out, of_threads):
    program = "import sys, tipwatch as tw; tw.screen(sys.argv[1], machine=sys.argv[2], out=sys.argv[3], runner='ray', jobs=1)"
    driver = subprocess.Popen(
        [sys.executable, "-c", program, str(logs), str(MACHINE), str(out)],
        env={**os.environ, "RAY_ADDRESS": cluster.address},
    )
    while len(finished(out)) < 3:
        assert driver.poll() is None, "the driver ended before it was killed"
        time.sleep(0.02)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    # tasks of a driver that is gone are ended; let none of them write between the two looks
    time.sleep(1.0)
    before = finished(out)
    assert 3 <= len(before) < 10, "the driver was not killed amidst"
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", resume=True)
    check_every_log_once(fleet, out, logs, {})
    after = finished(out)
    changed = {path for path in before if before[path] != after[path]}
    assert changed <= {str(logs / "photo.mcap")}, "a finished log was analysed again"
    assert contents(out) == of_threads(logs)


def test_machine_files_are_sent_to_workers(cluster, logs, tmp_path, monkeypatch):
    only_here = tmp_path / "only_here"
    only_here.mkdir()
    for name in ("coverage.toml", "coverage.urdf"):
        shutil.copy(MACHINE.parent / name, only_here)
    (only_here / "fleet.toml").write_text('default = "coverage.toml"\n')
    real, gone = _ray.analyse, str(only_here)

    def analyse(parcel, log):
        import shutil

        shutil.rmtree(gone, ignore_errors=True)
        return real(parcel, log)

    monkeypatch.setattr(_ray, "analyse", analyse)
    fleet = tw.screen(logs, fleet=only_here / "fleet.toml", out=tmp_path / "fleet", runner="ray", jobs=1)
    assert not only_here.exists()
    check_every_log_once(fleet, tmp_path / "fleet", logs, {})


def test_the_queries_of_the_book_run(cluster, logs, tmp_path, monkeypatch, capsys):
    book = Path(__file__).resolve().parents[4] / "book/src/howto/engines.md"
    blocks = re.findall(r"```python \(not run: it needs a Ray cluster[^\n]*\n(.*?)```", book.read_text(), re.S)
    assert len(blocks) == 1
    for file in MACHINE.parent.glob("tiny_lift.*"):
        shutil.copy(file, tmp_path)
    shutil.rmtree(logs)
    logs.mkdir()
    for name in ("tiny.mcap", "tiny_lift.mcap"):
        shutil.copy(MACHINE.parent / name, logs)
    monkeypatch.chdir(tmp_path)
    exec(blocks[0].replace("ray.init()", "pass"), {})
    told = capsys.readouterr().out
    assert "analysed" in told and told.rstrip().endswith("2"), told
