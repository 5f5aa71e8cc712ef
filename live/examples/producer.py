#!/usr/bin/env python3
"""A machine that is not written in Rust publishes its samples to tipwatch-live.

    pip install iceoryx2==0.10.0
    tipwatch-live monitor --machine tests/data/tiny.toml --stay &
    python live/examples/producer.py tests/data/tiny.toml tests/data/tiny.urdf

Sends joint states, an IMU and odometry a hundred times a second, of a machine that stands and slews its arm:
every sensor that the machine file binds. The
messages are those of live/include/tipwatch_live.h, which this program reads: there is one description of
the wire. In C or C++ include that header and use iceoryx2's own binding in the same way.
"""

import argparse
import ctypes
import math
import pathlib
import random
import re
import secrets
import time
import zlib

import iceoryx2 as iox2

HEADER = pathlib.Path(__file__).parent.parent / "include" / "tipwatch_live.h"
C_TYPES = {
    "uint8_t": ctypes.c_uint8,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
    "double": ctypes.c_double,
}
JOINTS, IMU, ODOMETRY, END = 1, 2, 3, 5
PERIOD_S = 0.01


def read_wire():
    """Numbers, texts and message types of the C header."""
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.S)
    wire = {name: int(n) for name, n in re.findall(r"#define TIPWATCH_(\w+) UINT64_C\((\d+)\)", text)}
    wire |= dict(re.findall(r'#define TIPWATCH_(\w+) "([^"]*)"', text))
    for name, body in re.findall(r"struct tipwatch_(\w+) \{(.*?)\};", text, flags=re.S):
        fields = []
        for c_type, field, dimensions in re.findall(r"(\w+) (\w+)((?:\[\d+\])*);", body):
            field_type = C_TYPES[c_type]
            for n in reversed(re.findall(r"\d+", dimensions)):
                field_type = field_type * int(n)
            fields.append((field, field_type))
        type_name = staticmethod(lambda name=wire[f"{name.upper()}_TYPE"]: name)
        wire[name] = type(name, (ctypes.Structure,), {"_fields_": fields, "type_name": type_name})
    return wire


def fnv(*texts):
    """The hash by which both ends know that they mean one machine: FNV-1a over texts and lengths."""
    hashed = 0xCBF29CE484222325
    for text in texts:
        for byte in text + len(text).to_bytes(8, "little"):
            hashed = (hashed ^ byte) * 0x100000001B3 % 2**64
    return hashed


