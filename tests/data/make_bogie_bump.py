"""Make `bogie_bump`: a stiff machine on uneven ground, with the pressures of its suspension cylinders.

    .venv/bin/python make_bogie_bump.py LAB OUT

LAB is the folder of the simulation laboratory, OUT receives bogie_bump.mcap (noisy, joint states 50 Hz, IMU 125 Hz, odometry 25 Hz),
bogie_bump.toml, bogie_bump.urdf and bogie_bump.truth.parquet (wheel loads at 50 Hz, already smoothed). The machine stands on two bogies, each
turned by a cylinder. Its front right wheel climbs a ridge of RIDGE_HEIGHT and stands on top; then the arm moves. At 50 Hz the log also has, for
both sides,

    /suspension/SIDE/piston_pressure  sensor_msgs/FluidPressure [Pa]
    /suspension/SIDE/rod_pressure

Piston pressure times piston area minus rod pressure times ring area is the force of the simulated actuator including seal friction, a share FRICTION of
the force that opposes the motion.
"""
import math

import numpy as np

from fixture_tools import lab_arguments, arm_pose, run, smooth, stamp, typestore, via, write_fixture

SECONDS = 8.0
RIDGE_RADIUS, RIDGE_HEIGHT, RIDGE_AT, WHEEL_AT = 2.5, 0.015, 2.1, 1.5     # m; along x
EVERY_ROW = 10                              # of the 500 Hz rows
PRESSURE_NOISE = 4e4                        # Pa
FRICTION, CREEP = 0.02, 2e-3                # share of the force; speed in m/s at which friction reaches three quarters of it
PISTON, ROD = 0.100, 0.056                  # diameters, m
PISTON_AREA, RING_AREA = math.pi / 4 * PISTON**2, math.pi / 4 * (PISTON**2 - ROD**2)
BACK_PRESSURE = 2.0e6                       # Pa, on the rod side
SIDES = ("right", "left")


def targets(t):
    moved = via(t, (3.2, 0), (5.0, 1), (7.4, 0.3))
    return arm_pose(44 - 6 * moved, -85 + 8 * moved, 0.15 + 0.1 * moved, 180 - 35 * moved) | {
        "suspension_right": -0.1, "suspension_left": -0.1 + 0.004 * smooth(t, 5.4, 7.2)}


def drive(t):
    distance = RIDGE_AT - WHEEL_AT
    # the integral of a speed that rises and falls smoothly within 0.8 s each, from 0.3 to 3.0 s
    speed = distance / (3.0 - 0.3 - 0.8)
    return speed * (smooth(t, 0.3, 1.1) - smooth(t, 2.2, 3.0)), 0.0


def ridge():
    """A cylinder across the path of the right wheels, sunk so that its top is at the ridge height."""
    lateral = "0.7071067811865476 0.7071067811865476 0 0"
    return (f"<geom name='ridge' type='cylinder' size='{RIDGE_RADIUS} 0.3' pos='{RIDGE_AT} -0.875 {RIDGE_HEIGHT - RIDGE_RADIUS}' quat='{lateral}' "
            "contype='2' conaffinity='1' friction='0.9 0.01 0.005' condim='4' solref='0.004 1.0' solimp='0.98 0.98 0.001'/>")


def pressures(scenario, mujoco_model, rows, types):
    """The messages of the cylinder topics."""
    rng = np.random.default_rng(scenario.seed + 100)
    header_type, time_type = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    fluid_pressure = types.types["sensor_msgs/msg/FluidPressure"]
    for row in rows[::EVERY_ROW]:
        time_ns = stamp(row["t"])
        header = header_type(stamp=time_type(sec=time_ns // 10**9, nanosec=time_ns % 10**9), frame_id="")
        for side in SIDES:
            rod = f"suspension_{side}"
            force = row["actuators"][rod]
            velocity = row["qvel"][mujoco_model.jnt_dofadr[mujoco_model.joint(rod).id]]
            force += FRICTION * abs(force) * math.tanh(velocity / CREEP)
            chambers = {"piston": (force + BACK_PRESSURE * RING_AREA) / PISTON_AREA, "rod": BACK_PRESSURE}
            if force < -BACK_PRESSURE * RING_AREA:
                chambers = {"piston": 0.0, "rod": -force / RING_AREA}
            for chamber, pressure in chambers.items():
                value = float(round(pressure + rng.normal(0, PRESSURE_NOISE), -2))
                message = fluid_pressure(header=header, fluid_pressure=value, variance=PRESSURE_NOISE**2)
                late = time_ns + int(rng.uniform(0.2, 3.0) * 1e6)
                yield late, f"/suspension/{side}/{chamber}_pressure", "sensor_msgs/msg/FluidPressure", message


def main():
    arguments = lab_arguments(__doc__, [])
    import model
    from simulate import Scenario
    scenario = Scenario("bogie_bump", model.bogie(), SECONDS, targets, drive, ground=ridge(), clear=2.5, seed=71)
    mujoco_model, rows = run(scenario)
    every = {"/joint_states": 2, "/imu/data": 2, "/odom": 2, "/robot_description": 0}
    events = pressures(scenario, mujoco_model, rows, typestore())
    write_fixture(scenario, mujoco_model, rows, arguments.out, every=every, more=events, smoothed_truth=True)


if __name__ == "__main__":
    main()
