"""Makes the files of this folder with independent writers: python-can, cantools, asammdf (requirements.txt).

    python make_fixtures.py FOLDER

`mixed.*` holds the same frames in every format; `frames.txt` lists them. `machine.*` holds messages of machine.dbc
with random contents; `decoded.csv` has what cantools reads in them: frame, signal, value in the DBC file's unit.
"""

import pathlib
import random
import sys

import asammdf
import can
import cantools
import numpy as np
from can.io.trc import TRCFileVersion

START = 1_700_000_000.0
HERE = pathlib.Path(__file__).parent


def mixed():
    kinds = [
        dict(arbitration_id=0x0CF02A21, is_extended_id=True, channel=0),
        dict(arbitration_id=0x123, is_extended_id=False, channel=1),
        dict(arbitration_id=0x18FEF100, is_extended_id=True, channel=0),
        dict(arbitration_id=0x7FF, is_extended_id=False, is_remote_frame=True, dlc=4, channel=0),
        dict(arbitration_id=0x321, is_extended_id=False, is_fd=True, bitrate_switch=True, channel=0),
        dict(arbitration_id=0, is_extended_id=False, is_error_frame=True, channel=0),
    ]
    lengths = [8, 4, 8, None, 16, None]
    for i in range(120):
        kind, length = kinds[i % 6], lengths[i % 6]
        data = {} if length is None else dict(data=bytes((i + j) & 255 for j in range(length)))
        yield can.Message(timestamp=START + i / 64, **kind, **data)


def messages(database):
    rng = random.Random(1)
    counter = 0
    for i in range(400):
        message = database.messages[i % len(database.messages)]
        data = bytearray(rng.randbytes(message.length))
        if message.name == "BoomState":
            # angles and pressures within their range, and a counter that counts
            data[0:2] = rng.randrange(-18000, 18001).to_bytes(2, "little", signed=True)
            data[2:4] = rng.randrange(0, 60001).to_bytes(2, "little")
            data[4:6] = rng.randrange(0, 4001).to_bytes(2, "little")
            data[6] = counter & 15
            data[7] = i & 255
            counter += 1
        elif message.name == "Multiplexed":
            data[0] = rng.choice([0, 1])
            data[1:3] = rng.randrange(0, 3001).to_bytes(2, "little")
        elif message.name == "Nested":
            data[0] = rng.choice([0, 1])
            data[1] = rng.choice([2, 3, 4, 8, 10])
        elif message.name in ("EEC1", "AxleLoads"):
            data = bytearray(rng.randrange(0, 0xFA) for _ in data)
        elif message.name == "Floats":
            data[0:4] = np.float32(rng.uniform(0, 80)).tobytes()
            data[4:8] = np.float32(rng.uniform(0, 30)).tobytes()[::-1]
        elif message.name == "Double":
            data[0:8] = np.float64(rng.uniform(-1, 1)).tobytes()
        source = 0x21 if message.frame_id & 0xFF == 0xFE and message.is_extended_frame else None
        identifier = message.frame_id if source is None else message.frame_id & ~0xFF | source
        yield message, can.Message(
            timestamp=START + i / 128,
            arbitration_id=identifier,
            is_extended_id=message.is_extended_frame,
            is_fd=message.length > 8,
            data=bytes(data),
            channel=0,
        )


def write(folder, name, frames, formats=("log", "asc", "blf", "mf4")):
    for extension in formats:
        with can.Logger(str(folder / f"{name}.{extension}")) as logger:
            for frame in frames:
                logger(frame)


def write_trc(folder, frames):
    """PCAN traces; python-can writes classical data frames only."""
    for name, version in [("classical", TRCFileVersion.V2_1), ("classical_1_0", TRCFileVersion.V1_0)]:
        writer = can.TRCWriter(str(folder / f"{name}.trc"))
        writer.file_version = version
        # the folder is no part of the file
        writer.filepath = f"{name}.trc"
        for frame in frames:
            if not (frame.is_fd or frame.is_error_frame or frame.is_remote_frame):
                writer(frame)
        writer.stop()


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    frames = list(mixed())
    write(folder, "mixed", frames)
    write_trc(folder, frames)
    with open(folder / "frames.txt", "w") as out:
        for m in frames:
            kind = "error" if m.is_error_frame else "remote" if m.is_remote_frame else "data"
            data = "" if kind != "data" else m.data.hex()
            identifier = "0" if kind == "error" else f"{m.arbitration_id:x}"
            out.write(f"{round((m.timestamp - START) * 1e9)} {m.channel} {kind} {identifier} "
                      f"{int(m.is_extended_id)} {int(m.is_fd)} {data}\n")
    # the same file with columns of bytes compressed instead of records, and uncompressed
    for compression, name in [(2, "transposed"), (0, "plain")]:
        with asammdf.MDF(str(folder / "mixed.mf4")) as mdf:
            mdf.save(str(folder / f"mixed_{name}.mf4"), overwrite=True, compression=compression)
    database = cantools.database.load_file(HERE / "machine.dbc", strict=False)
    sent = list(messages(database))
    write(folder, "machine", [frame for _, frame in sent], formats=("log",))
    with open(folder / "decoded.csv", "w") as out:
        for index, (message, frame) in enumerate(sent):
            values = message.decode(frame.data, decode_choices=False, allow_truncated=True)
            for signal, value in values.items():
                out.write(f"{index},{message.name},{signal},{float(value)!r}\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