class Topic:
    """The writing end of a service, with the settings that all ends state."""

    def __init__(self, node, service, wire, kind, queue, is_kept):
        self.message = wire[kind]()
        self.message.magic = wire["MAGIC"]
        upper = kind.upper()
        attribute = iox2.AttributeVerifier.new().require(
            iox2.AttributeKey.new(wire["LAYOUT_ATTRIBUTE"]),
            iox2.AttributeValue.new(wire[f"{upper}_LAYOUT"]),
        )
        self.service = (
            node.service_builder(iox2.ServiceName.new(service))
            .publish_subscribe(wire[kind])
            .enable_safe_overflow(True)
            .history_size(1 if is_kept else 0)
            .subscriber_max_buffer_size(queue)
            .subscriber_max_borrowed_samples(wire["MAX_BORROWED"])
            .max_publishers(wire["ONE_WRITER"])
            .max_subscribers(wire["MAX_READERS"])
            .max_nodes(wire["MAX_NODES"])
            .open_or_create_with_attributes(attribute)
        )
        self.publisher = self.service.publisher_builder().create()
        self.sequence = 0

    def send(self, source, machine_hash, time_ns):
        """Gives the message its head and checksum, and sends it. Never waits: queues overwrite."""
        message = self.message
        message.sequence = self.sequence
        message.source = source
        message.machine_hash = machine_hash
        message.time_ns = time_ns
        message.published_ns = time.monotonic_ns()
        message.checksum = zlib.crc32(bytes(message)[:-8])
        self.publisher.send_copy(message)
        self.sequence += 1


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("machine", type=pathlib.Path)
    arguments.add_argument("urdf", type=pathlib.Path)
    arguments.add_argument("--service", default=None)
    arguments.add_argument("--prefix", default=None)
    arguments.add_argument("--seconds", type=float, default=10.0)
    arguments = arguments.parse_args()

    wire = read_wire()
    name = arguments.service or wire["DEFAULT_SERVICE"]
    iox2.set_log_level(iox2.LogLevel.Error)
    config = iox2.config.default()
    if arguments.prefix:
        config.global_cfg.prefix = iox2.FileName.new(arguments.prefix)
    builder = iox2.NodeBuilder.new().config(config).name(iox2.NodeName.new("producer"))
    node = builder.create(iox2.ServiceType.Ipc)
    session = Topic(node, name + wire["SESSION_SUFFIX"], wire, "session", wire["LATEST"], True)
    samples = Topic(node, name + wire["SAMPLES_SUFFIX"], wire, "sample", wire["SAMPLE_QUEUE"], False)

    machine_hash = fnv(arguments.machine.read_bytes(), arguments.urdf.read_bytes())
    source = secrets.randbits(64)
    joints = {
        "lift": -1.33,
        "tilt": -1.9,
        "slew": 0.0,
        "extension": 0.1,
        **{f"steer_{wheel}": 0.0 for wheel in ("fl", "fr")},
        **{f"wheel_{wheel}": 0.0 for wheel in ("fl", "fr", "rl", "rr")},
    }
    announced = session.message
    announced.pace = 1.0
    # stamps are Unix time: both clocks, read at one moment
    announced.clock_stamp_ns, announced.clock_host_ns = time.time_ns(), time.monotonic_ns()
    announced.has_imu = 1
    announced.has_odometry = 1
    announced.stream_count = 1
    announced.joint_count = len(joints)
    for place, joint in enumerate(joints):
        announced.joint_names[place][: len(joint)] = joint.encode()
    session.send(source, machine_hash, 0)

    start = time.monotonic()
    sample = samples.message
    while (elapsed := time.monotonic() - start) < arguments.seconds:
        # late joiners get the session
        session.publisher.update_connections()
        now_ns = time.time_ns()
        sample.kind, sample.stream, sample.value_count = IMU, 0, 10
        # a sensor has noise: one that repeats itself while the arm moves is taken for frozen
        force = [random.gauss(mean, 0.02) for mean in (0.0, 0.0, 9.8066)]
        turning = [random.gauss(0.0, 0.001) for _ in range(3)]
        sample.values[:10] = [*force, *turning, 0.0, 0.0, 0.0, 1.0]
        samples.send(source, machine_hash, now_ns)
        sample.kind, sample.value_count = ODOMETRY, 10
        # it stands: velocity, angular velocity, attitude
        velocity = [random.gauss(0.0, 0.001) for _ in range(6)]
        sample.values[:10] = [*velocity, 0.0, 0.0, 0.0, 1.0]
        samples.send(source, machine_hash, now_ns)
        # by sine, so that the rate is known too
        joints["slew"] = 0.8 * math.sin(0.5 * elapsed)
        rates = {"slew": 0.4 * math.cos(0.5 * elapsed)}
        values = list(joints.values()) + [rates.get(joint, 0.0) for joint in joints]
        sample.kind, sample.value_count = JOINTS, len(values)
        sample.values[: len(values)] = values
        samples.send(source, machine_hash, now_ns)
        time.sleep(max(0.0, PERIOD_S - (time.monotonic() - start - elapsed)))
    sample.kind, sample.value_count = END, 0
    samples.send(source, machine_hash, 0)
    # the memory lives until readers have read the end
    time.sleep(0.5)


if __name__ == "__main__":
    main()
