"""Make `coverage_00` to `coverage_23`: logs of machines that deviate from their machine file.

    .venv/bin/python make_coverage.py LAB OUT [number...]    # the truth table contains the logs of this call

LAB is the folder of the simulation laboratory, OUT receives `coverage.toml` and `coverage.urdf` (the nominal machine, the same for all logs),
`coverage_NN.mcap` (noisy, 4 s, no /robot_description) and `coverage.truth.parquet`: log, t_ns, load_fl, load_fr, load_rl, load_rr [N], the
contact forces of MuJoCo at 500 Hz smoothed over 51 samples by a third-order Savitzky-Golay filter, every fifth sample.

The machine of log NN is drawn by a generator seeded with DRAW_SEED + NN: independent, normally distributed deviations with the standard deviations
below, in the order of `true_machine` and `Sensors`. NN % 3 = 0: the arm moves on level ground; 1: driving, cornering and braking; 2: the arm
moves on a slope. Amplitudes come from a generator seeded with MANOEUVRE_SEED + NN. The arm points to the rear, where no wheel is light.
"""
import copy
import math

import numpy as np

from fixture_tools import (DEGREE, TRUTH_HALF_WINDOW, arm_pose, lab_arguments, messages, run, savitzky_golay, say, smooth, stamp, standing,
                           thinned, typestore, via, wheel_columns, write_mcap)

LOGS, SECONDS = 24, 4.0
DRAW_SEED, MANOEUVRE_SEED, NOISE_SEED = 1000, 2000, 3000
EVERY = {"/joint_states": 2, "/odom": 2, "/robot_description": 0}    # of the 100 Hz rows: 50 Hz, and odometry 25 Hz

# one standard deviation each
MASS = 0.02                      # each link's mass, share
CENTRE_OF_MASS = 0.01            # each link's centre of mass, each axis, m
INERTIA = 0.10                   # each link's inertia tensor, one factor for its six numbers
WHEEL_POSITION = 0.005           # each wheel joint's origin, each axis, m
WHEEL_RADIUS = 0.002             # each wheel, m
ARM_POSITION = 0.005             # origin of the joint of arm_slew, each axis, m
TYRE_STIFFNESS = 0.20            # each tyre, share
JOINT_OFFSET = {"slew": 0.005, "lift": 0.005, "tilt": 0.005, "extension": 0.003}    # added to the measurement, rad or m
IMU_POSITION = 0.01              # each axis, m
IMU_ORIENTATION = 0.005          # about each axis, rad
ACCELEROMETER_BIAS = 0.03        # each axis, m/s^2
GYRO_BIAS = 0.002                # each axis, rad/s


def true_machine(nominal, rng):
    """A machine drawn around the nominal one, the radius of each wheel, and the stiffness of each tyre as a share."""
    machine = copy.deepcopy(nominal)
    for link in machine.links:
        if link.mass > 0:
            link.mass *= 1 + MASS * rng.normal()
            link.com = tuple(np.array(link.com, float) + CENTRE_OF_MASS * rng.normal(size=3))
            link.inertia = link.inertia * (1 + INERTIA * rng.normal())
    radii, stiffness = {}, {}
    for wheel, (link, radius) in machine.wheels.items():
        moved = machine.link(link)
        moved.pos = tuple(np.array(moved.pos, float) + WHEEL_POSITION * rng.normal(size=3))
        radii[link] = radius + WHEEL_RADIUS * rng.normal()
        machine.wheels[wheel] = link, radii[link]
        stiffness[link] = 1 + TYRE_STIFFNESS * rng.normal()
    arm = machine.link("arm_slew")
    arm.pos = tuple(np.array(arm.pos, float) + ARM_POSITION * rng.normal(size=3))
    machine.imu = tuple(np.array(machine.imu, float) + IMU_POSITION * rng.normal(size=3))
    return machine, radii, stiffness


def with_wheels(xml, radii, stiffness):
    """The MJCF text with radius and tyre stiffness of each wheel."""
    for link, radius in radii.items():
        geom = f"<geom name='{link}' class='wheel' type='ellipsoid' size='0.35 0.12 0.35'/>"
        tyre = f"<joint name='tyre_{link}' type='slide' axis='0 0 1' stiffness='800000.0'"
        assert geom in xml and tyre in xml
        xml = xml.replace(geom, geom.replace("0.35 0.12 0.35", f"{radius} 0.12 {radius}"))
        xml = xml.replace(tyre, tyre.replace("800000.0", f"{8e5 * stiffness[link]}"))
    return xml


class Sensors:
    """Sensor errors of one machine."""

    def __init__(self, rng):
        self.joints = {joint: sigma * rng.normal() for joint, sigma in JOINT_OFFSET.items()}
        turn = IMU_ORIENTATION * rng.normal(size=3)
        self.accelerometer = ACCELEROMETER_BIAS * rng.normal(size=3)
        self.gyro = GYRO_BIAS * rng.normal(size=3)
        angle = np.linalg.norm(turn)
        x, y, z = turn / angle
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        self.mounting = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross    # IMU axes in base axes

    def imu(self, row):
        """A row as the IMU measures it."""
        to_imu = self.mounting.T
        return row | {"R": row["R"] @ self.mounting, "gyro": to_imu @ row["gyro"] + self.gyro, "acc": to_imu @ row["acc"] + self.accelerometer}

    def encoders(self, row, mujoco_model):
        """A row as the encoders measure it."""
        qpos = row["qpos"].copy()
        for joint, offset in self.joints.items():
            qpos[mujoco_model.jnt_qposadr[mujoco_model.joint(joint).id]] += offset
        return row | {"qpos": qpos}


