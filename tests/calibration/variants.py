"""Change the clean log of a manoeuvre: noise, holes, vibration, and sensors that are wrong.

    .venv/bin/python variants.py LAB FOLDER OUT.mcap [--seed N] [KIND KEY=VALUE ...]...
    .venv/bin/python variants.py LAB FOLDER --list

LAB is the folder of the simulation laboratory, FOLDER one that `manoeuvres.py` wrote. Each KIND is a function of this file, with its parameters as
KEY=VALUE; several are applied one after the other. `--list` prints the variants of the matrix for this log.

    variants.py LAB logs/set/rigid.arm_work out.mcap --seed 1 joint_sign joint=slew hole topic=/odom begin=4 seconds=0.4

Kinds of SOUND leave sensors sound: what they change happens in every fleet. Kinds of WRONG make one sensor wrong. Kinds that act on what the sensor
measures are applied before the noise, those that act on what it sends or what is recorded afterwards.
"""
import argparse
import itertools
import json
import math
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "data"))
from fixture_tools import typestore    # noqa: E402

SOUND, WRONG = {}, {}
G = 9.8066
OUTRIGGER_N = 100.0    # standard deviation, as in make_supports
IMU, JOINTS, ODOMETRY = "/imu/data", "/joint_states", "/odom"
# vectors of numbers in the messages, by type
VECTORS = {
    "sensor_msgs/msg/Imu": ["orientation", "angular_velocity", "linear_acceleration"],
    "sensor_msgs/msg/JointState": ["position", "velocity"],
    "nav_msgs/msg/Odometry": ["pose.pose.position", "pose.pose.orientation", "twist.twist.linear", "twist.twist.angular"],
    "geometry_msgs/msg/WrenchStamped": ["wrench.force", "wrench.torque"],
    "std_msgs/msg/Float64MultiArray": ["data"],
}


# ---- logs as arrays

class Stream:
    """The messages of a topic: all of one size, so that each vector of numbers is an array of one row per message."""

    def __init__(self, schema, raws, types):
        self.schema = schema
        size = len(raws[0].data)
        assert all(len(raw.data) == size for raw in raws), schema.name
        self.data = np.frombuffer(b"".join(raw.data for raw in raws), np.uint8).reshape(-1, size).copy()
        self.log_ns = np.array([raw.log_time for raw in raws], np.int64)
        self.first = types.deserialize_cdr(raws[0].data, schema.name)
        self.places = {}
        for path in VECTORS.get(schema.name, []):
            value = self.first
            for name in path.split("."):
                value = getattr(value, name)
            width = len(value) if isinstance(value, np.ndarray) else 4 if hasattr(value, "w") else 3
            self.places[path] = self.place(types, path, width), width

    def place(self, types, path, width):
        """Where a vector begins: the same message with a mark in its place differs from there on."""
        *parents, last = path.split(".")
        holder = types.deserialize_cdr(self.data[0].tobytes(), self.schema.name)
        marked = holder
        for name in parents:
            marked = getattr(marked, name)
        mark = np.arange(1, width + 1) * 1.2345e99
        value = getattr(marked, last)
        if isinstance(value, np.ndarray):
            object.__setattr__(marked, last, mark)
        else:
            for axis, number in zip("xyzw", mark):
                object.__setattr__(value, axis, float(number))
        return bytes(types.serialize_cdr(holder, self.schema.name)).index(mark.tobytes())

    def array(self, path):
        """A view into the messages: what is written to it is written to the log."""
        offset, width = self.places[path]
        size = self.data.shape[1]
        return np.ndarray((len(self.data), width), "<f8", self.data, offset, (size, 8))

    @property
    def t(self):
        """Seconds after the origin of the laboratory's clock, by the headers, or without one by the log."""
        import writelog
        if not hasattr(self.first, "header"):
            return (self.log_ns - writelog.T0) * 1e-9
        seconds = np.ndarray((len(self.data),), "<i4", self.data, 4, (self.data.shape[1],)).astype(np.int64)
        nanoseconds = np.ndarray((len(self.data),), "<u4", self.data, 8, (self.data.shape[1],)).astype(np.int64)
        return (seconds * 10**9 + nanoseconds - writelog.T0) * 1e-9

    def keep(self, which):
        self.data, self.log_ns = np.ascontiguousarray(self.data[which]), self.log_ns[which]


