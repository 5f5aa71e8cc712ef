"""Logs, faulty workers, and what must hold on every engine."""

import json
import os
import shutil
import signal
import threading
import time
from pathlib import Path

import polars as pl
import pytest

import tipwatch as tw

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"
MACHINE = DATA / "coverage.toml"


@pytest.fixture
def logs(tmp_path):
    """Eight logs of one machine, a copy, and a photograph."""
    folder = tmp_path / "logs"
    folder.mkdir()
    for number in range(8):
        shutil.copy(DATA / f"coverage_{number:02}.mcap", folder)
    shutil.copy(DATA / "coverage_00.mcap", folder / "coverage_00_again.mcap")
    (folder / "photo.mcap").write_bytes(b"\xff\xd8\xff\xe0 a photograph")
    return folder


def faulty(traces, aborting=(), slow=()):
    """The work of a worker, with logs that abort their process, and slow ones that wait to be killed once.

    A function in a function is sent to the workers by value."""

    def analyse(parcel, log):
        import os
        import time
        from pathlib import Path

        from tipwatch._engines._parcel import analyse as real

        name = Path(log).name
        attempt = Path(traces) / f"{name}.{time.time_ns()}"
        attempt.write_text(str(os.getpid()))
        if name in aborting:
            os.abort()
        if name in slow and len(list(Path(traces).glob(f"{name}.*"))) == 1:
            time.sleep(600)
        return real(parcel, log)

    return analyse


def kill_worker_of(traces, log):
    """Kills the process that has taken the log, as soon as one has."""

    def wait_and_kill():
        while not (taken := [file for file in Path(traces).glob(f"{log}.*") if file.read_text()]):
            time.sleep(0.05)
        os.kill(int(taken[0].read_text()), signal.SIGKILL)

    threading.Thread(target=wait_and_kill, daemon=True).start()


def rows(fleet):
    return pl.scan_parquet(fleet.logs_uri, hive_partitioning=True).collect()


def records(out):
    """The records by path, with the number of records of each."""
    found = {}
    for file in Path(out).glob("state/*.json"):
        found.setdefault(json.loads(file.read_text())["path"], []).append(file)
    return found


def contents(out):
    """What must not depend on who analysed: tables and page to the byte."""
    parts = [*Path(out).glob("logs/**/*.parquet"), *Path(out).glob("events/**/*.parquet"), Path(out) / "fleet.html"]
    return {str(part.relative_to(out)): part.read_bytes() for part in parts}


def check_every_log_once(fleet, out, logs, lost):
    """Each path has one record; those in ``lost`` and the photograph failed, with their kinds."""
    names = {path.name for path in logs.iterdir()}
    found = records(out)
    assert {Path(path).name for path in found} == names
    assert all(len(files) == 1 for files in found.values()), found
    failed = rows(fleet).filter(pl.col("status") == "failed")
    kinds = {Path(path).name: kind for path, kind in failed.select("path", "failure").iter_rows()}
    assert kinds == {"photo.mcap": "log", **lost}
    assert fleet.totals["logs"] == len(names) - fleet.totals["copies"]


@pytest.fixture(scope="session")
def of_threads(tmp_path_factory):
    """The data set of a folder's logs as the threads of one process make it."""

    def screened(logs):
        out = tmp_path_factory.mktemp("threads") / "fleet"
        tw.screen(logs, machine=MACHINE, out=out)
        return contents(out)

    return screened
