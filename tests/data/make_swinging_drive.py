"""Make `swinging_drive`: the machine with the active suspension drives, turns and brakes while its loaded arm swings from side to side.

    .venv/bin/python make_swinging_drive.py LAB OUT [SEED...]

LAB is the folder of the simulation laboratory, OUT receives swinging_drive.mcap (without noise; joint states 25 Hz, IMU 62.5 Hz, odometry 12.5 Hz),
swinging_drive.toml, swinging_drive.urdf and swinging_drive.truth.parquet (wheel loads at 50 Hz, smoothed). The rods stay locked at mid-stroke.
With seeds, random manoeuvres of the same kind are made instead, each in files of its own (swinging_drive_SEED), for trials beyond the fixture.

Wheels lift for moments, and others come near it. The manoeuvre is one on which a control of the suspension can do harm: the lightest wheel changes
sides with the arm, and the machine brakes when the rods would have to reverse.
"""
import math
import random

from fixture_tools import arm_pose, lab_arguments, run, smooth, write_fixture

SECONDS = 14.0
#        lift, tilt (degrees), extension (m), slew amplitude (degrees) and rate (rad/s), speed (m/s), brake time (s), yaw rate (rad/s)
FIXTURE = (41.0, -76.0, 0.25, 60.0, 1.0, 0.36, 0.61, 0.17)


def drawn(seed):
    draw = random.Random(seed).uniform
    return (draw(35, 60), draw(-95, -60), draw(0.1, 0.5), draw(30, 80), draw(0.5, 1.3), draw(0.3, 1.2), draw(0.6, 1.6), draw(-0.25, 0.25))


def manoeuvre(lift, tilt, extension, swing, rate, speed, brake, yaw):
    def arm(t):
        start = smooth(t, 0, 1.5)
        pose = arm_pose(lift + 4 * start * math.sin(0.8 * t), tilt + 5 * start * math.sin(1.3 * t), extension, swing * start * math.sin(rate * t))
        return pose | {"suspension_right": -0.1, "suspension_left": -0.1}

    def drive(t):
        forward = smooth(t, 0.5, 2.5) - smooth(t, 5.0, 5.0 + brake) + smooth(t, 7.0, 9.0) - smooth(t, 11.5, 11.5 + brake)
        return speed * forward, yaw * (smooth(t, 2.0, 3.0) - smooth(t, 4.0, 5.0) - smooth(t, 9.0, 10.0) + smooth(t, 10.5, 11.5))

    return arm, drive


def main():
    arguments = lab_arguments(__doc__, [])
    import model
    from simulate import Scenario
    for name, values in [(f"swinging_drive_{seed}", drawn(int(seed))) for seed in arguments.names] or [("swinging_drive", FIXTURE)]:
        arm, drive = manoeuvre(*values)
        scenario = Scenario(name, model.bogie(), SECONDS, arm, drive, clear=2.5, seed=62, noise=0.0)
        mujoco_model, rows = run(scenario)
        every = {"/joint_states": 4, "/imu/data": 4, "/odom": 4, "/robot_description": 0}
        write_fixture(scenario, mujoco_model, rows, arguments.out, every=every, smoothed_truth=True)


if __name__ == "__main__":
    main()
