"""Make `swing_lift` and `hard_brake`: two manoeuvres that show the effect of dynamics on wheel loads.

    .venv/bin/python make_manoeuvres.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives for each fixture NAME.mcap (noisy, joint states 100 Hz, IMU 125 Hz, odometry 25 Hz),
NAME.toml, NAME.urdf and NAME.truth.parquet (wheel loads at 500 Hz).

swing_lift  7 s, level ground, standing. The arm is swung over the front left wheel and stopped; the rear right wheel lifts, the others keep
            their load.
hard_brake  5 s, level ground. The machine, its arm folded to the rear, drives at 3 m/s and brakes as hard as the tyres grip. All wheels
            keep their load.
"""
from fixture_tools import arm_pose, lab_arguments, run, smooth, standing, via, write_fixture

SPEED, DECELERATION, ONSET = 3.0, 6.4, 0.25   # of hard_brake: m/s, m/s^2, s


def swing_arm(t):
    out = via(t, (0.5, 0), (2.7, 0.52), (4.8, 0))
    slew = via(t, (0.6, -25), (2.9, 53), (3.6, 53), (6.4, 0))
    return arm_pose(50 - 16 * out, -80 + 30 * out, 0.15 + 0.25 * out, slew)


def ramp(t, start, onset):
    """0 before start, then rising with a slope that grows to 1 within `onset`: the integral of `smooth`."""
    s = min(1.0, max(0.0, (t - start) / onset))
    return onset * s**4 * (2.5 + s * (s - 3)) + max(0.0, t - start - onset)


def brake_arm(_t):
    return arm_pose(44, -85, 0.1, 180)


def brake_drive(t):
    braked = DECELERATION * (ramp(t, 2.9, ONSET) - ramp(t, 2.9 + SPEED / DECELERATION, ONSET))
    return SPEED * smooth(t, 0, 2.4) - braked, 0.0


def scenarios():
    """The manoeuvres to simulate, by name."""
    import model
    from simulate import Scenario
    return {
        "swing_lift": Scenario("swing_lift", model.rigid(yaw0=0.0, payload=60.0), 7.0, swing_arm, standing, clear=2.5, seed=31),
        "hard_brake": Scenario("hard_brake", model.rigid(yaw0=0.0), 5.0, brake_arm, brake_drive, clear=2.0, seed=32),
    }


def main():
    arguments = lab_arguments(__doc__, ["swing_lift", "hard_brake"])
    known = scenarios()
    for name in arguments.names:
        write_fixture(known[name], *run(known[name]), arguments.out)


if __name__ == "__main__":
    main()
