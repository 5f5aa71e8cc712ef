"""Make `forwarder6` and `forwarder6_bump`: a six-wheeled forwarder whose rear wheels stand on two free bogies.

    .venv/bin/python make_forwarder.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives for each fixture NAME.mcap (noisy, joint states 100 Hz, IMU 125 Hz, odometry 25 Hz),
NAME.toml, NAME.urdf and NAME.truth.parquet (wheel loads at 500 Hz, along the vertical).

forwarder6       6 s, level ground, standing. The crane, with 400 kg in its grapple, swings from the right to the left and lifts.
forwarder6_bump  6 s. The right bogie's front wheel rolls slowly up a smooth ridge of 6 cm and stops on its top; then the crane, empty,
                 slews from the rear to the left.

The crane is the laboratory's arm. The rest is made up after forwarders of 14 t payload class, unladen: wheelbase 4.2 m, track 2.1 m, wheels of 1.3 m.
The bogies turn freely on lateral pivots: no actuator, no friction. Bogie angles are in the joint states.
"""
import dataclasses
import math

import numpy as np

from fixture_tools import arm_pose, lab_arguments, run, smooth, standing, via, write_fixture

RADIUS, HALF_WIDTH = 0.65, 0.15
TYRE = 7.0e5, 2.5e4              # N/m, N s/m: 2.5 cm under 18 kN
AXLE_HEIGHT = -0.25              # of all wheel centres, in base_link
FRONT_AXLE, BOGIE_PIVOT, BOGIE_HALF, HALF_TRACK = 2.2, -2.0, 0.75, 1.05    # m
RIDGE_RADIUS, RIDGE_HEIGHT, RIDGE_AT = 3.0, 0.06, 0.55                    # m; x of the top
BOGIES = ["bogie_left", "bogie_right"]


def forwarder(payload):
    """The machine with a payload in its grapple [kg]."""
    from model import Link, Machine, hydraulic_arm
    links = [Link("base_link", None, mass=5900.0, com=(0.55, 0.0, 0.30), inertia=np.array([[2900.0, 0, 150.0], [0, 14500.0, 0], [150.0, 0, 15200.0]]))]
    for side in ("left", "right"):
        y = 0.80 if side == "left" else -0.80
        links.append(Link(f"bogie_{side}", "base_link", (BOGIE_PIVOT, y, AXLE_HEIGHT + 0.06), np.eye(3), (f"bogie_{side}", "revolute", (0, 1, 0)),
                          380.0, (0, 0, -0.04), np.diag([12.0, 70.0, 72.0])))
    wheels = {}
    for name in ("FL", "FR", "ML", "MR", "RL", "RR"):
        y = HALF_TRACK if name[1] == "L" else -HALF_TRACK
        parent, place = "base_link", (FRONT_AXLE, y, AXLE_HEIGHT)
        if name[0] != "F":
            bogie = "bogie_left" if name[1] == "L" else "bogie_right"
            parent, place = bogie, (BOGIE_HALF if name[0] == "M" else -BOGIE_HALF, y - math.copysign(0.80, y), -0.06)
        link = f"wheel_{name.lower()}"
        links.append(Link(link, parent, place, np.eye(3), (link, "continuous", (0, 1, 0)),
                          260.0, (0, 0, 0), np.diag([38.0, 62.0, 38.0]), geom="wheel"))
        wheels[name] = link, RADIUS
    arm, linkages, joints = hydraulic_arm("base_link", (0.55, 0.0, 0.65), 0.0, True, payload)
    return Machine("forwarder6", links + arm, linkages, wheels, joints, z0=RADIUS - AXLE_HEIGHT, imu=(0.3, 0.1, 0.2))


def with_wheels(xml):
    size = "type='ellipsoid' size='0.35 0.12 0.35'"
    assert xml.count(size) == 6
    return xml.replace(size, f"type='ellipsoid' size='{RADIUS} {HALF_WIDTH} {RADIUS}'")


def crane(t):
    up = via(t, (0.3, 0), (2.2, 1), (3.0, 1), (5.0, 0))
    return arm_pose(30 + 20 * up, -55 - 20 * up, 0.3 - 0.1 * up, via(t, (0.5, -100), (4.6, 75)))


def crane_after_the_climb(t):
    return arm_pose(52, -95 + 25 * smooth(t, 3.0, 5.0), 0.1, 170 - 70 * smooth(t, 2.6, 5.4))


def roll(t):
    return 0.45 * via(t, (0, 1), (1.4, 1), (2.6, 0)), 0.0


def ridge():
    """A cylinder across the path of the right wheels, sunk so that its top is at the ridge height."""
    z = RIDGE_HEIGHT - RIDGE_RADIUS
    lateral = "0.7071067811865476 0.7071067811865476 0 0"
    return (f"<geom name='ridge' type='cylinder' size='{RIDGE_RADIUS} 0.4' pos='{RIDGE_AT} {-HALF_TRACK} {z}' quat='{lateral}' contype='2' conaffinity='1' "
            "friction='0.9 0.01 0.005' condim='4' solref='0.004 1.0' solimp='0.98 0.98 0.001'/>")


def scenarios():
    """The manoeuvres to simulate, by name."""
    from simulate import Scenario
    return {
        "forwarder6": Scenario("forwarder6", forwarder(400.0), 6.0, crane, standing, clear=3.0, seed=41),
        "forwarder6_bump": Scenario("forwarder6_bump", forwarder(0.0), 6.0, crane_after_the_climb, roll, ground=ridge(), clear=2.0, seed=42),
    }


def edit_toml(text):
    contact = "front_share = 0.5\ntyre_stiffness = 8.0e5"
    assert contact in text
    return text.replace(contact, f"free_joints = {BOGIES}\ntyre_stiffness = {TYRE[0]}".replace("'", '"'))


def write_forwarder(scenario, mujoco_model, rows, out):
    """Writes the four files of a fixture. The laboratory logs the arm joints that it drives; the free bogie joints are only logged."""
    import model
    machine = scenario.machine
    logged = dataclasses.replace(scenario, machine=dataclasses.replace(machine, arm_joints=machine.arm_joints + BOGIES))
    urdf = model.urdf(machine).replace("radius='0.35' length='0.24'", f"radius='{RADIUS}' length='{2 * HALF_WIDTH}'")
    write_fixture(logged, mujoco_model, rows, out, edit_toml=edit_toml, urdf=urdf)


def main():
    arguments = lab_arguments(__doc__, ["forwarder6", "forwarder6_bump"])
    known = scenarios()
    for name in arguments.names:
        write_forwarder(known[name], *run(known[name], with_wheels, TYRE), arguments.out)


if __name__ == "__main__":
    main()
