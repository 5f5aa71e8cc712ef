"""Shared by the scripts that make fixtures: manoeuvre paths, an observed run of the simulation laboratory, log and truth files.

The laboratory's folder must be on sys.path (`lab_arguments` adds it) before calling a function that imports from it.
Made with Python 3.11 and the versions in VERSIONS.
"""
import argparse
import dataclasses
import math
import sys
from pathlib import Path

import numpy as np

VERSIONS = "mujoco 4.0.0, numpy 2.4.6, polars 2.1.0, rosbags 0.11.9, mcap 1.6.0, zstandard 0.25.0"
DEGREE = math.pi / 180
CHUNK_BYTES = 1 << 18
EVERY = {"/imu/data": 2, "/odom": 2, "/robot_description": 0}    # of the laboratory's 250 and 50 Hz; the URDF is beside the log
TRUTH_HALF_WINDOW = 25               # samples at 500 Hz on each side of the smoothing window


# ---- manoeuvres

def smooth(t, start, end):
    """0 before start, 1 after end, with continuous first and second derivatives in between."""
    s = min(1.0, max(0.0, (t - start) / (end - start)))
    return s * s * s * (10 + s * (-15 + 6 * s))


def via(t, *points):
    """A path that rests at each of the given (time, value) points."""
    for (start, a), (end, b) in zip(points, points[1:]):
        if t <= end:
            return a + (b - a) * smooth(t, start, end)
    return points[-1][1]


def arm_pose(lift_deg, tilt_deg, extension_m, slew_deg):
    """Joint targets from the angles of the arm's published parameter set, which has a different zero."""
    return {"slew": slew_deg * DEGREE, "lift": lift_deg * DEGREE - 2.0736, "tilt": tilt_deg * DEGREE - 0.4116, "extension": extension_m}


def standing(_t):
    return 0.0, 0.0


# ---- the simulation

class Watch:
    """Replaces the mujoco module inside the laboratory's simulation to observe what that does not record: the mean force or torque
    of every actuator between two rows. On uneven ground it also reduces contact forces to their vertical component, the wheel load
    on an inclined face."""

    def __init__(self, mujoco, uneven):
        self._mujoco, self._uneven = mujoco, uneven
        self.actuator_means, self._sum, self._steps = [], 0.0, 0

    def __getattr__(self, name):
        return getattr(self._mujoco, name)

    def mj_step(self, model, data):
        self._mujoco.mj_step(model, data)
        self._sum, self._steps = self._sum + data.actuator_force, self._steps + 1

    def mj_kinematics(self, model, data):    # once per recorded row
        self._mujoco.mj_kinematics(model, data)
        self.actuator_means.append(self._sum / self._steps)
        self._sum, self._steps = 0.0, 0

    def mj_contactForce(self, model, data, contact, force):
        self._mujoco.mj_contactForce(model, data, contact, force)
        if self._uneven:
            frame = data.contact[contact].frame.reshape(3, 3)
            force[0] = abs(float((frame.T @ force[:3])[2]))


def run(scenario, edit_mjcf=lambda xml: xml, tyre=None):
    """Simulates a scenario and returns the MuJoCo model and the rows, each with the mean force of every actuator by name.
    `edit_mjcf` may change the MJCF text first; `tyre` replaces stiffness [N/m] and damping [N s/m] of the tyres."""
    import model
    import mujoco
    import simulate
    options = {"tyre": tyre} if tyre else {}
    watch = Watch(mujoco, uneven=bool(scenario.ground))
    simulate.mjcf = lambda *a, **k: edit_mjcf(model.mjcf(*a, **k, **options))
    simulate.mujoco = watch
    try:
        mujoco_model, _, rows = simulate.run(scenario)
    finally:
        simulate.mjcf, simulate.mujoco = model.mjcf, mujoco
    names = [mujoco_model.actuator(i).name for i in range(mujoco_model.nu)]
    for row, forces in zip(rows, watch.actuator_means[1:]):    # the laboratory drops its first row
        row["actuators"] = dict(zip(names, forces))
    return mujoco_model, rows


def cut(rows, start_s, end_s):
    """The rows of a time span, with time counted from its start."""
    return [row | {"t": row["t"] - start_s} for row in rows if start_s <= row["t"] <= end_s]


# ---- logs

def typestore():
    from rosbags.typesys import Stores, get_typestore
    return get_typestore(Stores.ROS2_HUMBLE)


