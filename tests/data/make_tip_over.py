"""Make `tip_over`: a machine that tips over the side while its arm reaches out downhill.

    .venv/bin/python make_tip_over.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives tip_over.mcap (noisy, joint states 50 Hz, IMU 125 Hz, odometry 25 Hz), .toml, .urdf
and .truth.parquet (wheel loads at 500 Hz, one every 4 ms, not smoothed: a wheel lifts where its load becomes zero).

tip_over    about 7 s, side slope of 10 degrees, standing. From 1 s on the arm reaches out over the left side, downhill. The rear right wheel lifts,
            then the front right one, and the machine rotates about its left edge until it lies on its side.
"""
import math

from fixture_tools import EVERY, arm_pose, lab_arguments, run, smooth, standing, write_fixture

LOG_EVERY = EVERY | {"/joint_states": 2}


def reaching_arm(t):
    out = smooth(t, 1, 6.5)
    return arm_pose(45 - 30 * out, -80 + 50 * out, 0.1 + 0.8 * out, 90)


def scenarios():
    """The manoeuvre to simulate, by name."""
    import model
    from simulate import Scenario
    slope = (-10 * math.pi / 180, 0.0)
    machine = model.rigid(yaw0=0.0, payload=100.0)
    return {"tip_over": Scenario("tip_over", machine, 12.0, reaching_arm, standing, slope=slope, clear=2.5, seed=41)}


def thin_truth(path, every):
    """Keeps every n-th row of a truth table, in single precision."""
    import polars
    loads = polars.col("^load_.*$").cast(polars.Float32)
    polars.read_parquet(path).gather_every(every).with_columns(loads).write_parquet(path)


def main():
    arguments = lab_arguments(__doc__, ["tip_over"])
    known = scenarios()
    for name in arguments.names:
        write_fixture(known[name], *run(known[name]), arguments.out, every=LOG_EVERY)
        thin_truth(arguments.out / f"{name}.truth.parquet", 2)


if __name__ == "__main__":
    main()