class Log:
    """A log in memory, with the truth of its manoeuvre."""

    def __init__(self, folder, most=None):
        """`most`: so many messages from the beginning; enough to know topics and joints."""
        from mcap.reader import make_reader
        types, raws, schemas = typestore(), {}, {}
        with open(Path(folder) / "clean.mcap", "rb") as file:
            for schema, channel, raw in itertools.islice(make_reader(file).iter_messages(), most):
                raws.setdefault(channel.topic, []).append(raw)
                schemas[channel.topic] = schema
        self.streams = {topic: Stream(schemas[topic], messages, types) for topic, messages in raws.items()}
        self.truth = json.loads((Path(folder) / "truth.json").read_text())

    def copy(self):
        other = object.__new__(Log)
        other.truth = self.truth
        other.streams = {}
        for topic, stream in self.streams.items():
            twin = object.__new__(Stream)
            twin.__dict__ = stream.__dict__ | {"data": stream.data.copy(), "log_ns": stream.log_ns.copy()}
            other.streams[topic] = twin
        return other

    def array(self, topic, path):
        return self.streams[topic].array(path)

    def names(self):
        return list(self.streams[JOINTS].first.name)

    def joints(self, *joints):
        """Indices of joints by name."""
        return [self.names().index(joint) for joint in joints]

    def both(self):
        """Positions and velocities of the joints."""
        return self.array(JOINTS, "position"), self.array(JOINTS, "velocity")

    def write(self, path):
        from mcap.writer import CompressionType, Writer
        every = [(int(ns), topic, k) for topic, stream in self.streams.items() for k, ns in enumerate(stream.log_ns)]
        every.sort(key=lambda message: message[0])
        with open(path, "wb") as file:
            writer = Writer(file, chunk_size=1 << 20, compression=CompressionType.LZ4)
            writer.start(profile="ros2", library="tipwatch calibration")
            channels = {}
            for topic, stream in self.streams.items():
                schema = writer.register_schema(stream.schema.name, stream.schema.encoding, stream.schema.data)
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            for ns, topic, k in every:
                writer.add_message(channels[topic], ns, self.streams[topic].data[k].tobytes(), ns, k + 1)
            writer.finish()


def sound(function):
    SOUND[function.__name__] = function
    return function


def wrong(function):
    WRONG[function.__name__] = function
    return function


def turned(q, e):
    """Quaternions x y z w turned by rotation vectors (of any size, in the frame that q turns from)."""
    angle = np.linalg.norm(e, axis=-1, keepdims=True)
    s = np.where(angle > 1e-12, np.sin(angle / 2) / np.maximum(angle, 1e-12), 0.5)
    return product(q, np.concatenate([s * e, np.cos(angle / 2)], axis=-1))


def product(a, b):
    x1, y1, z1, w1 = np.moveaxis(a, -1, 0)
    x2, y2, z2, w2 = np.moveaxis(b, -1, 0)
    out = np.stack([w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2, w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
                    w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2, w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2], -1)
    return out / np.linalg.norm(out, axis=-1, keepdims=True)


def conjugate(q):
    return q * np.array([-1, -1, -1, 1])


def rotate(q, v):
    """Vectors turned by quaternions."""
    r, w = q[..., :3], q[..., 3:]
    return v + 2 * np.cross(r, np.cross(r, v) + w * v)


# ---- what leaves sensors sound

@sound
def noise(log, seed, scale=1.0):
    """The laboratory's noise, quantisation and publish delays; each log has its own, by its name."""
    from noise import NOISE as n
    rng = np.random.default_rng([zlib.crc32(f"{log.truth['set']}/{log.truth['log']}".encode()), int(seed)])
    normal = lambda name, shape: rng.normal(0, scale * n[name], shape)
    for stream in log.streams.values():
        count, kind = len(stream.data), stream.schema.name
        if kind == "sensor_msgs/msg/JointState":
            position, velocity = stream.array("position"), stream.array("velocity")
            position[:] = np.round((position + normal("position", position.shape)) / n["encoder_step"]) * n["encoder_step"]
            velocity += normal("velocity", velocity.shape)
        elif kind == "sensor_msgs/msg/Imu":
            force, rate, attitude = stream.array("linear_acceleration"), stream.array("angular_velocity"), stream.array("orientation")
            force += normal("accelerometer_bias", 3) + normal("accelerometer", (count, 3))
            rate += normal("gyro_bias", 3) + normal("gyro", (count, 3))
            attitude[:] = turned(attitude, normal("attitude", (count, 3)))
        elif kind == "nav_msgs/msg/Odometry":
            stream.array("twist.twist.linear")[:] += normal("odometry", (count, 3))
            stream.array("twist.twist.angular")[:] += rng.normal(0, scale * 2e-3, (count, 3))
        elif kind == "std_msgs/msg/Float64MultiArray":    # forces on the outriggers of the crane
            force = stream.array("data")
            force[:] = np.round(force + rng.normal(0, scale * OUTRIGGER_N, force.shape))
        stream.log_ns += (rng.uniform(0.2, 3.0, count) * 1e6).astype(np.int64)