def arm_motion(rng, share):
    """A motion of the arm around a posture over the rear, `share` of full size."""
    middle, size = rng.uniform(-35, 35), share * rng.uniform(0.4, 1.0, 4)
    rate, phase = rng.uniform(1.2, 2.4, 4), rng.uniform(0, 2 * math.pi, 4)
    lift, tilt = rng.uniform(56, 64), rng.uniform(-105, -90)

    def arm(t):
        wave = [size[k] * smooth(t, 0, 1) * math.sin(rate[k] * t + phase[k]) for k in range(4)]
        return arm_pose(lift + 7 * wave[0], tilt + 9 * wave[1], 0.10 + 0.08 * wave[2], 180 + middle + 25 * wave[3])
    return arm


def manoeuvre(number):
    """Arm targets, drive command and slope of a log."""
    rng = np.random.default_rng(MANOEUVRE_SEED + number)
    kind = number % 3
    arm = arm_motion(rng, 0.35 if kind == 1 else 1.0)
    if kind == 0:
        return arm, standing, (0.0, 0.0)
    if kind == 1:
        start, top, turn = rng.uniform(0, 0.6), rng.uniform(1.4, 2.2), rng.choice([-1, 1]) * rng.uniform(0.25, 0.5)

        def drive(t):
            return via(t, (0, start), (1.5, top), (2.5, top), (3.8, 0)), turn * (smooth(t, 0.8, 1.6) - smooth(t, 2.2, 3.0))
        return arm, drive, (0.0, 0.0)
    roll, pitch = rng.uniform(-4, 4) * DEGREE, rng.uniform(-4, 4) * DEGREE
    # on a slope the wheel servo holds still only with a small uphill command
    return arm, lambda t: (-0.44 * math.sin(pitch), 0.0), (roll, pitch)


def simulated(nominal, number):
    """Scenario, MuJoCo model, true rows and sensors of one log."""
    from simulate import Scenario
    rng = np.random.default_rng(DRAW_SEED + number)
    machine, radii, stiffness = true_machine(nominal, rng)
    sensors = Sensors(rng)
    arm, drive, slope = manoeuvre(number)
    scenario = Scenario(f"coverage_{number:02}", machine, SECONDS, arm, drive, slope=slope, clear=2.5, seed=NOISE_SEED + number)
    mujoco_model, rows = run(scenario, lambda xml: with_wheels(xml, radii, stiffness))
    return scenario, mujoco_model, rows, sensors


def write_log(scenario, mujoco_model, rows, sensors, out):
    types = typestore()
    rows = [sensors.encoders(row, mujoco_model) for row in rows[::5]]
    seen_by_imu = messages(scenario, mujoco_model, [sensors.imu(row) for row in rows], types)
    # the same seed gives both lists the same times and noise
    others = messages(scenario, mujoco_model, rows, types)
    events = [turned if turned[1] == "/imu/data" else event for event, turned in zip(others, seen_by_imu, strict=True)]
    path = out / f"{scenario.name}.mcap"
    write_mcap(thinned(events, EVERY), types, path)
    return path


def truth(number, machine, rows):
    """Smoothed true loads at the stamps of the log, without the ends."""
    import polars
    inner = rows[TRUTH_HALF_WINDOW:-TRUTH_HALF_WINDOW:5]
    loads = {column: savitzky_golay([row[column] for row in rows])[::5].astype(np.float32) for column in wheel_columns(machine)}
    return polars.DataFrame({"log": np.full(len(inner), number, np.int32), "t_ns": [stamp(row["t"]) for row in inner], **loads})


def main():
    arguments = lab_arguments(__doc__, [str(number) for number in range(LOGS)])
    import machine_file
    import model
    import polars
    import writelog
    writelog.NOISE |= {"acc_bias": 0.0, "gyro_bias": 0.0}    # replaced by the drawn biases
    nominal = model.rigid(yaw0=0.0)
    (arguments.out / "coverage.urdf").write_text(model.urdf(nominal))
    # the simulated ground is a plane, so tyre stiffness and wheel heights determine the load split
    text = machine_file.machine_toml(nominal, "coverage.urdf").replace("front_share = 0.5", 'ground = "plane"')
    (arguments.out / "coverage.toml").write_text(text)
    tables = []
    for number in map(int, arguments.names):
        scenario, mujoco_model, rows, sensors = simulated(nominal, number)
        say(write_log(scenario, mujoco_model, rows, sensors, arguments.out), nominal, rows)
        tables.append(truth(number, nominal, rows))
    polars.concat(tables).write_parquet(arguments.out / "coverage.truth.parquet", compression_level=19)


if __name__ == "__main__":
    main()
