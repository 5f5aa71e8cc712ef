"""Fleets on a Ray cluster of two nodes with a worker each."""

import os
import signal
import subprocess
import sys
import time

import pytest
import ray
from conftest import MACHINE, check_every_log_once, contents, faulty, kill_worker_of, records, rows
from ray.cluster_utils import Cluster

import tipwatch as tw
from tipwatch._engines import _ray


@pytest.fixture(scope="module")
def cluster():
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    for _ in range(2):
        cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, log_to_driver=False)
    yield cluster
    ray.shutdown()
    cluster.shutdown()


def test_the_data_set_is_that_of_threads(cluster, logs, tmp_path, of_threads):
    told = []
    fleet = tw.screen(
        logs, machine=MACHINE, out=tmp_path / "fleet", runner="ray", progress=lambda *counts: told.append(counts)
    )
    assert contents(tmp_path / "fleet") == of_threads(logs)
    check_every_log_once(fleet, tmp_path / "fleet", logs, {})
    assert told[0] == (0, 10) and told[-1] == (10, 10)
    # nothing is begun over an earlier run by mistake, and nothing is done twice
    with pytest.raises(tw.TipwatchError, match="resume=True"):
        tw.screen(logs, machine=MACHINE, out=tmp_path / "fleet", runner="ray")
    before = {path: files[0].stat().st_mtime_ns for path, files in records(tmp_path / "fleet").items()}
    tw.screen(logs, machine=MACHINE, out=tmp_path / "fleet", runner="ray", resume=True)
    after = {path: files[0].stat().st_mtime_ns for path, files in records(tmp_path / "fleet").items()}
    assert {path for path in before if before[path] != after[path]} == {str(logs / "photo.mcap")}


def test_lost_workers_cost_no_other_log(cluster, logs, tmp_path, monkeypatch):
    (logs / "abort.mcap").write_bytes((logs / "coverage_01.mcap").read_bytes() + b"\0")
    traces = tmp_path / "traces"
    traces.mkdir()
    monkeypatch.setattr(_ray, "analyse", faulty(str(traces), aborting=["abort.mcap"], slow=["coverage_03.mcap"]))
    kill_worker_of(traces, "coverage_03.mcap")
    out = tmp_path / "fleet"
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", retries=1)
    check_every_log_once(fleet, out, logs, {"abort.mcap": "worker_lost"})
    # both had a second worker; the killed one's log was analysed by it
    assert [len(list(traces.glob(f"{log}.*"))) for log in ("abort.mcap", "coverage_03.mcap")] == [2, 2]
    reasons = rows(fleet).filter(failure="worker_lost")["reason"].to_list()
    assert "WorkerCrashedError" in reasons[0]
    # a worker that survives the log replaces the failure by its result
    monkeypatch.undo()
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", resume=True)
    check_every_log_once(fleet, out, logs, {})


def test_a_killed_driver_loses_nothing(cluster, logs, tmp_path, of_threads):
    out = tmp_path / "fleet"
    program = "import sys, tipwatch as tw; tw.screen(sys.argv[1], machine=sys.argv[2], out=sys.argv[3], runner='ray', jobs=1)"
    driver = subprocess.Popen(
        [sys.executable, "-c", program, str(logs), str(MACHINE), str(out)],
        env={**os.environ, "RAY_ADDRESS": cluster.address},
    )
    while len(records(out)) < 3:
        assert driver.poll() is None, "the driver ended before it was killed"
        time.sleep(0.02)
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    # tasks of a driver that is gone are ended; let none of them write between the two looks
    time.sleep(1.0)
    before = {path: files[0].stat().st_mtime_ns for path, files in records(out).items()}
    assert 3 <= len(before) < 10, "the driver was not killed amidst"
    fleet = tw.screen(logs, machine=MACHINE, out=out, runner="ray", resume=True)
    check_every_log_once(fleet, out, logs, {})
    after = {path: files[0].stat().st_mtime_ns for path, files in records(out).items()}
    changed = {path for path in before if before[path] != after[path]}
    assert changed <= {str(logs / "photo.mcap")}, "a finished log was analysed again"
    assert contents(out) == of_threads(logs)


def test_machine_files_are_sent_to_workers(cluster, logs, tmp_path, monkeypatch):
    import shutil

    here = tmp_path / "only_here"
    here.mkdir()
    for name in ("coverage.toml", "coverage.urdf"):
        if (MACHINE.parent / name).exists():
            shutil.copy(MACHINE.parent / name, here)
    import tomllib

    urdf = tomllib.loads((here / "coverage.toml").read_text()).get("urdf")
    if urdf and not (here / urdf).exists():
        shutil.copy(MACHINE.parent / urdf, here / urdf)
    (here / "fleet.toml").write_text('default = "coverage.toml"\n')
    real = _ray.analyse

    def analyse(parcel, log):
        import shutil

        shutil.rmtree(gone, ignore_errors=True)
        return real(parcel, log)

    gone = str(here)
    monkeypatch.setattr(_ray, "analyse", analyse)
    fleet = tw.screen(logs, fleet=here / "fleet.toml", out=tmp_path / "fleet", runner="ray", jobs=1)
    assert not here.exists()
    check_every_log_once(fleet, tmp_path / "fleet", logs, {})
