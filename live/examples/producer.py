#!/usr/bin/env python3
"""A machine that is not written in Rust publishes its samples to tipwatch-live.

    pip install iceoryx2==0.10.0
    tipwatch-live monitor --machine tests/data/tiny.toml --stay &
    python live/examples/producer.py tests/data/tiny.toml tests/data/tiny.urdf

Sends joint states, an IMU and odometry a hundred times a second, of a machine that stands and slews its arm a little:
every sensor that the machine file binds. With --pace 4 its clock runs four times as fast as real time. The
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
    arguments = example_arguments(__doc__, pace=1.0)
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
    announced.pace = arguments.pace
    # stamps are Unix time: both clocks, read at one moment
    first_ns, announced.clock_host_ns = time.time_ns(), time.monotonic_ns()
    announced.clock_stamp_ns = first_ns
    announced.has_imu = 1
    announced.has_odometry = 1
    announced.stream_count = 1
    announced.joint_count = len(joints)
    for place, joint in enumerate(joints):
        announced.joint_names[place][: len(joint)] = joint.encode()
    session.send(source, machine_hash, 0)

    start = announced.clock_host_ns * 1e-9
    sample = samples.message
    for step in range(round(arguments.seconds / PERIOD_S)):
        elapsed = step * PERIOD_S
        time.sleep(max(0.0, start + elapsed / arguments.pace - time.monotonic()))
        # late joiners get the session
        session.publisher.update_connections()
        stamp_ns = first_ns + round(elapsed * 1e9)
        sample.kind, sample.stream, sample.value_count = imu_kind, 0, 10
        # a sensor has noise: one that repeats itself while the arm moves is taken for frozen
        force = [random.gauss(mean, 0.02) for mean in (0.0, 0.0, 9.8066)]
        turning = [random.gauss(0.0, 0.001) for _ in range(3)]
        sample.values[:10] = [*force, *turning, 0.0, 0.0, 0.0, 1.0]
        samples.send(source, machine_hash, stamp_ns)
        sample.kind, sample.value_count = odometry_kind, 10
        # it stands: velocity, angular velocity, attitude
        velocity = [random.gauss(0.0, 0.001) for _ in range(6)]
        sample.values[:10] = [*velocity, 0.0, 0.0, 0.0, 1.0]
        samples.send(source, machine_hash, stamp_ns)
        # by sine, so that the rate is known too; so little that the platform need not lean on its tyres: it does not in the
        # samples of the IMU, and the monitor would find that the two contradict each other
        joints["slew"] = 0.02 * math.sin(0.5 * elapsed)
        rates = {"slew": 0.01 * math.cos(0.5 * elapsed)}
        values = list(joints.values()) + [rates.get(joint, 0.0) for joint in joints]
        sample.kind, sample.value_count = joint_kind, len(values)
        sample.values[: len(values)] = values
        samples.send(source, machine_hash, stamp_ns)
    sample.kind, sample.value_count = end_kind, 0
    samples.send(source, machine_hash, 0)
    # the memory lives until readers have read the end
    time.sleep(0.5)


if __name__ == "__main__":
    main()
