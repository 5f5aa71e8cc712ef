"""Make `corner_brake` and `bogie_drive`: machines that drive while the arm moves.

    .venv/bin/python make_driving.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives for each fixture NAME.mcap (noisy, joint states 100 Hz, IMU 125 Hz, odometry 25 Hz),
NAME.toml, NAME.urdf and NAME.truth.parquet (wheel loads at 500 Hz).

corner_brake  7 s, level ground. The machine accelerates to 2 m/s, drives a left-hand curve, straightens and brakes with up to 2.4 m/s², the arm
              moving in front of it.
bogie_drive   6 s. The forwarder of `make_forwarder.py` drives with both bogies over ridges of 4 cm, the left ones half a metre before the
              right ones, the crane moving.
"""
import math

import make_forwarder
from fixture_tools import arm_pose, lab_arguments, run, smooth, write_fixture

RIDGES = {"left": (0.2, 1.5), "right": (0.7, 2.0)}    # m: x of their tops, in base_link at the start
RIDGE_RADIUS, RIDGE_HEIGHT = 2.0, 0.04                # m


def corner_arm(t):
    return arm_pose(50 + 4 * math.sin(0.9 * t), -85 + 5 * math.sin(1.3 * t), 0.1, 20 * math.sin(0.6 * t))


def corner_drive(t):
    speed = 2.0 * (smooth(t, 0.2, 2.6) - smooth(t, 5.0, 6.6))
    return speed, 0.45 * (smooth(t, 2.2, 3.2) - smooth(t, 4.2, 5.0))


def crane(t):
    return arm_pose(48 + 3 * math.sin(0.8 * t), -85 + 5 * math.sin(1.1 * t), 0.1, 170 + 15 * math.sin(0.5 * t))


def bogie_roll(t):
    return 0.6 * smooth(t, 0.2, 1.4), 0.0


def ridges():
    """Cylinders across the paths of the left and right wheels, sunk so that their tops are at the ridge height."""
    z = RIDGE_HEIGHT - RIDGE_RADIUS
    text = ""
    for side, places in RIDGES.items():
        y = make_forwarder.HALF_TRACK if side == "left" else -make_forwarder.HALF_TRACK
        for i, x in enumerate(places):
            text += (f"<geom name='ridge_{side}_{i}' type='cylinder' size='{RIDGE_RADIUS} 0.4' pos='{x} {y} {z}' "
                     "quat='0.7071067811865476 0.7071067811865476 0 0' contype='2' conaffinity='1' "
                     "friction='0.9 0.01 0.005' condim='4' solref='0.004 1.0' solimp='0.98 0.98 0.001'/>")
    return text


def corner_brake(out):
    import model
    from simulate import Scenario
    scenario = Scenario("corner_brake", model.rigid(yaw0=0.0), 7.0, corner_arm, corner_drive, clear=2.0, seed=51)
    write_fixture(scenario, *run(scenario), out)


def bogie_drive(out):
    from simulate import Scenario
    scenario = Scenario("bogie_drive", make_forwarder.forwarder(0.0), 6.0, crane, bogie_roll, ground=ridges(), clear=2.0, seed=52)
    mujoco_model, rows = run(scenario, make_forwarder.with_wheels, make_forwarder.TYRE)
    make_forwarder.write_forwarder(scenario, mujoco_model, rows, out)


def main():
    known = {"corner_brake": corner_brake, "bogie_drive": bogie_drive}
    arguments = lab_arguments(__doc__, list(known))
    for name in arguments.names:
        known[name](arguments.out)


if __name__ == "__main__":
    main()
