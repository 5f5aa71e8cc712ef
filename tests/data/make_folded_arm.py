"""Make `folded_arm`: a machine on two actuated bogies, standing with the rods at mid-stroke, lifts its folded arm a little.

    .venv/bin/python make_folded_arm.py LAB OUT

LAB is the folder of the simulation laboratory, OUT receives folded_arm.mcap (joint states 25 Hz, IMU 62.5 Hz, odometry 12.5 Hz), folded_arm.toml,
folded_arm.urdf and folded_arm.truth.parquet. The centre of mass is 15 cm in front of the middle of the wheels, about twice what the
stroke can compensate: the case of Figs. 9 and 10 of A. Paz and J. Mattila, "Mechanic Modeling and Nonlinear Optimal Control of
Actively Articulated Suspension of Mobile Heavy-Duty Manipulators".
"""
import math

from fixture_tools import arm_pose, lab_arguments, run, smooth, standing, write_fixture

SECONDS = 16.0


def targets(t):
    s = smooth(t, 0, 2)
    return arm_pose(110 + 4 * s * math.sin(0.4 * t), -153, 0.0, 6 * s * math.sin(0.3 * t)) | {"suspension_right": -0.1, "suspension_left": -0.1}


def main():
    arguments = lab_arguments(__doc__, [])
    import model
    from simulate import Scenario
    scenario = Scenario("folded_arm", model.bogie(), SECONDS, targets, standing, clear=2.5, seed=62)
    mujoco_model, rows = run(scenario)
    every = {"/joint_states": 4, "/imu/data": 4, "/odom": 4, "/robot_description": 0}
    write_fixture(scenario, mujoco_model, rows, arguments.out, every=every, smoothed_truth=True)


if __name__ == "__main__":
    main()
