"""Make the logs on which the comparison of sensors is measured, and on which none of its thresholds was chosen.

    .venv/bin/python make_wrong_sensors.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives for each log NAME.mcap (noisy, joint states 100 Hz, IMU 125 Hz, odometry 25 Hz),
NAME.toml, NAME.urdf and NAME.truth.parquet (wheel loads at 50 Hz, already smoothed). Only `side_reach` is kept in the repository.

rear_swing   8 s, standing on a slope of 3 degrees: an arm with 230 kg in its grapple, mounted turned by 20 degrees on softer tyres, swings
             over a rear wheel; the front wheels get light.
side_reach   9 s, standing on a slope of 5 degrees in pitch: the arm slews to the right, then reaches out; a wheel lifts.
soft_ground  9 s: the same on tyres and ground of a third of the stiffness in the machine file.
slalom       12 s, level ground: 1.6 m/s, curves to both sides, braking, the arm at work. No wheel lifts.
folded_drive 10 s, slope of 4 degrees: drives off, stops and works.
grapple      10 s: the arm takes 250 kg and puts them down again; the force on the tool is measured.
bogies       10 s, standing: the arm of a machine on two bogies works, slowly and fast.
"""
import math

from fixture_tools import DEGREE, arm_pose, lab_arguments, run, smooth, standing, via, write_fixture

SIDE_POSTURE = "reference_posture = { lift = -1.201, tilt = -2.087, slew = 0.175, extension = 0.05 }"
SOFT = 3e5, 9e3    # N/m, N s/m


def rear_swing(t):
    out = via(t, (0.8, 0), (3.4, 1), (6.2, 0))
    slew = via(t, (0.8, 95), (3.6, 170), (4.2, 170), (7.2, 100))
    return arm_pose(46 - 22 * out, -92 + 54 * out, 0.1 + 0.55 * out, slew)


def side_reach(t):
    slew = via(t, (0.7, 10), (3.5, -75), (6.8, -75), (8.8, -30))
    out = via(t, (2.6, 0), (5.2, 1), (7.6, 0.1))
    return arm_pose(50 - 22 * out, -96 + 52 * out, 0.05 + 0.4 * out, slew)


def slalom(t):
    v = 1.6 * smooth(t, 0.5, 2.5) - 1.6 * smooth(t, 9.5, 10.6)
    return v, 0.3 * (smooth(t, 2.5, 3.5) - 2 * smooth(t, 5, 6.5) + smooth(t, 8, 9))


def slalom_arm(t):
    return arm_pose(46 + 3 * math.sin(0.9 * t), -80 + 4 * math.sin(0.6 * t), 0.2, 15 * math.sin(0.5 * t))


def folded_drive(t):
    return 0.8 * (smooth(t, 0.4, 1.6) - smooth(t, 3.0, 4.0)), 0.0


def folded_arm(t):
    s = smooth(t, 4.5, 6)
    return arm_pose(48 - 6 * s * math.sin(1.1 * (t - 4.5)), -100 + 10 * s * math.sin(0.9 * (t - 4.5)), 0.1, 40 * s * math.sin(0.8 * (t - 4.5)))


def grapple_arm(t):
    return arm_pose(45 + via(t, (2.2, 0), (4, 8), (6, 8), (7.5, 0)), -75, 0.2, via(t, (3, 0), (6, 35), (6.5, 35), (9.5, 0)))


def grapple_force(t):
    return 0.0, 0.0, -250 * 9.8066 * (smooth(t, 1.5, 2.3) - smooth(t, 7.3, 7.9))


def bogies_arm(t):
    s, fast = smooth(t, 0.6, 2), smooth(t, 5, 6.5)
    return arm_pose(45 + 6 * s * math.sin(0.7 * t), -78 + 7 * s * math.sin(0.9 * t), 0.2, 35 * s * math.sin(0.6 * t) + 8 * fast * math.sin(2.2 * t))


def scenarios():
    """The manoeuvres to simulate, by name, and the tyres of each."""
    import model
    from simulate import Scenario
    turned = model.rigid(yaw0=20 * DEGREE, payload=230.0)
    return {
        "rear_swing": (Scenario("rear_swing", turned, 8.0, rear_swing, standing, slope=(3 * DEGREE, 0.0), clear=3.0, seed=41), (5e5, 1e4)),
        "side_reach": (Scenario("side_reach", model.rigid(yaw0=0.0, payload=100.0), 9.0, side_reach, standing, slope=(0.0, 5 * DEGREE), clear=3.0, seed=42), None),
        "soft_ground": (Scenario("soft_ground", model.rigid(yaw0=0.0), 9.0, side_reach, standing, clear=3.0, seed=43), SOFT),
        "slalom": (Scenario("slalom", model.rigid(yaw0=0.0), 12.0, slalom_arm, slalom, clear=2.0, seed=44), None),
        "folded_drive": (Scenario("folded_drive", model.rigid(yaw0=0.0), 10.0, folded_arm, folded_drive, slope=(0.0, 4 * DEGREE), clear=3.0, seed=45), None),
        "grapple": (Scenario("grapple", model.rigid(yaw0=0.0), 10.0, grapple_arm, standing, wrench=grapple_force, clear=2.0, seed=46), None),
        "bogies": (Scenario("bogies", model.bogie(), 10.0, bogies_arm, standing, clear=3.0, seed=47), None),
    }


def main():
    arguments = lab_arguments(__doc__, list(scenarios_names()))
    known = scenarios()
    for name in arguments.names:
        scenario, tyre = known[name]
        stated = "5.0e5" if name == "rear_swing" else "8.0e5"
        edit = lambda text: text.replace("tyre_stiffness = 8.0e5", f"tyre_stiffness = {stated}")
        if name == "side_reach":
            edit = lambda text: text.replace("min_load", f"{SIDE_POSTURE}\nmin_load")
        if name == "grapple":
            edit = lambda text: text.replace('odometry = "/odom"', 'odometry = "/odom"\ntool_wrench = "/tool_wrench"')
        write_fixture(scenario, *run(scenario, tyre=tyre), arguments.out, edit_toml=edit, smoothed_truth=True)


def scenarios_names():
    return "rear_swing", "side_reach", "soft_ground", "slalom", "folded_drive", "grapple", "bogies"


if __name__ == "__main__":
    main()
