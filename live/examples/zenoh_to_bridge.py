"""Reads the topics of ROS 2 from Zenoh (rmw_zenoh) and writes them as a stream of MCAP, for `tipwatch-live bridge --mcap`.

usage: zenoh_to_bridge.py [--domain N] [--connect ENDPOINT | --listen ENDPOINT] TOPIC... | tipwatch-live bridge --mcap --machine FILE

It needs the Python packages eclipse-zenoh and mcap. rmw_zenoh publishes a topic under DOMAIN/TOPIC/TYPE/HASH and
attaches to every message its sequence number, its time and the identity of its publisher. Each publisher becomes a
channel of its own, so that the bridge sees losses, restarts, and two publishers of one topic.
"""

import argparse
import json
import struct
import sys
import threading
import time

import zenoh
from mcap.writer import Writer


def ros_type(name):
    """sensor_msgs/msg/Imu of sensor_msgs::msg::dds_::Imu_."""
    parts = name.split("::")
    if len(parts) == 4 and parts[2] == "dds_":
        return "/".join([parts[0], parts[1], parts[3].removesuffix("_")])
    return name


def attachment(payload):
    """Sequence number, time of sending (ns) and publisher: two integers of 64 bits, a length, 16 bytes."""
    raw = bytes(payload) if payload is not None else b""
    if len(raw) < 16:
        return 0, 0, b""
    sequence, sent_ns = struct.unpack_from("<qq", raw)
    return sequence, sent_ns, raw[17:33]


class Stream:
    """Messages as they come, each written at once."""

    def __init__(self, out):
        self.out = out
        self.writer = Writer(out, use_chunking=False)
        self.writer.start(profile="ros2", library="zenoh_to_bridge")
        self.channels = {}
        self.schemas = {}
        self.lock = threading.Lock()

    def take(self, sample):
        parts = str(sample.key_expr).split("/")
        # domain, topic with its own slashes, type, hash
        topic, kind = "/" + "/".join(parts[1:-2]), ros_type(parts[-2])
        sequence, sent_ns, publisher = attachment(sample.attachment)
        now = time.time_ns()
        with self.lock:
            if kind not in self.schemas:
                # the bridge has the definitions of common types
                self.schemas[kind] = self.writer.register_schema(name=kind, encoding="ros2msg", data=b"")
            key = (topic, kind, publisher)
            if key not in self.channels:
                self.channels[key] = self.writer.register_channel(
                    topic=topic,
                    message_encoding="cdr",
                    schema_id=self.schemas[kind],
                    metadata={"publisher": publisher.hex()},
                )
            self.writer.add_message(
                channel_id=self.channels[key],
                log_time=now,
                publish_time=sent_ns if sent_ns > 0 else now,
                data=bytes(sample.payload),
                sequence=sequence & 0xFFFFFFFF,
            )
            self.out.flush()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--domain", type=int, default=0)
    parser.add_argument("--connect")
    parser.add_argument("--listen")
    parser.add_argument("topics", nargs="+")
    arguments = parser.parse_args()
    config = zenoh.Config()
    for side in ("connect", "listen"):
        endpoint = getattr(arguments, side)
        if endpoint:
            config.insert_json5(f"{side}/endpoints", json.dumps([endpoint]))
    stream = Stream(sys.stdout.buffer)
    with zenoh.open(config) as session:
        subscribers = [
            session.declare_subscriber(f"{arguments.domain}/{topic.strip('/')}/*/*", stream.take)
            for topic in arguments.topics
        ]
        print(f"zenoh: {len(subscribers)} topics", file=sys.stderr)
        try:
            while True:
                time.sleep(1)
        except KeyboardInterrupt:
            pass


if __name__ == "__main__":
    main()
