"""Fleets on two Dask workers."""

import pytest
from conftest import MACHINE, check_every_log_once, contents, faulty, kill_worker_of
from distributed import Client, LocalCluster

import tipwatch as tw
from tipwatch._engines import _dask


@pytest.fixture(scope="module")
def client(server):
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        with Client(cluster) as client:
            yield client


def test_the_data_set_is_that_of_threads(client, logs, out, of_threads):
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="dask")
    assert contents(out) == of_threads(logs)
    check_every_log_once(fleet, out, logs, {})


def test_lost_workers_cost_no_other_log(client, logs, tmp_path, monkeypatch):
    (logs / "abort.mcap").write_bytes((logs / "coverage_01.mcap").read_bytes() + b"\0")
    traces = tmp_path / "traces"
    traces.mkdir()
    monkeypatch.setattr(_dask, "analyse", faulty(str(traces), aborting=["abort.mcap"], slow=["coverage_03.mcap"]))
    kill_worker_of(traces, "coverage_03.mcap")
    out = tmp_path / "fleet"
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="dask", retries=2)
    check_every_log_once(fleet, out, logs, {"abort.mcap": "worker_lost"})
    monkeypatch.undo()
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="dask", resume=True)
    check_every_log_once(fleet, out, logs, {})
