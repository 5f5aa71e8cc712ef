"""Make the small simulated logs that come with Tipwatch: `demo`, `tiny` and `tiny_lift`.

    python -m venv .venv && .venv/bin/pip install mujoco numpy polars rosbags mcap
    .venv/bin/python make_fixtures.py LAB OUT [name...]

LAB is the folder of the simulation lab (model.py, simulate.py, writelog.py, machine_file.py), OUT receives for each fixture

    NAME.mcap             the log: ROS 2 messages, zstd, noisy sensors, /robot_description included
    NAME.toml, NAME.urdf  the machine file and the machine
    NAME.truth.parquet    the true wheel loads at 500 Hz: t_ns, load_fl, load_fr, load_rl, load_rr [N]

demo       12 s. A forwarder-like machine with 60 kg in its grapple crawls along a side slope of 6 degrees (left wheels uphill) and
           stops. Its arm slews to the downhill side and reaches out. The uphill rear wheel, RL, goes light, lifts for a second and a
           half, and comes down again when the operator draws the arm in.
tiny       3 s. Level ground, standing, the arm moves a little. All wheels carry load.
tiny_lift  4 s. The part of the demo around the lift, with a clock that starts at zero.

The wheel loads are contact forces of MuJoCo. The seeds are fixed, so one version of the packages on one kind of processor gives the
same files again; another version may differ in the last digits. Made with Python 3.11 and the versions in VERSIONS.
"""
import argparse
import math
import sys
from pathlib import Path

VERSIONS = "mujoco 4.0.0, numpy 2.4.6, polars 2.1.0, rosbags 0.11.9, mcap 1.6.0, zstandard 0.25.0"
DEGREE = math.pi / 180
CHUNK_BYTES = 1 << 18
IMU_EVERY = 2                        # of the lab's 250 Hz: 125 Hz keeps the files small
LIFT_FROM_S, LIFT_TO_S = 5.2, 9.2    # the part of the demo that tiny_lift keeps


def smooth(t, start, end):
    """0 before start, 1 after end, with continuous rate and acceleration between."""
    s = min(1.0, max(0.0, (t - start) / (end - start)))
    return s * s * s * (10 + s * (-15 + 6 * s))


def arm_pose(lift_deg, tilt_deg, extension_m, slew_deg):
    """Joint targets from the angles of the arm's published parameter set, whose zero is another one."""
    return {"slew": slew_deg * DEGREE, "lift": lift_deg * DEGREE - 2.0736, "tilt": tilt_deg * DEGREE - 0.4116, "extension": extension_m}


def demo_arm(t):
    slew = -65 * smooth(t, 1.6, 5.2) + 65 * smooth(t, 8.6, 11.9)
    reach = smooth(t, 3.8, 7.2) - smooth(t, 6.8, 9.0)
    return arm_pose(48 - 15 * reach, -98 + 38 * reach, 0.05 + 0.15 * reach, slew)


def demo_drive(t):
    return 0.5 * (1 - smooth(t, 0.8, 2.0)), 0.0


def tiny_arm(t):
    s = smooth(t, 0.0, 1.0)
    return arm_pose(45 + 4 * s * math.sin(2 * t), -75 + 5 * s * math.sin(2.5 * t), 0.2 + 0.05 * s * math.sin(1.5 * t), 15 * s * math.sin(1.8 * t))


def scenarios():
    """The manoeuvres to simulate, by name."""
    import model
    from simulate import Scenario
    return {
        "demo": Scenario("demo", model.rigid(yaw0=0.0, payload=60.0), 12.0, demo_arm, demo_drive, slope=(6 * DEGREE, 0.0), clear=3.0, seed=7),
        "tiny": Scenario("tiny", model.rigid(yaw0=0.0), 3.0, tiny_arm, lambda t: (0.0, 0.0), clear=2.0, seed=8),
    }


def cut(rows, start_s, end_s):
    """The rows of a time span, with the clock set back to zero at its start."""
    return [row | {"t": row["t"] - start_s} for row in rows if start_s <= row["t"] <= end_s]


def thinned(events, topic, every):
    """All events, but only each `every`-th of one topic."""
    seen = 0
    for event in events:
        if event[1] == topic:
            seen += 1
            if seen % every != 1 % every:
                continue
        yield event


def write_mcap(events, types, path):
    """An MCAP file as rosbag2 would record it: CDR messages, one channel a topic."""
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


def write_fixture(scenario, mujoco_model, rows, out):
    import writelog
    from rosbags.typesys import Stores, get_typestore
    writelog.write(scenario, mujoco_model, rows, out, formats=())    # truth, URDF and machine file
    types = get_typestore(Stores.ROS2_HUMBLE)
    events = writelog.messages(scenario, mujoco_model, rows, types)
    path = out / f"{scenario.name}.mcap"
    write_mcap(thinned(events, "/imu/data", IMU_EVERY), types, path)
    lightest = {wheel: min(row[f"load_{wheel}"] for row in rows) for wheel in ("fl", "fr", "rl", "rr")}
    print(f"{path.name}: {path.stat().st_size} bytes, {rows[-1]['t']:.2f} s, smallest loads [N]:", ", ".join(f"{w} {f:.0f}" for w, f in lightest.items()))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation lab")
    parser.add_argument("out", type=Path, help="folder to write to")
    parser.add_argument("names", nargs="*", default=["demo", "tiny", "tiny_lift"], help="fixtures to make; all by default")
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.lab))
    import dataclasses
    import simulate

    known = scenarios()
    runs = {}
    for name in arguments.names:
        source = "demo" if name == "tiny_lift" else name
        if source not in runs:
            mujoco_model, _, rows = simulate.run(known[source])
            runs[source] = mujoco_model, rows
        mujoco_model, rows = runs[source]
        scenario = known[source]
        if name == "tiny_lift":
            scenario, rows = dataclasses.replace(scenario, name=name, seed=9), cut(rows, LIFT_FROM_S, LIFT_TO_S)
        write_fixture(scenario, mujoco_model, rows, arguments.out)


if __name__ == "__main__":
    main()