@sound
def begins(log, seconds):
    """The log begins in motion."""
    for stream in log.streams.values():
        stream.keep(stream.t >= float(seconds))


@sound
def begins_falling(log, seconds):
    """The log begins while the machine falls."""
    begins(log, seconds)


@sound
def ends(log, seconds):
    """The log ends early."""
    for stream in log.streams.values():
        stream.keep(stream.t < float(seconds))


@sound
def hole(log, topic, begin, seconds):
    """The recorder lost a topic for a while."""
    stream = log.streams[topic]
    stream.keep((stream.t < float(begin)) | (stream.t >= float(begin) + float(seconds)))


@sound
def late(log, topic, seconds=1.0):
    """A topic begins later than the others."""
    stream = log.streams[topic]
    stream.keep(stream.t >= float(seconds))


@sound
def vibration(log, amplitude, hertz, gyro=0.004):
    """An engine shakes the accelerometer [m/s2], and the gyro by a share of it [rad/s per m/s2], at a frequency that wanders by 5 %."""
    t = log.streams[IMU].t
    amplitude, hertz = float(amplitude), float(hertz)
    phase = 2 * math.pi * hertz * (t + 0.05 / 0.4 * np.sin(0.4 * t))
    shape = np.stack([0.5 * np.sin(phase + 0.7), 0.6 * np.sin(phase + 2.1), np.sin(phase)], -1)
    log.array(IMU, "linear_acceleration")[:] += amplitude * shape
    log.array(IMU, "angular_velocity")[:] += float(gyro) * amplitude * shape[:, [1, 0, 2]]


@sound
def spike(log, at, size=30.0, seconds=0.005):
    """A short knock or a disturbed transfer: one or two samples of the accelerometer."""
    t = log.streams[IMU].t
    hit = (t >= float(at)) & (t < float(at) + float(seconds))
    log.array(IMU, "linear_acceleration")[hit] += float(size) * np.array([0.6, -0.5, 0.6])


@sound
def wheels_wrapped(log, start=-math.pi):
    """Angles of wheels start anew after each turn, at `start`."""
    position = log.both()[0]
    for k in named(log, "wheel_"):
        position[:, k] = np.mod(position[:, k] - float(start), 2 * math.pi) + float(start)


@sound
def coarse(log, force=0.0, gyro=0.0, position=0.0):
    """Sensors that do not resolve their noise: steps of a specific force [m/s2], an angular velocity [rad/s] and a position [rad or m]."""
    for values, step in ((log.array(IMU, "linear_acceleration"), force), (log.array(IMU, "angular_velocity"), gyro), (log.both()[0], position)):
        if float(step) > 0:
            values[:] = np.round(values / float(step)) * float(step)


# ---- joints, wheels, steering

def every(log, prefix):
    return [name for name in log.names() if name.startswith(prefix)]


ARM = ("slew", "lift", "tilt", "extension", "luff", "load")


def named(log, joint):
    """A joint, or all wheels or steered wheels by the beginning of their names."""
    return log.joints(*([joint] if joint in log.names() else every(log, joint)))


@wrong
def joint_sign(log, joint):
    for values in log.both():
        values[:, named(log, joint)] *= -1


@wrong
def joint_scale(log, joint, factor):
    for values in log.both():
        values[:, named(log, joint)] *= float(factor)


