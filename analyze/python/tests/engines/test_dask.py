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


def test_what_is_asked_of_threads_holds(client, logs, tmp_path):
    asked = dict(machine=MACHINE, fail_on=["wheel_lift", "wheel_light"], reports="all")
    gone = logs / "gone.mcap"
    gone.write_bytes((logs / "coverage_01.mcap").read_bytes() + b"\0")
    found = {}
    for runner in ("threads", "dask"):
        out = tmp_path / runner
        tw.screen(logs, out=out, runner=runner, **asked)
        taken = gone.read_bytes()
        gone.unlink()
        fleet = tw.screen(logs, out=out, runner=runner, resume=True, prune=True, **asked)
        gone.write_bytes(taken)
        reports = {file.parent.name for file in out.glob("reports/*/report.html")}
        found[runner] = fleet.totals, contents(out), (out / "policy.json").read_bytes(), reports
    assert found["threads"] == found["dask"]
    totals, _, _, reports = found["dask"]
    assert len(reports) == totals["analysed"] > 0


def test_workers_read_logs_as_stated(client, logs, tmp_path):
    stated = []
    try:
        tw.set_read_options(time_unit="ms")
        with_unit = tw.screen(logs, machine=MACHINE, out=tmp_path / "stated", runner="dask")
        stated = with_unit.logs["analysis_version"]
        tw.set_read_options()
        without = tw.screen(logs, machine=MACHINE, out=tmp_path / "usual", runner="dask").logs["analysis_version"]
    finally:
        tw.set_read_options()
    assert set(list(stated)).isdisjoint(set(list(without)) - {None})
