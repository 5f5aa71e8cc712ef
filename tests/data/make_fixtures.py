"""Make the small simulated logs that come with Tipwatch: `demo`, `tiny` and `tiny_lift`.

    python -m venv .venv && .venv/bin/pip install mujoco numpy polars rosbags mcap
    .venv/bin/python make_fixtures.py LAB OUT [name...]

LAB is the folder of the simulation laboratory (model.py, simulate.py, writelog.py, machine_file.py), OUT receives for each fixture

    NAME.mcap             the log: ROS 2 messages, zstd, noisy sensors, /robot_description included
    NAME.toml, NAME.urdf  the machine file and the machine
    NAME.truth.parquet    the true wheel loads at 500 Hz: t_ns, load_fl, load_fr, load_rl, load_rr [N]; of demo at 50 Hz, smoothed
    demo.weighed.toml     what scales under its wheels show in six postures at rest, as [weighed] of its machine file

demo       18 s. A forwarder-like machine with 180 kg in its grapple crawls along a side slope of 6 degrees (left wheels uphill) and
           stops. Its arm slews to the downhill side and reaches out a little: it comes close, and no wheel lifts. It draws in and then
           reaches out farther. The uphill rear wheel, RL, lifts, until the operator draws the arm in and it comes down again. Flat ground, and
           wheels and tyres that were measured, a machine that was weighed: the machine file states all of it.
tiny       3 s. Level ground, standing, the arm moves a little. All wheels carry load.
tiny_lift  4 s. With 60 kg on the same slope: the arm reaches out to the downhill side, and RL goes light, lifts for a second and a half
           and comes down again; the part of that manoeuvre around the lift, with a clock that starts at zero.

The wheel loads are contact forces of MuJoCo. The seeds are fixed, so one version of the packages on one kind of processor gives the
same files again; another version may differ in the last digits.
"""
import dataclasses
import math

import numpy as np

from fixture_tools import (DEGREE, arm_pose, cut, lab_arguments, run, say, smooth, standing, thinned, typestore, via, write_mcap,
                           write_smoothed_truth)

DEMO_PAYLOAD_KG = 180.0
SCALE_SIGMA_KG = 2.0
WEIGHED = {    # lift, tilt [deg], extension [m], slew [deg]
    "arm ahead": (48, -98, 0.05, 0),
    "arm to the left": (45, -90, 0.05, 70),
    "arm to the right": (45, -90, 0.05, -70),
    "arm out ahead": (33, -60, 0.2, 0),
    "arm to the rear left": (40, -80, 0.1, 120),
    "arm to the rear right": (40, -80, 0.1, -120),
}
IMU_EVERY = 2                        # of the laboratory's 250 Hz: 125 Hz keeps the files small
LIFT_FROM_S, LIFT_TO_S = 5.2, 9.2    # the part of the manoeuvre that tiny_lift keeps


def demo_arm(t):
    slew = -60 * smooth(t, 1.6, 4.6) + 60 * smooth(t, 14.4, 17.4)
    reach = via(t, (1.0, 0), (3.0, -0.3), (4.4, -0.3), (6.4, 0.2), (6.9, 0.2), (8.4, -0.1), (8.8, -0.1), (11.4, 1.5), (12.2, 1.5), (14.2, -0.2))
    return arm_pose(48 - 15 * reach, -98 + 38 * reach, 0.05 + 0.15 * reach, slew)


def lift_arm(t):
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
        "demo": Scenario("demo", model.rigid(yaw0=0.0, payload=DEMO_PAYLOAD_KG), 18.0, demo_arm, demo_drive, slope=(6 * DEGREE, 0.0), clear=3.0, seed=7),
        "lift": Scenario("lift", model.rigid(yaw0=0.0, payload=60.0), 12.0, lift_arm, demo_drive, slope=(6 * DEGREE, 0.0), clear=3.0, seed=7),
        "tiny": Scenario("tiny", model.rigid(yaw0=0.0), 3.0, tiny_arm, standing, clear=2.0, seed=8),
    }


def write_fixture(scenario, mujoco_model, rows, out):
    import writelog
    writelog.write(scenario, mujoco_model, rows, out, formats=())    # truth, URDF and machine file
    types = typestore()
    events = writelog.messages(scenario, mujoco_model, rows, types)
    path = out / f"{scenario.name}.mcap"
    write_mcap(thinned(events, {"/imu/data": IMU_EVERY}), types, path)
    if scenario.name == "demo":
        write_smoothed_truth(scenario.machine, rows, out / "demo.truth.parquet")
        write_weighings(out / "demo.weighed.toml")
    say(path, scenario.machine, rows)


def write_weighings(path):
    """Writes what scales with some noise show under the wheels of the demo's machine at rest: the means of the true loads."""
    import model
    from simulate import Scenario
    noise = np.random.default_rng(11)
    text = f'[weighed]\nunit = "kg"\nsigma = {SCALE_SIGMA_KG}\n'
    for name, pose in WEIGHED.items():
        machine = model.rigid(yaw0=0.0, payload=DEMO_PAYLOAD_KG)
        mujoco_model, rows = run(Scenario("weighed", machine, 0.6, lambda _t: arm_pose(*pose), standing, clear=3.0, seed=3))
        position = rows[-1]["qpos"]
        joints = {j: float(position[mujoco_model.jnt_qposadr[mujoco_model.joint(j).id]]) for j in ("slew", "lift", "tilt", "extension")}
        shown = {wheel: np.mean([row[f"load_{wheel.lower()}"] for row in rows[-200:]]) / model.G for wheel in machine.wheels}
        shown = {wheel: round(float(kg + noise.normal(0.0, SCALE_SIGMA_KG))) for wheel, kg in shown.items()}
        posture = ", ".join(f"{joint} = {at:.4f}" for joint, at in joints.items())
        wheels = ", ".join(f"{wheel} = {kg}" for wheel, kg in shown.items())
        text += f'\n[[weighed.postures]]\nname = "{name}"\nposture = {{ {posture} }}\nwheels = {{ {wheels} }}\n'
    path.write_text(text)


def main():
    arguments = lab_arguments(__doc__, ["demo", "tiny", "tiny_lift"])
    known = scenarios()
    runs = {}
    for name in arguments.names:
        source = "lift" if name == "tiny_lift" else name
        if source not in runs:
            runs[source] = run(known[source])
        mujoco_model, rows = runs[source]
        scenario = known[source]
        if name == "tiny_lift":
            scenario, rows = dataclasses.replace(scenario, name=name, seed=9), cut(rows, LIFT_FROM_S, LIFT_TO_S)
        write_fixture(scenario, mujoco_model, rows, arguments.out)


if __name__ == "__main__":
    main()