@wrong
def joints_unread(log, joint="all"):
    """The encoder of an arm joint, or of all of them, is not read: position and velocity are exactly 0 from the first sample."""
    names = log.names()
    for name in ([name for name in ARM if name in names] if joint == "all" else [joint]):
        for values in log.both():
            values[:, log.joints(name)] = 0.0


@wrong
def joint_offset(log, joint, offset):
    log.both()[0][:, named(log, joint)] += float(offset)


@wrong
def joint_stuck(log, joint, since):
    """From a time on the encoder sends the same position; applied before the noise it flickers, afterwards it repeats bit for bit."""
    position, velocity = log.both()
    for k in named(log, joint):
        later = log.streams[JOINTS].t >= float(since)
        if later.any():
            position[later, k] = position[later, k][0]
            velocity[later, k] = 0.0


@wrong
def joint_jump(log, joint, at, by):
    """From a time on the position is off, as after a lost count of an incremental encoder."""
    log.both()[0][np.ix_(log.streams[JOINTS].t >= float(at), named(log, joint))] += float(by)


@wrong
def joint_moved(log, joint, at, seconds, by):
    """The position is off for a while, and comes back."""
    t = log.streams[JOINTS].t
    log.both()[0][np.ix_((t >= float(at)) & (t < float(at) + float(seconds)), named(log, joint))] += float(by)


@wrong
def joint_held(log, joint, since, seconds):
    """Position and velocity repeat for a while, bit for bit."""
    t = log.streams[JOINTS].t
    held = (t >= float(since)) & (t < float(since) + float(seconds))
    for values in log.both():
        for k in named(log, joint):
            if held.any():
                values[held, k] = values[held, k][0]


@wrong
def outliers(log, signal, share, size, seed=5):
    """Single samples are off by up to `size` in each direction: `force` [m/s2], `gyro` [rad/s], `speed` [m/s], `position` [rad or m], `tilt` [rad]."""
    rng = np.random.default_rng(int(seed))
    topic, path = {"force": (IMU, "linear_acceleration"), "gyro": (IMU, "angular_velocity"), "tilt": (IMU, "orientation"),
                   "speed": (ODOMETRY, "twist.twist.linear"), "position": (JOINTS, "position")}[signal]
    values = log.array(topic, path)
    hit = np.flatnonzero(rng.random(len(values)) < float(share))
    off = rng.uniform(-float(size), float(size), (len(hit), 3 if signal == "tilt" else values.shape[1]))
    if signal == "position":
        off[:, named(log, "wheel_")] = 0
    values[hit] = turned(values[hit], off) if signal == "tilt" else values[hit] + off


@wrong
def joints_swapped(log, a, b):
    for values in log.both():
        i, k = log.joints(a, b)
        values[:, [i, k]] = values[:, [k, i]]


@wrong
def wheels_swapped(log):
    """Left wheels in the place of right ones."""
    for name in every(log, "wheel_"):
        if name.endswith("l"):
            joints_swapped(log, name, name[:-1] + "r")


# ---- odometry

@wrong
def odometry_sign(log, part="linear"):
    log.array(ODOMETRY, f"twist.twist.{part}")[:] *= -1


@wrong
def odometry_scale(log, factor):
    for part in ("linear", "angular"):
        log.array(ODOMETRY, f"twist.twist.{part}")[:] *= float(factor)


@wrong
def odometry_offset(log, offset):
    """A speed of so much while the machine stands [m/s]."""
    log.array(ODOMETRY, "twist.twist.linear")[:, 0] += float(offset)


@wrong
def odometry_stuck(log, since):
    later = log.streams[ODOMETRY].t >= float(since)
    for part in ("linear", "angular"):
        values = log.array(ODOMETRY, f"twist.twist.{part}")
        if later.any():
            values[later] = values[later][0]


# ---- gyro, accelerometer, attitude

AXES = {"x": [0], "y": [1], "z": [2], "all": [0, 1, 2]}


@wrong
def gyro_sign(log, axis):
    log.array(IMU, "angular_velocity")[:, AXES[axis]] *= -1


@wrong
def gyro_scale(log, axis, factor):
    log.array(IMU, "angular_velocity")[:, AXES[axis]] *= float(factor)


@wrong
def gyro_bias(log, axis, bias):
    log.array(IMU, "angular_velocity")[:, AXES[axis]] += float(bias)


