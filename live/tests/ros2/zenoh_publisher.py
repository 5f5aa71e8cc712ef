"""Publishes a log on Zenoh as rmw_zenoh does: CDR under DOMAIN/TOPIC/TYPE/HASH, with its attachment.

usage: zenoh_publisher.py DOMAIN LOG ENDPOINT [LOSE_EVERY]

With LOSE_EVERY, one of so many messages of /imu/data gets its sequence number and is not sent.
It needs the Python packages eclipse-zenoh and mcap.
"""

import json
import struct
import sys
import time

import zenoh
from mcap.reader import make_reader

HASH = "RIHS01_" + "0" * 64


def main():
    domain, log, endpoint = sys.argv[1:4]
    lose_every = int(sys.argv[4]) if len(sys.argv) > 4 else 0
    config = zenoh.Config()
    config.insert_json5("listen/endpoints", json.dumps([endpoint]))
    with zenoh.open(config) as session, open(log, "rb") as file:
        time.sleep(2.0)
        publishers, sequences = {}, {}
        start = first = None
        count = 0
        for schema, channel, message in make_reader(file).iter_messages():
            if first is None:
                start, first = time.monotonic(), message.log_time
            delay = start + (message.log_time - first) * 1e-9 - time.monotonic()
            if delay > 0:
                time.sleep(delay)
            package, kind, name = schema.name.split("/")
            key = f"{domain}{channel.topic}/{package}::{kind}::dds_::{name}_/{HASH}"
            sequences[key] = sequences.get(key, 0) + 1
            if key not in publishers:
                publishers[key] = session.declare_publisher(key)
            if lose_every and channel.topic == "/imu/data" and sequences[key] % lose_every == 0:
                continue
            gid = bytes([16]) + bytes([len(publishers)] * 16)
            publishers[key].put(message.data, attachment=struct.pack("<qq", sequences[key], time.time_ns()) + gid)
            count += 1
        print(f"sent {count}")
        time.sleep(0.5)


if __name__ == "__main__":
    main()
