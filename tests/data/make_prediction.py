"""Make the logs on which the prediction is judged: manoeuvres drawn at random, half of which lift a wheel.

    .venv/bin/python make_prediction.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives for each run OUT/SET/NAME.mcap (noisy, joint states 100 Hz, IMU 125 Hz, odometry
25 Hz), NAME.toml, NAME.urdf and NAME.truth.parquet (wheel loads at 250 Hz, not smoothed). They are too large for this repository; the same
seeds make the same logs. SET is `tuning` (the settings of the prediction were chosen on it), `held_out` (none was) or `stops` (what happens when the machine does brake,
and when the arm does stop).

reach    standing on a side slope of 3 to 12 degrees, the arm reaches out downhill
swing    standing on level ground, the stretched arm is slewed and stopped
brake    driving with the arm raised in front, braking
corner   driving into a curve
work     24 s, standing: the arm moves all the time; wheels keep their load unless a draw is unlucky
rough    24 s: driving over ridges of 1 to 3 cm with the arm folded
halt     standing, the stretched arm moves at a constant rate and stops within 0.2 to 0.6 s
"""
import math

import numpy as np

from fixture_tools import DEGREE, arm_pose, lab_arguments, run, smooth, standing, via, write_fixture
from make_tip_over import thin_truth

SETS = {"tuning": (1, {"reach": 3, "swing": 2, "brake": 3, "corner": 2, "work": 1, "rough": 1}),
        "held_out": (1001, {"reach": 5, "swing": 4, "brake": 5, "corner": 4, "work": 2, "rough": 2}),
        "stops": (2001, {"brake": 6, "halt": 8})}


def reach(rng):
    side, slope = rng.choice([-1, 1]), rng.uniform(3, 12) * math.pi / 180
    takes, far, lower, back = rng.uniform(2.0, 6.0), rng.uniform(0.4, 1.0), rng.uniform(15, 35), side * rng.uniform(0, 40)

    def arm(t):
        out = smooth(t, 1, 1 + takes) * far
        return arm_pose(50 - lower * out, -90 + 60 * out, 0.1 + 0.8 * out, 90 * side + back)
    return dict(duration=3.0 + takes, arm=arm, drive=standing, slope=(-side * slope, 0.0), payload=rng.uniform(0, 100))


def swing(rng):
    out, turn, takes = rng.uniform(0.0, 0.6), rng.uniform(60, 140) * rng.choice([-1, 1]), rng.uniform(1.8, 3.5)
    start = 180 - 0.5 * turn + rng.uniform(-40, 40)

    def arm(t):
        slew = via(t, (0.8, start), (0.8 + takes, start + turn), (3.0 + takes, start + turn), (5.5 + takes, start))
        return arm_pose(50 - 16 * out, -80 + 30 * out, 0.15 + 0.3 * out, slew)
    return dict(duration=6.0 + takes, arm=arm, drive=standing, payload=rng.uniform(0, 60))


def brake(rng):
    speed, deceleration, raised = rng.uniform(1.5, 3.0), rng.uniform(2.0, 6.0), rng.uniform(0.0, 1.0)
    stops = speed / deceleration * 1.875        # the greatest slope of `smooth` is 1.875 times its mean

    def arm(_t):
        return arm_pose(50 + 15 * raised, -90 + 40 * raised, 0.1 + 0.3 * raised, 0)
    return dict(duration=6.0, arm=arm, drive=lambda t: (speed * (smooth(t, 0, 2.5) - smooth(t, 3.2, 3.2 + stops)), 0.0), payload=rng.uniform(0, 60))


def corner(rng):
    speed, rate, slew = rng.uniform(1.5, 3.0), rng.uniform(0.4, 1.0) * rng.choice([-1, 1]), rng.uniform(60, 300)
    enters = rng.uniform(0.6, 1.6)

    def drive(t):
        return speed * smooth(t, 0, 2.5), rate * (smooth(t, 3, 3 + enters) - smooth(t, 5, 5 + enters))
    return dict(duration=7.0, arm=lambda _t: arm_pose(55, -75, 0.2, slew), drive=drive, payload=rng.uniform(0, 60))