def messages(scenario, mujoco_model, rows, types):
    """The laboratory's log of a run, with numbers rounded to fixed-point grids, which compress better."""
    import writelog

    def grid(values, bits):
        return np.round(np.asarray(values) * 2.0**bits) / 2.0**bits

    def gridded(value, bits):
        axes = [axis for axis in ("x", "y", "z", "w") if hasattr(value, axis)]
        return dataclasses.replace(value, **{axis: float(grid(getattr(value, axis), bits)) for axis in axes})

    for log_time, topic, kind, message in writelog.messages(scenario, mujoco_model, rows, types):
        if kind == "sensor_msgs/msg/Imu":
            message = dataclasses.replace(message, orientation=gridded(message.orientation, 14),
                                          angular_velocity=gridded(message.angular_velocity, 14),
                                          linear_acceleration=gridded(message.linear_acceleration, 10))
        elif kind == "sensor_msgs/msg/JointState":
            message = dataclasses.replace(message, position=grid(message.position, 14), velocity=grid(message.velocity, 12))
        elif kind == "nav_msgs/msg/Odometry":
            pose, twist = message.pose.pose, message.twist.twist
            pose = dataclasses.replace(pose, position=gridded(pose.position, 10), orientation=gridded(pose.orientation, 14))
            twist = dataclasses.replace(twist, linear=gridded(twist.linear, 10), angular=gridded(twist.angular, 14))
            message = dataclasses.replace(message, pose=dataclasses.replace(message.pose, pose=pose),
                                          twist=dataclasses.replace(message.twist, twist=twist))
        yield log_time, topic, kind, message


def thinned(events, every):
    """Keeps every n-th message of the topics in `every`; n = 0 removes a topic."""
    seen = {}
    for event in events:
        n = every.get(event[1], 1)
        seen[event[1]] = seen.get(event[1], 0) + 1
        if n and seen[event[1]] % n == 1 % n:
            yield event


def write_mcap(events, types, path):
    """Writes an MCAP file as rosbag2 would: CDR messages, one channel per topic."""
    from mcap.writer import CompressionType, Writer
    with open(path, "wb") as file:
        writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="tipwatch fixtures")
        channels, counts = {}, {}
        for log_time, topic, kind, message in events:
            if topic not in channels:
                definition, _ = types.generate_msgdef(kind, ros_version=2)
                channels[topic] = writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", definition.encode()))
            counts[topic] = counts.get(topic, 0) + 1
            data = bytes(types.serialize_cdr(message, kind))
            writer.add_message(channels[topic], log_time, data, publish_time=log_time, sequence=counts[topic])
        writer.finish()


# ---- truth

def wheel_columns(machine):
    return [f"load_{wheel.lower()}" for wheel in machine.wheels]


def stamp(seconds):
    import writelog
    return writelog.T0 + int(seconds * 1e9)


def write_truth(machine, rows, path):
    """Writes the true wheel loads at 500 Hz."""
    import polars
    loads = {column: np.array([row[column] for row in rows]) for column in wheel_columns(machine)}
    polars.DataFrame({"t_ns": [stamp(row["t"]) for row in rows], **loads}).write_parquet(path)


def write_smoothed_truth(machine, rows, path, every=10):
    """Writes every n-th of the true wheel loads at 500 Hz, smoothed as in the tests."""
    import polars
    middle = rows[TRUTH_HALF_WINDOW:len(rows) - TRUTH_HALF_WINDOW][::every]
    loads = {column: savitzky_golay(np.array([row[column] for row in rows]))[::every].astype(np.float32) for column in wheel_columns(machine)}
    polars.DataFrame({"t_ns": [stamp(row["t"]) for row in middle], **loads}).write_parquet(path)


def savitzky_golay(values):
    """Third-order Savitzky-Golay smoothing over 51 samples; shorter than `values` by 25 samples at each end."""
    m = TRUTH_HALF_WINDOW
    k = np.arange(-m, m + 1)
    weights = (3 * m * m + 3 * m - 1 - 5 * k * k) * 3 / ((2 * m - 1) * (2 * m + 1) * (2 * m + 3))
    return np.convolve(values, weights, mode="valid")


def say(path, machine, rows):
    lightest = ", ".join(f"{column[5:]} {min(row[column] for row in rows):.0f}" for column in wheel_columns(machine))
    print(f"{path.name}: {path.stat().st_size} bytes, {rows[-1]['t']:.2f} s, smallest loads [N]: {lightest}", flush=True)


def write_fixture(scenario, mujoco_model, rows, out, every=None, edit_toml=lambda text: text, urdf=None, more=(), smoothed_truth=False):
    """Writes all four files of a fixture. `every` thins topics, `edit_toml` may change the machine file, `urdf` replaces the machine's
    own, `more` are further messages for the log, `smoothed_truth` selects a smaller truth table."""
    import machine_file
    import model
    types = typestore()
    name, machine = scenario.name, scenario.machine
    (out / f"{name}.urdf").write_text(urdf or model.urdf(machine))
    (out / f"{name}.toml").write_text(edit_toml(machine_file.machine_toml(machine, f"{name}.urdf")))
    (write_smoothed_truth if smoothed_truth else write_truth)(machine, rows, out / f"{name}.truth.parquet")
    events = thinned(messages(scenario, mujoco_model, rows, types), EVERY if every is None else every)
    write_mcap(sorted([*events, *more], key=lambda event: event[0]), types, out / f"{name}.mcap")
    say(out / f"{name}.mcap", machine, rows)


def lab_arguments(description, names):
    """Parses the command line of a script that makes these fixtures: where to write, and which ones to make."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation laboratory")
    parser.add_argument("out", type=Path, help="folder to write to")
    parser.add_argument("names", nargs="*", default=names, help="fixtures to make; all by default")
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.lab))
    return arguments
