"""Sensors that are wrong but plausible. Each is a function that changes a sample's values in place."""

import math
import random

from session import HEADER, KINDS


def multiply(a, b):
    """The product of two quaternions x y z w."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]


def rotate(q, v):
    """The vector turned by a quaternion."""
    conjugate = [-q[0], -q[1], -q[2], q[3]]
    return multiply(multiply(q, [*v, 0.0]), conjugate)[:3]


def turned_imu(axis, degrees):
    """The housing stands turned by so much: q turns vectors of the true frame into that of the housing."""
    half = math.radians(degrees) / 2
    q = [0.0, 0.0, 0.0, math.cos(half)]
    q[axis] = -math.sin(half)
    back = [-q[0], -q[1], -q[2], q[3]]

    def change(sample, seconds):
        if sample.kind == KINDS["imu"]:
            sample.values[0:3] = rotate(q, sample.values[0:3])
            sample.values[3:6] = rotate(q, sample.values[3:6])
            sample.values[6:10] = multiply(sample.values[6:10], back)

    return change


class Joints:
    """Where the joints of the arm are in the samples: those that are neither wheels nor steering, by their names."""

    def __init__(self, session):
        names = [bytes(session.joint_names[k]).split(b"\0")[0].decode() for k in range(session.joint_count)]
        self.streams = list(session.joint_streams)[: session.joint_count]
        self.names = names
        self.arm = [k for k, name in enumerate(names) if not name.startswith(("wheel", "steer"))]

    def place(self, joint):
        """Stream and index of a joint's position."""
        stream = self.streams[joint]
        return stream, sum(1 for k in range(joint) if self.streams[k] == stream)

    def on(self, joint, act):
        """Lets `act(values, position, velocity)` change one joint."""
        stream, place = self.place(joint)

        def change(sample, seconds):
            if sample.kind == KINDS["joints"] and sample.stream == stream:
                act(sample.values, place, place + sample.value_count // 2)

        return change


def flip(values, position, velocity):
    values[position], values[velocity] = -values[position], -values[velocity]


def stand_still():
    """The first position for ever."""
    first = []

    def act(values, position, velocity):
        first.append(values[position])
        values[position], values[velocity] = first[0], 0.0

    return act


def stuck_imu(samples):
    """Mean of the log plus noise."""
    imu = [s for s in samples if s.kind == KINDS["imu"]]
    mean = [sum(s.values[k] for s in imu) / len(imu) for k in range(10)]
    norm = math.sqrt(sum(x * x for x in mean[6:10]))
    mean[6:10] = [x / norm for x in mean[6:10]]
    sigma = [0.03] * 3 + [0.002] * 3 + [0.0] * 4
    noise = random.Random(1)

    def change(sample, seconds):
        if sample.kind == KINDS["imu"]:
            sample.values[0:10] = [noise.gauss(m, s) for m, s in zip(mean, sigma)]

    return change


def drifting_imu(samples, axis):
    """Specific force that drifts to 2.9 m/s2 at the end of the log."""
    total_s = (samples[-1].log_time_ns - samples[0].log_time_ns) * 1e-9

    def change(sample, seconds):
        if sample.kind == KINDS["imu"]:
            sample.values[axis] += 2.9 * seconds / total_s

    return change


def swap(joints, a, b):
    """Two joints in each other's place."""
    (stream, one), (_, other) = joints.place(a), joints.place(b)

    def change(sample, seconds):
        if sample.kind == KINDS["joints"] and sample.stream == stream:
            half = sample.value_count // 2
            for offset in (0, half):
                i, k = one + offset, other + offset
                sample.values[i], sample.values[k] = sample.values[k], sample.values[i]

    return change


def wrong_sensors(session, samples):
    """All of them, by name."""
    joints = Joints(session)
    all_of = {
        "IMU turned by 180 degrees about z": turned_imu(2, 180),
        "IMU turned by 10 degrees about x": turned_imu(0, 10),
        "IMU turned by 10 degrees about y": turned_imu(1, 10),
        "IMU stuck at its mean plus noise": stuck_imu(samples),
        "specific force x drifting to 2.9 m/s2": drifting_imu(samples, 0),
        "specific force y drifting to 2.9 m/s2": drifting_imu(samples, 1),
    }
    for joint in joints.arm:
        all_of[f"{joints.names[joint]}: sign flipped"] = joints.on(joint, flip)
    for joint in joints.arm:
        all_of[f"{joints.names[joint]}: stands still"] = joints.on(joint, stand_still())
    for n, a in enumerate(joints.arm):
        for b in joints.arm[n + 1 :]:
            if joints.streams[a] == joints.streams[b]:
                all_of[f"{joints.names[a]} and {joints.names[b]} swapped"] = swap(joints, a, b)
    return all_of


# those that the short form runs
SHORT_SENSORS = {"IMU turned by 180 degrees about z", "slew: sign flipped", "slew: stands still", "slew and tilt swapped"}


def resealing(change):
    """As a change of a whole session."""

    def send(session, sample, seconds):
        change(sample, seconds)
        return [session.sealed(sample)]

    return send


__all__ = ["HEADER", "SHORT_SENSORS", "resealing", "wrong_sensors"]