def work(rng):
    w, phase = rng.uniform(0.5, 1.4, 4), rng.uniform(0, 2 * math.pi, 4)

    def arm(t):
        on = smooth(t, 0, 2)
        lift, tilt, out, slew = (on * math.sin(w[k] * t + phase[k]) for k in range(4))
        return arm_pose(48 + 6 * lift, -85 + 10 * tilt, 0.2 + 0.15 * out, 180 + 60 * slew)
    return dict(duration=24.0, arm=arm, drive=standing, slope=tuple(rng.uniform(-4, 4, 2) * math.pi / 180), payload=rng.uniform(0, 60))


def rough(rng):
    w = rng.uniform(0.3, 0.8, 2)
    ridges = ""
    for i, x in enumerate(np.cumsum(rng.uniform(0.8, 2.5, 30))):
        radius, height, y = 1.5, rng.uniform(0.01, 0.03), rng.choice([-0.875, 0.875])
        ridges += (f"<geom name='ridge_{i}' type='cylinder' size='{radius} 0.6' pos='{x + 2.0} {y} {height - radius}' "
                   "quat='0.7071067811865476 0.7071067811865476 0 0' contype='2' conaffinity='1' friction='0.9 0.01 0.005' condim='4' "
                   "solref='0.004 1.0' solimp='0.98 0.98 0.001'/>")

    def drive(t):
        return smooth(t, 0, 2) * (1.0 + 0.5 * math.sin(w[0] * t)) * (1 - smooth(t, 21, 23)), 0.05 * math.sin(w[1] * t)
    return dict(duration=24.0, arm=lambda t: arm_pose(44 + 2 * math.sin(0.7 * t), -85, 0.1, 180), drive=drive, ground=ridges, payload=rng.uniform(0, 60))


def halt(rng):
    out, slope = rng.uniform(0.2, 0.7), rng.uniform(-4, 4, 2) * math.pi / 180
    slews, rate, stops = rng.uniform() < 0.5, rng.uniform(0.4, 0.9), rng.uniform(0.2, 0.6)
    start, sign = rng.uniform(0, 360), rng.choice([-1, 1])

    def turned(t):
        """The angle after a rate that rises within 1 s, stays for 1 s and falls within `stops`: the integral of `smooth`."""
        def rise(t, begin, takes):
            s = min(1.0, max(0.0, (t - begin) / takes))
            return takes * s ** 4 * (2.5 + s * (s - 3)) + max(0.0, t - begin - takes)
        return rate * (rise(t, 0.5, 1.0) - rise(t, 2.5, stops))

    def arm(t):
        lowers = 0.0 if slews else 0.4 * turned(t) / DEGREE
        return arm_pose(52 - lowers, -85 + 30 * out, 0.1 + 0.6 * out, start + (sign * turned(t) / DEGREE if slews else 0.0))
    return dict(duration=5.0, arm=arm, drive=standing, slope=tuple(slope), payload=rng.uniform(0, 100))


MANOEUVRES = {f.__name__: f for f in (reach, swing, brake, corner, work, rough, halt)}


def draws():
    """Every run of both sets: set, name, family, seed."""
    for which, (seed, counts) in SETS.items():
        for family, count in counts.items():
            for k in range(count):
                yield which, f"{family}_{k}", family, seed
                seed += 1


def main():
    arguments = lab_arguments(__doc__, [])
    import model
    from simulate import Scenario
    for which, name, family, seed in draws():
        if arguments.names and f"{which}/{name}" not in arguments.names:
            continue
        drawn = MANOEUVRES[family](np.random.default_rng(seed))
        start = drawn["arm"](0.0)
        machine = model.rigid(yaw0=0.0, payload=drawn.pop("payload"))
        scenario = Scenario(name, machine, clear=2.5, seed=seed, **drawn)
        posture = ", ".join(f"{joint} = {position:.4f}" for joint, position in start.items())
        out = arguments.out / which
        out.mkdir(parents=True, exist_ok=True)
        write_fixture(scenario, *run(scenario), out,
                      edit_toml=lambda text: text.replace("[limits]", f"[limits]\nreference_posture = {{ {posture} }}"))
        thin_truth(out / f"{name}.truth.parquet", 2)


if __name__ == "__main__":
    main()
