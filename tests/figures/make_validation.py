"""Makes book/src/pictures/validation_{before,after}.png: validation of a machine whose masses and centres of mass are
wrong, before and after `tipwatch identify`.

    python3 make_validation.py LOG TIPWATCH

LOG is a simulated log with .toml, .urdf and .truth.parquet beside it, TIPWATCH the program. Needs polars, mcap and
Chromium. The load cells are the simulator's contact forces with a noise of 30 N.
"""

import random
import re
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import polars as pl
from mcap.reader import make_reader
from mcap.writer import Writer

LOG, PROGRAM = Path(sys.argv[1]), sys.argv[2]
PICTURES = Path(__file__).parent / "../../book/src/pictures"
LINE = "=" * 80
DEFINITION = f"""std_msgs/Header header
float64 fl
float64 fr
float64 rl
float64 rr
{LINE}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{LINE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
WHEELS = ["fl", "fr", "rl", "rr"]


def with_loads(path):
    truth = pl.read_parquet(LOG.with_suffix(".truth.parquet")).gather_every(5)
    noise = random.Random(1)
    with open(LOG, "rb") as source, open(path, "wb") as target:
        reader, writer = make_reader(source), Writer(target)
        writer.start("ros2")
        channels = {}
        for schema, channel, message in reader.iter_messages():
            if channel.id not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, known)
            writer.add_message(channels[channel.id], message.log_time, message.data, message.publish_time)
        own = writer.register_schema("test_msgs/msg/WheelLoads", "ros2msg", DEFINITION.encode())
        own = writer.register_channel("/wheel_loads", "cdr", own)
        for time, *loads in truth.select(["t_ns"] + [f"load_{w}" for w in WHEELS]).iter_rows():
            loads = [load + noise.gauss(0, 30) for load in loads]
            data = struct.pack("<4BiI8B4d", 0, 1, 0, 0, time // 10**9, time % 10**9, 1, 0, 0, 0, 0, 0, 0, 0, *loads)
            writer.add_message(own, time, data, time)
        writer.finish()


def wrong(urdf):
    """Masses off by 5 %, centres of mass by 3 cm."""
    draw = random.Random(2)
    side = lambda: draw.choice([-1, 1])
    moved = lambda m: "<inertial><origin xyz='" + " ".join(str(float(x) + 0.03 * side()) for x in m[1].split())
    urdf = re.sub(r"<inertial><origin xyz='([^']*)", moved, urdf)
    return re.sub(r"mass value='([^']*)", lambda m: f"mass value='{float(m[1]) * (1 + 0.05 * side())}", urdf)


def picture(page, name):
    screenshot = PICTURES / f"{name}.png"
    subprocess.run(
        ["chromium", "--headless", "--no-sandbox", "--hide-scrollbars", "--virtual-time-budget=8000",
         "--window-size=1000,1180", f"--screenshot={screenshot}", f"file://{page}"],
        check=True, stderr=subprocess.DEVNULL,
    )
    subprocess.run([sys.executable, "-c", f"""
from PIL import Image
image = Image.open({str(screenshot)!r}).convert('RGB')
image.quantize(64).save({str(screenshot)!r}, optimize=True)
"""], check=False)


with tempfile.TemporaryDirectory() as folder:
    folder = Path(folder)
    log, before, after = folder / "arm.mcap", folder / "machine.toml", folder / "identified.toml"
    with_loads(log)
    (folder / "machine.urdf").write_text(wrong(LOG.with_suffix(".urdf").read_text()))
    text = LOG.with_suffix(".toml").read_text().replace(LOG.with_suffix(".urdf").name, "machine.urdf")
    for wheel in WHEELS:
        text += f'\n[signals.wheels.{wheel.upper()}]\nload = {{ topic = "/wheel_loads", field = "{wheel}" }}\nsigma = 60.0\n'
    before.write_text(text + "\n[uncertainty]\nmass_share = 0.05\ncom = 0.03\n")
    print(subprocess.run([PROGRAM, "identify", log, "--machine", before, "--out", after],
                         stdout=subprocess.PIPE, text=True).stdout)
    for file, name in [(before, "validation_before"), (after, "validation_after")]:
        page = folder / f"{name}.html"
        subprocess.run([PROGRAM, "validate", log.name, "--machine", file.name, "--out", page.name], cwd=folder)
        picture(page, name)
