#!/usr/bin/env python3
"""A machine that is not written in Rust publishes its samples to tipwatch-live.

    pip install iceoryx2==0.10.0
    tipwatch-live monitor --machine tests/data/tiny.toml --stay &
    python live/examples/producer.py tests/data/tiny.toml tests/data/tiny.urdf

Sends joint states, an IMU and odometry a hundred times a second, of a machine that stands and slews its arm:
every sensor that the machine file binds. The
messages are those of live/include/tipwatch_live.h, which wire.py reads: there is one description of
the wire. Every sample rings the event, so that the monitor takes it at once.
"""

import math
import random
import secrets
import time

from wire import Header, Node, Writer, example_arguments

PERIOD_S = 0.01


def main():
    arguments = example_arguments(__doc__)
    header = Header()
    node = Node(header, "producer", arguments.service, arguments.prefix)
    session, samples = Writer(node, "session"), Writer(node, "sample")
    joint_kind, imu_kind, odometry_kind, end_kind = (
        header.number("kind", name) for name in ("joints", "imu", "odometry", "end")
    )

    machine_hash = header.hash([arguments.machine.read_bytes(), arguments.urdf.read_bytes()])
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
        sample.kind, sample.stream, sample.value_count = imu_kind, 0, 10
        # a sensor has noise: one that repeats itself while the arm moves is taken for frozen
        force = [random.gauss(mean, 0.02) for mean in (0.0, 0.0, 9.8066)]
        turning = [random.gauss(0.0, 0.001) for _ in range(3)]
        sample.values[:10] = [*force, *turning, 0.0, 0.0, 0.0, 1.0]
        samples.send(source, machine_hash, now_ns)
        sample.kind, sample.value_count = odometry_kind, 10
        # it stands: velocity, angular velocity, attitude
        velocity = [random.gauss(0.0, 0.001) for _ in range(6)]
        sample.values[:10] = [*velocity, 0.0, 0.0, 0.0, 1.0]
        samples.send(source, machine_hash, now_ns)
        # by sine, so that the rate is known too
        joints["slew"] = 0.8 * math.sin(0.5 * elapsed)
        rates = {"slew": 0.4 * math.cos(0.5 * elapsed)}
        values = list(joints.values()) + [rates.get(joint, 0.0) for joint in joints]
        sample.kind, sample.value_count = joint_kind, len(values)
        sample.values[: len(values)] = values
        samples.send(source, machine_hash, now_ns)
        time.sleep(max(0.0, PERIOD_S - (time.monotonic() - start - elapsed)))
    sample.kind, sample.value_count = end_kind, 0
    samples.send(source, machine_hash, 0)
    # the memory lives until readers have read the end
    time.sleep(0.5)


if __name__ == "__main__":
    main()