@wrong
def gyro_clipped(log, range, axis="all"):
    """Saturated at the end of its range [rad/s]."""
    values = log.array(IMU, "angular_velocity")
    values[:, AXES[axis]] = np.clip(values[:, AXES[axis]], -float(range), float(range))


@wrong
def axis_held(log, signal, axis, since, seconds):
    """One axis of `force` or `gyro` repeats for a while."""
    values, t = log.array(IMU, {"force": "linear_acceleration", "gyro": "angular_velocity"}[signal]), log.streams[IMU].t
    held = (t >= float(since)) & (t < float(since) + float(seconds))
    values[held, AXES[axis][0]] = values[held, AXES[axis][0]][0]


@wrong
def gyro_stuck(log, since):
    later = log.streams[IMU].t >= float(since)
    values = log.array(IMU, "angular_velocity")
    values[later] = values[later][:1]


@wrong
def accelerometer_sign(log, axis):
    log.array(IMU, "linear_acceleration")[:, AXES[axis]] *= -1


@wrong
def accelerometer_axes(log, a, b):
    """Two axes exchanged."""
    values, (i,), (k,) = log.array(IMU, "linear_acceleration"), AXES[a], AXES[b]
    values[:, [i, k]] = values[:, [k, i]]


@wrong
def accelerometer_bias(log, axis, bias):
    log.array(IMU, "linear_acceleration")[:, AXES[axis]] += float(bias)


@wrong
def accelerometer_scale(log, axis, factor):
    log.array(IMU, "linear_acceleration")[:, AXES[axis]] *= float(factor)


@wrong
def accelerometer_drift(log, axis, total):
    """A bias that grows evenly to `total` at the end of the log."""
    t = log.streams[IMU].t
    log.array(IMU, "linear_acceleration")[:, AXES[axis][0]] += float(total) * t / t[-1]


@wrong
def accelerometer_gravity_only(log):
    """What an attitude filter makes of it: gravity along the attitude, no acceleration."""
    attitude = log.array(IMU, "orientation").copy()
    log.array(IMU, "linear_acceleration")[:] = rotate(conjugate(attitude), np.array([0, 0, G]))


@wrong
def accelerometer_clipped(log, range_g, axis="all"):
    """Saturated at the end of its range."""
    values = log.array(IMU, "linear_acceleration")
    values[:, AXES[axis]] = np.clip(values[:, AXES[axis]], -float(range_g) * G, float(range_g) * G)


@wrong
def accelerometer_stuck(log, since):
    later = log.streams[IMU].t >= float(since)
    values = log.array(IMU, "linear_acceleration")
    values[later] = values[later][:1]


@wrong
def imu_turned(log, axis, degrees, attitude="with"):
    """The housing is mounted turned, with the attitude that it computes (`with`), or only its two sensors (`without`)."""
    e = np.zeros(3)
    e[AXES[axis][0]] = math.radians(float(degrees))
    q = turned(np.array([0.0, 0, 0, 1]), e)
    for path in ("angular_velocity", "linear_acceleration"):
        values = log.array(IMU, path)
        values[:] = rotate(conjugate(q), values.copy())
    if attitude == "with":
        values = log.array(IMU, "orientation")
        values[:] = product(values.copy(), np.broadcast_to(q, values.shape))


@wrong
def attitude_constant(log):
    values = log.array(IMU, "orientation")
    values[:] = values[0].copy()


@wrong
def attitude_lagging(log, seconds):
    """A filter that follows late."""
    values, t = log.array(IMU, "orientation"), log.streams[IMU].t
    values[:] = values[np.searchsorted(t, np.maximum(t - float(seconds), t[0]))].copy()


@wrong
def attitude_sign(log):
    """The inverse rotation."""
    values = log.array(IMU, "orientation")
    values[:] = conjugate(values.copy())


# ---- the variants of the matrix

ALL = {**SOUND, **WRONG}
BEFORE_NOISE = {"vibration", "accelerometer_gravity_only", "joint_sign", "joint_scale", "joint_offset", "joint_jump", "joint_moved", "joints_swapped", "wheels_swapped"}


@dataclass
class Variant:
    """Kinds with their parameters, in order; the noise is one of them."""
    name: str
    steps: list
    is_sound: bool
    wrong_from: float = 0.0    # s

    def apply(self, clean):
        log = clean.copy()
        for kind, parameters in self.steps:
            ALL[kind](log, **parameters)
        return log


