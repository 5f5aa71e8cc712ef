"""Logs, faulty workers, and what must hold on every engine."""

import json
import os
import shutil
import signal
import tempfile
import threading
import time
from pathlib import Path

import polars as pl
import pytest

import tipwatch as tw

DATA = Path(__file__).resolve().parents[4] / "tests" / "data"
MACHINE = DATA / "coverage.toml"


@pytest.fixture(scope="session")
def server(tmp_path_factory):
    """An S3 server in this process, which programs find by their environment."""
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    os.environ.update(
        AWS_ENDPOINT_URL=f"http://{host}:{port}", AWS_ALLOW_HTTP="true", AWS_REGION="us-east-1",
        AWS_DEFAULT_REGION="us-east-1", AWS_ACCESS_KEY_ID="test", AWS_SECRET_ACCESS_KEY="test",
        TIPWATCH_TEST_FOLDER=str(tmp_path_factory.mktemp("buckets")),
    )
    import boto3

    boto3.client("s3").create_bucket(Bucket="fleets")
    yield server
    server.stop()


@pytest.fixture(params=["folder", "bucket"])
def out(request, server, tmp_path):
    """An output folder that is not there yet: local, or in a bucket."""
    return tmp_path / "fleet" if request.param == "folder" else f"s3://fleets/{tmp_path.name}/fleet"


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


def here(out):
    """The files of an output folder; those of a bucket in a copy."""
    if "://" not in str(out):
        return Path(out)
    import boto3

    bucket, prefix = str(out).removeprefix("s3://").split("/", 1)
    copy = Path(tempfile.mkdtemp(dir=os.environ["TIPWATCH_TEST_FOLDER"]))
    client = boto3.client("s3")
    for page in client.get_paginator("list_objects_v2").paginate(Bucket=bucket, Prefix=prefix + "/"):
        for found in page.get("Contents", []):
            target = copy / found["Key"].removeprefix(prefix + "/")
            target.parent.mkdir(parents=True, exist_ok=True)
            client.download_file(bucket, found["Key"], str(target))
    return copy


def rows(out):
    return pl.scan_parquet(here(out) / "logs/**/*.parquet").collect()


def records(out):
    """The records of each path."""
    found = {}
    for file in here(out).glob("state/*.json"):
        record = json.loads(file.read_text())
        found.setdefault(record["path"], []).append(record)
    return found


def finished(out):
    """When the log of each path was finished: it changes if the log is analysed again."""
    return {path: found[0]["finished_ns"] for path, found in records(out).items()}


def contents(out):
    """What must not depend on who analysed: tables and page to the byte."""
    out = here(out)
    parts = [*out.glob("logs/**/*.parquet"), *out.glob("events/**/*.parquet"), out / "fleet.html"]
    return {str(part.relative_to(out)): part.read_bytes() for part in parts}


def check_every_log_once(fleet, out, logs, lost):
    """Each path has one record; those in ``lost`` and the photograph failed, with their kinds."""
    names = {path.name for path in logs.iterdir()}
    found = records(out)
    assert {Path(path).name for path in found} == names
    assert all(len(of_path) == 1 for of_path in found.values()), found
    failed = rows(out).filter(pl.col("status") == "failed")
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
