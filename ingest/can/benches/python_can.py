"""Decodes every frame of FILE by a DBC file, as a user of python-can and cantools does. Prints frames, signals, seconds.

`python python_can.py convert FROM TO` writes a file in another format.
"""

import sys
import time

import can
import cantools


def convert(source, target):
    with can.LogReader(source) as frames, can.Logger(target) as logger:
        for frame in frames:
            logger(frame)


def decode(path, dbc):
    database = cantools.database.load_file(dbc)
    frames = signals = 0
    start = time.perf_counter()
    with can.LogReader(path) as source:
        for frame in source:
            frames += 1
            signals += len(database.decode_message(frame.arbitration_id, frame.data, decode_choices=False))
    print(f"{frames}\t{signals}\t{time.perf_counter() - start}")


if sys.argv[1] == "convert":
    convert(*sys.argv[2:])
else:
    decode(*sys.argv[1:])
