"""Make `second_paper`: the second paper's comparison (its Figs. 5 and 6) on a machine of its class.

    .venv/bin/python make_second_paper.py LAB OUT

LAB is the folder of the simulation laboratory, OUT receives second_paper.mcap (without noise, as in the paper's comparison; joint states 25 Hz, IMU 62.5 Hz, odometry 12.5 Hz),
second_paper.toml, second_paper.urdf and second_paper.truth.parquet (wheel loads at 50 Hz, already smoothed).

The commands are (32)-(34) of A. Paz and J. Mattila, "Mechanic Modeling and Nonlinear Optimal Control of Actively Articulated Suspension of
Mobile Heavy-Duty Manipulators", as far as the simulated machine, a different one with four instead of seven arm joints, can follow them without
tipping over:

    arm         q = q_a + q_b sin(t)     here sin(t / 2); slew by 1.2 rad instead of 4 pi, lift by 0.6 rad, the second boom 0.65 rad
                                         further in, extension from 0.1 to 0.5 m
    wheels      right pi/5 rad/s, left pi/10 rad/s
    suspension  x = -0.1 + 0.07 sin(0.3 t) m, both rods; one period and more
"""
import math

from fixture_tools import lab_arguments, run, smooth, write_fixture

SECONDS = 24.0
SLEW, LIFT, TILT, EXTENSION = (0.0, 1.2), (0.5, 0.6), (-1.15, -0.4), (0.3, 0.2)    # middle and amplitude: rad, rad, rad, m
ROD, ROD_RATE = (-0.1, 0.07), 0.3                                                  # m, rad/s
ARM_RATE = 0.5                                                                     # rad/s
RADIUS, HALF_TRACK = 0.35, 0.875
RIGHT, LEFT = math.pi / 5 * RADIUS, math.pi / 10 * RADIUS                          # m/s


def targets(t):
    """Arm joints, whose zeros differ from the published ones, and suspension rods."""
    start = smooth(t, 0, 2)
    s = start * math.sin(ARM_RATE * t)
    of = lambda joint: joint[0] + joint[1] * s
    rod = ROD[0] + ROD[1] * start * math.sin(ROD_RATE * t)
    return {"slew": of(SLEW), "lift": of(LIFT) - 2.0736, "tilt": of(TILT) - 0.4116, "extension": of(EXTENSION),
            "suspension_right": rod, "suspension_left": rod}


def drive(t):
    start = smooth(t, 0, 2)
    return start * (RIGHT + LEFT) / 2, start * (RIGHT - LEFT) / (2 * HALF_TRACK)


def main():
    arguments = lab_arguments(__doc__, [])
    import model
    from simulate import Scenario
    scenario = Scenario("second_paper", model.bogie(), SECONDS, targets, drive, clear=2.5, seed=61, noise=0.0)
    mujoco_model, rows = run(scenario)
    every = {"/joint_states": 4, "/imu/data": 4, "/odom": 4, "/robot_description": 0}
    write_fixture(scenario, mujoco_model, rows, arguments.out, every=every, smoothed_truth=True)


if __name__ == "__main__":
    main()