def label(kind, parameters):
    return "-".join([kind, *(f"{key}={value:.4g}" if isinstance(value, float) else f"{key}={value}" for key, value in parameters.items())]).replace("/", "")


def sound_variants(log):
    """Everything that may happen to a log whose sensors are sound."""
    truth = log.truth
    end = truth["duration_s"]
    out = [Variant(f"noise-seed={seed}", [("noise", dict(seed=seed))], True) for seed in (1, 2, 3)]
    seeded = [("noise", dict(seed=11))]

    def add(kind, first=False, **parameters):
        step = (kind, parameters)
        out.append(Variant(label(kind, parameters), [step, *seeded] if first else [*seeded, step], True))
    out.append(Variant("clean", [], True))
    for begin in (1.7, 0.35 * min(end, truth["tipping_s"] or end)):
        add("begins", seconds=round(begin, 2))
    add("ends", seconds=round(0.4 * end, 2))
    if truth["tilt_10deg_s"]:
        begin = truth["tipping_s"] or truth["tilt_10deg_s"]
        add("begins_falling", seconds=round(begin + 0.4 * ((truth["on_side_s"] or truth["tilt_10deg_s"] + 0.3) - begin), 2))
        add("ends", seconds=round(truth["tilt_10deg_s"] + 0.15, 2))
        add("ends", seconds=round(truth["tilt_10deg_s"] + 0.6, 2))
    for topic, begin, seconds in ((IMU, 0.3, 0.4), (JOINTS, 0.45, 0.4), (ODOMETRY, 0.3, 3.0), (IMU, 0.55, 1.5), (JOINTS, 0.3, 3.0)):
        if topic in log.streams:
            add("hole", topic=topic, begin=round(begin * end, 2), seconds=seconds)
    for amplitude, hertz in ((2.0, 23.0), (4.0, 35.0), (2.0, 58.0)):
        add("vibration", first=True, amplitude=amplitude, hertz=hertz)
    for topic in (IMU, JOINTS, ODOMETRY):
        if topic in log.streams:
            add("late", topic=topic, seconds=1.0)
    add("wheels_wrapped")
    add("wheels_wrapped", start=0.0)
    add("coarse", force=0.04, gyro=0.004, position=0.0017)
    add("spike", at=0.004)
    add("spike", at=round(0.5 * end, 3))
    return out


