"""Make `commissioning`, `commissioning_wide` and `commissioning_bogie`: the drive by which a machine is commissioned, on two machines.

    .venv/bin/python make_commissioning.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives for each fixture NAME.mcap (noisy, joint states 25 Hz, IMU 62.5 Hz, odometry 12.5 Hz),
NAME.toml, NAME.urdf and NAME.truth.parquet (wheel loads at 50 Hz, smoothed).

The machine stands on ground that falls by one degree, drives forward, brakes, drives backward, brakes, drives a full circle to the left and a quarter
circle to the right; then each joint moves alone, back and forth. `commissioning` is the machine of the first paper with steered front wheels,
`commissioning_bogie` one with skid steering and two actuated bogies, whose rods move alone as well. `commissioning_wide` is the
drive of the first machine over the whole range in which it works: how a machine is to be commissioned. That of `commissioning` is shorter, and proves less.
"""
import math

from fixture_tools import DEGREE, arm_pose, lab_arguments, run, smooth, via, write_fixture

EVERY = {"/joint_states": 4, "/imu/data": 4, "/odom": 4, "/robot_description": 0}
SLOPE = (0.6 * DEGREE, 0.8 * DEGREE)
MIDDLE = -0.1                                            # m: rods of the suspension


def pulse(t, start, top, end):
    """From 0 to 1 and back."""
    return smooth(t, start, top) - smooth(t, top, end)


def drive(left, right, slow=1.2, until=27.6):
    """Forward, backward, a circle to the left and a piece of one to the right, at a speed in m/s and yaw rates in rad/s."""
    def command(t):
        speed = via(t, (2.0, 0.0), (4.0, 1.6), (4.6, 1.6), (6.2, 0.0), (7.0, 0.0), (8.6, -1.0), (10.0, 0.0), (10.8, 0.0), (12.4, slow), (33.0, slow), (34.6, 0.0))
        yaw = left * (smooth(t, 12.4, 13.6) - smooth(t, until - 1.2, until)) - right * (smooth(t, until, until + 1.0) - smooth(t, 31.8, 33.0))
        return speed, yaw
    return command


def twice(t, start, seconds, middle, up, down):
    """From the middle up, down and up, down again and back, resting at each."""
    offsets = (0.0, up, down, up, down, 0.0)
    return via(t, *((start + seconds * i, middle + offset) for i, offset in enumerate(offsets)))


def arm(lift, tilt):
    """Joint targets around a folded posture: lift and tilt in degrees."""
    return lambda t: arm_pose(twice(t, 40.0, 1.3, lift, 28, -12), twice(t, 47.0, 1.3, tilt, 20, -10), twice(t, 54.0, 1.3, 0.15, 0.5, -0.05),
                              via(t, (35.0, 0), (36.4, 25), (37.8, -25), (39.2, 0)))


def wide_arm(t):
    """The same over the range in which the logs of `tests/calibration` work: all around, and a little farther in all joints."""
    return arm_pose(twice(t, 77.0, 1.3, 50, 28, -16), twice(t, 85.0, 1.3, -88, 20, -12), twice(t, 93.0, 1.5, 0.15, 0.6, -0.11),
                    via(t, (35.0, 0), (47.0, 200), (63.0, -200), (75.0, 0)))


def with_rods(arm):
    """Each rod of the suspension turns its bogie alone."""
    return lambda t: arm(t) | {"suspension_right": via(t, (61.0, MIDDLE), (62.0, MIDDLE + 0.005), (63.0, MIDDLE)),
                               "suspension_left": via(t, (63.8, MIDDLE), (64.8, MIDDLE + 0.005), (65.8, MIDDLE))}


REFERENCE = {"commissioning_wide": "lift = -1.201, tilt = -1.947, slew = 0.0, extension = 0.15",
             "commissioning": "lift = -1.201, tilt = -1.947, slew = 0.0, extension = 0.15",
             "commissioning_bogie": "suspension_right = -0.1, suspension_left = -0.1, lift = -1.114, tilt = -2.157, slew = 0.0, extension = 0.15"}


def with_reference(name):
    """States the posture of the drive as the reference posture."""
    return lambda text: text.replace("[limits]\n", f"[limits]\nreference_posture = {{ {REFERENCE[name]} }}\n")


def main():
    arguments = lab_arguments(__doc__, ["commissioning", "commissioning_wide", "commissioning_bogie"])
    import model
    from simulate import Scenario
    known = {"commissioning": lambda: Scenario("commissioning", model.rigid(yaw0=0.0), 61.5, arm(50, -88), drive(0.46, 0.4), slope=SLOPE, clear=2.0, seed=71),
             "commissioning_wide": lambda: Scenario("commissioning_wide", model.rigid(yaw0=0.0), 102.0, wide_arm, drive(0.46, 0.4), slope=SLOPE, clear=2.0, seed=73),
             "commissioning_bogie": lambda: Scenario("commissioning_bogie", model.bogie(), 67.0, with_rods(arm(55, -100)), drive(1.0, 0.0, 0.8, 32.0), slope=SLOPE, clear=2.5, seed=72)}
    for name in arguments.names:
        scenario = known[name]()
        mujoco_model, rows = run(scenario)
        write_fixture(scenario, mujoco_model, rows, arguments.out, every=EVERY, edit_toml=with_reference(name), smoothed_truth=True)


if __name__ == "__main__":
    main()
