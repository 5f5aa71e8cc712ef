"""Reads a derived.mcap as other programs do: the official Python reader, and Rerun's importer.

    pip install mcap mcap-ros2-support polars rerun-sdk
    python analyze/tests/readers/derived.py RESULTS

RESULTS is a folder that `tipwatch analyze --out` wrote. Every number of every flat message is compared
with the row of samples.parquet at its time; Rerun must find every topic.
"""

import math
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    import polars
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory
except ModuleNotFoundError as missing:
    sys.exit(f"{missing}: pip install mcap mcap-ros2-support polars rerun-sdk")

FLAT = ["loads", "margins", "causes", "indicators"]
LEVELS = ["unknown", "safe", "notice", "warning", "danger", "fault", "assumed"]


def check_python(results: Path) -> None:
    samples = polars.read_parquet(results / "samples.parquet").to_dict(as_series=False)
    row_of = {time: row for row, time in enumerate(samples["time_ns"])}
    rows = dict.fromkeys(FLAT, 0)
    compared = 0
    markers = statuses = verdicts = 0
    with open(results / "derived.mcap", "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        attached = {a.name: a.data for a in reader.iter_attachments()}
        assert attached["report.html"] == (results / "report.html").read_bytes()
        assert {"machine.toml", "machine.urdf"} <= attached.keys()
        for _, channel, message, decoded in reader.iter_decoded_messages():
            name = channel.topic.removeprefix("/tipwatch/")
            markers += len(getattr(decoded, "markers", []))
            statuses += len(getattr(decoded, "status", []))
            if name == "verdict":
                row = row_of[message.log_time]
                assert LEVELS[int(decoded.level)] == samples["verdict"][row], f"verdict of row {row}"
                verdicts += 1
            if name not in FLAT:
                continue
            row = row_of[message.log_time]
            rows[name] += 1
            for field in decoded.__slots__:
                if field == "header":
                    continue
                found, expected = getattr(decoded, field), samples[field][row]
                same = math.isnan(found) if expected is None else found == expected
                assert same, f"{channel.topic} {field}, row {row}: {found} is not {expected}"
                compared += 1
    count = verdicts
    assert 0 < count < len(row_of) and statuses > 0
    assert all(found in (0, count) for found in rows.values()), rows
    print(f"mcap, mcap_ros2: {count} rows, {compared} numbers and {verdicts} verdicts equal; {markers} markers, {statuses} statuses")


def check_rerun(results: Path) -> None:
    rerun = shutil.which("rerun", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    assert rerun, "expected rerun-sdk to be installed"
    environment = {**os.environ, "RERUN_ANALYTICS": "0"}
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "derived.rrd"
        subprocess.run([rerun, "mcap", "convert", results / "derived.mcap", "-o", recording],
                       check=True, env=environment, capture_output=True)
        statistics = subprocess.run([rerun, "rrd", "stats", recording], check=True, env=environment,
                              capture_output=True, text=True).stdout
    for name in ["/tipwatch/loads", "/tipwatch/margins", "/tipwatch/indicators", "/tipwatch/verdict", "/tipwatch/markers", "/diagnostics"]:
        assert name in statistics, f"Rerun found no {name}"
    print("rerun: every topic found")


if __name__ == "__main__":
    check_python(Path(sys.argv[1]))
    check_rerun(Path(sys.argv[1]))