def wrong_variants(log):
    """One wrong sensor each, with noise."""
    end = log.truth["duration_s"]
    middle = round(0.3 * end, 2)
    names = log.names()
    arm = [name for name in ARM if name in names]
    lengths = {"extension", "load"}
    out = []

    def add(kind, wrong_from=0.0, first=None, **parameters):
        first = kind in BEFORE_NOISE if first is None else first
        step, seeded = (kind, parameters), ("noise", dict(seed=21))
        suffix = "-flickering" if kind == "joint_stuck" and first else ""
        out.append(Variant(label(kind, parameters) + suffix, [step, seeded] if first else [seeded, step], False, wrong_from))
    for joint in arm:
        add("joint_sign", joint=joint)
        for factor in (0.8, 1.2):
            add("joint_scale", joint=joint, factor=factor)
        add("joint_offset", joint=joint, offset=0.15 if joint in lengths else 0.2)
        add("joint_stuck", wrong_from=middle, joint=joint, since=middle)
        add("joint_stuck", wrong_from=middle, first=True, joint=joint, since=middle)
        add("joint_jump", wrong_from=middle, joint=joint, at=middle, by=0.15 if joint in lengths else 0.2)
        add("joint_held", wrong_from=middle, joint=joint, since=middle, seconds=3.0)
        add("joints_unread", joint=joint)
    if arm:
        add("joints_unread")
    if "slew" in arm:
        add("joint_jump", wrong_from=middle, joint="slew", at=middle, by=0.8)
        add("joint_moved", wrong_from=middle, joint="slew", at=middle, seconds=2.0, by=0.8)
    for signal, size in (("force", 15.0), ("gyro", 2.0), ("position", 0.1), ("speed", 3.0), ("tilt", 0.5)):
        if signal != "speed" or ODOMETRY in log.streams:
            add("outliers", signal=signal, share=0.005, size=size)
    for signal, axis in (("force", "x"), ("force", "y"), ("force", "z"), ("gyro", "x"), ("gyro", "y")):
        add("axis_held", wrong_from=middle, signal=signal, axis=axis, since=middle, seconds=3.0)
    add("gyro_clipped", range=0.05)
    for i, a in enumerate(arm):
        for b in arm[i + 1:]:
            add("joints_swapped", a=a, b=b)
    groups = [("wheel_", "wheel_fl")] + ([("steer_", "steer_fl")] if every(log, "steer_") else [])
    for group, single in groups:
        for joint in (group, single):
            add("joint_sign", joint=joint)
        for factor in (0.8, 1.2):
            add("joint_scale", joint=group, factor=factor)
        add("joint_stuck", wrong_from=middle, first=True, joint=group, since=middle)
    if every(log, "steer_"):
        add("joint_offset", joint="steer_", offset=0.1)
    add("wheels_swapped")
    if ODOMETRY in log.streams:
        add("odometry_sign")
        add("odometry_sign", part="angular")
        for factor in (0.8, 1.2):
            add("odometry_scale", factor=factor)
        add("odometry_offset", offset=0.3)
        add("odometry_stuck", wrong_from=middle, since=middle)
    for axis in "xyz":
        add("gyro_sign", axis=axis)
        add("gyro_bias", axis=axis, bias=0.02)
        add("gyro_bias", axis=axis, bias=0.1)
        add("accelerometer_sign", axis=axis)
        add("accelerometer_bias", axis=axis, bias=0.3)
        add("accelerometer_bias", axis=axis, bias=1.0)
    for factor in (0.8, 1.2):
        add("gyro_scale", axis="all", factor=factor)
    add("gyro_stuck", wrong_from=middle, since=middle)
    for a, b in ("xy", "xz", "yz"):
        add("accelerometer_axes", a=a, b=b)
    add("accelerometer_scale", axis="all", factor=0.9)
    add("accelerometer_drift", axis="x", total=2.9)
    add("accelerometer_drift", axis="y", total=2.9)
    add("accelerometer_gravity_only")
    for range_g in (1.2, 1.02):
        add("accelerometer_clipped", range_g=range_g)
    add("accelerometer_clipped", range_g=0.1, axis="x")
    add("accelerometer_clipped", range_g=0.1, axis="y")
    add("accelerometer_stuck", wrong_from=middle, since=middle)
    for axis in "xyz":
        for degrees in (2, 5, 20, 90, 180):
            add("imu_turned", axis=axis, degrees=degrees)
        for degrees in (5, 20):
            add("imu_turned", axis=axis, degrees=degrees, attitude="without")
    add("attitude_constant")
    add("attitude_sign")
    for seconds in (0.2, 1.0):
        add("attitude_lagging", seconds=seconds)
    return out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation laboratory")
    parser.add_argument("folder", type=Path, help="folder of a manoeuvre")
    parser.add_argument("out", type=Path, nargs="?", help="log to write")
    parser.add_argument("--list", action="store_true", help="print the variants of the matrix for this log")
    parser.add_argument("--seed", type=int, help="noise with this seed, after the kinds that act on what a sensor measures")
    parser.add_argument("steps", nargs="*", metavar="KIND KEY=VALUE", help="kinds, each followed by its parameters")
    arguments = parser.parse_intermixed_args()
    sys.path.insert(0, str(arguments.lab))
    log = Log(arguments.folder, 200 if arguments.list else None)
    if arguments.list:
        for variant in sound_variants(log) + wrong_variants(log):
            print(f"{'sound' if variant.is_sound else 'wrong'}  {variant.name}")
        return
    if not arguments.out:
        parser.error("expected the log to write, or --list")
    steps = []
    for word in arguments.steps:
        if "=" in word:
            if not steps:
                parser.error(f"{word}: expected a kind before its parameters")
            key, value = word.split("=", 1)
            steps[-1][1][key] = value
        elif word in ALL:
            steps.append((word, {}))
        else:
            parser.error(f"{word}: no such kind; there are {', '.join(ALL)}")
    if arguments.seed is not None:
        first = [step for step in steps if step[0] in BEFORE_NOISE]
        steps = [*first, ("noise", {"seed": arguments.seed}), *[step for step in steps if step not in first]]
    Variant("", steps, True).apply(log).write(arguments.out)


if __name__ == "__main__":
    main()
