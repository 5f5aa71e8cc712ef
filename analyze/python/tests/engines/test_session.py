"""A session as a notebook has it: a log and a fleet in buckets, Ray, tables without a copy."""

import re
import shutil
from pathlib import Path

import boto3
import polars as pl
import pytest
from conftest import DATA

SESSION = """
import numpy as np, polars as pl, tipwatch as tw
machine = tw.Machine("fw-01.toml")
result = tw.analyze("s3://logs/shift.mcap", machine, rate=50)
df = pl.DataFrame(result.samples)                      # zero copy
worst = pl.DataFrame(result.events).sort("worst").head(5)
q = np.tile(machine.zero_posture, (100_000, 1)); q[:, machine.joint("boom")] = np.linspace(-1, 1, 100_000)
loads = machine.evaluate(q, specific_force=(0, 0, 9.81)).load       # (n, wheels)
fleet = tw.screen("s3://logs/2026/", fleet="fleet.toml", out="s3://fleet", runner="ray")
pl.scan_parquet(fleet.logs_uri)
"""


@pytest.fixture
def forwarder(tmp_path, monkeypatch):
    """A forwarder whose boom the log calls "lift", in the working folder."""
    monkeypatch.chdir(tmp_path)
    # whole names: links and joints of the boom keep their own
    text = re.sub(r'"lift"|\blift =', lambda name: name[0].replace("lift", "boom"), (DATA / "tiny_lift.toml").read_text())
    text = text.replace("tiny_lift.urdf", "fw-01.urdf")
    numbers = ", ".join(
        f'{key} = {{ topic = "/joint_states", field = "{key}", joint = "lift" }}' for key in ("position", "velocity")
    )
    Path("fw-01.toml").write_text(f"{text}\n[signals.joints]\nboom = {{ {numbers} }}\n")
    Path("fw-01.urdf").write_text((DATA / "tiny_lift.urdf").read_text().replace("'lift'", "'boom'"))
    Path("fleet.toml").write_text('[[machine]]\nfile = "fw-01.toml"\npath = "**/fw-01/**"\n')
    return tmp_path


def test_ten_lines_run_as_written(server, forwarder):
    client = boto3.client("s3")
    client.create_bucket(Bucket="logs")
    client.create_bucket(Bucket="fleet")
    for key in ("shift.mcap", "2026/fw-01/a.mcap", "2026/fw-01/deep/b.mcap"):
        client.upload_file(str(DATA / "tiny_lift.mcap"), "logs", key)
    client.put_object(Bucket="logs", Key="2026/fw-02/c.mcap", Body=(DATA / "tiny.mcap").read_bytes())
    names = {}
    exec(SESSION, names)
    df, fleet, loads = names["df"], names["fleet"], names["loads"]
    assert df.height > 100 and names["worst"].height >= 1
    # the same log as a local file
    import tipwatch as tw

    machine = tw.Machine(DATA / "tiny_lift.toml")
    local = pl.DataFrame(tw.analyze(DATA / "tiny_lift.mcap", machine, rate=50).samples)
    assert df["load_fl"].equals(local["load_fl"])
    assert loads.shape == (100_000, 4) and abs(loads.sum(axis=1) - machine.mass * 9.81).max() < 1e-4 * machine.mass * 9.81
    rows = pl.scan_parquet(fleet.logs_uri).collect()
    kinds = {Path(path).name: (status, failure) for path, status, failure in rows.select("path", "status", "failure").iter_rows()}
    # two copies of one log are one row; no rule names the machine of the last
    assert kinds.pop("c.mcap") == ("failed", "machine")
    assert list(kinds.values()) == [("analysed", None)] and fleet.totals["copies"] == 1, kinds
    shutil.rmtree(forwarder, ignore_errors=True)
