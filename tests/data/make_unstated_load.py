"""Make `unstated_load`: a machine that tips over the side with 350 kg on its tool that its machine file lacks.

    .venv/bin/python make_unstated_load.py LAB OUT [name...]

LAB is the folder of the simulation laboratory, OUT receives NAME.mcap (noisy, joint states 50 Hz, IMU 125 Hz, odometry 25 Hz), .toml, .urdf (both
without the load) and .truth.parquet (wheel loads at 250 Hz). The load is fixed to `tool`, with its centre of mass at (0.405, -0.431, -0.013) m in that
frame. The machine stands on a side slope and tips over its left edge, downhill, until it lies on its side. Other logs than `unstated_load` are not part of
the repository; they check that nothing was tuned to it.

unstated_load   350 kg, slope of 2 degrees: the retracted arm reaches out from 1 s on
reach_200       200 kg, slope of 4 degrees, otherwise the same
swing_350       350 kg, slope of 6 degrees: the arm swings from the rear over the left side
swing_200       200 kg, slope of 8 degrees: the same, stretched and faster
reach_stated, swing_stated   as the first of each kind, with the load in the URDF
swing_none      no load, slope of 16 degrees
"""
import math

from fixture_tools import EVERY, arm_pose, lab_arguments, run, smooth, standing, write_fixture
from make_tip_over import LOG_EVERY, thin_truth

def reaching_arm(t):
    out = smooth(t, 1, 6)
    return arm_pose(60 - 45 * out, -100 + 70 * out, 0.05 + 0.9 * out, 90)


def swinging_arm(t):
    return arm_pose(40, -60, 0.3, 160 - 70 * smooth(t, 1, 3))


def stretched_arm(t):
    return arm_pose(35, -55, 0.4, 160 - 70 * smooth(t, 1, 2.6))


#       load (kg), whether the URDF contains it, slope (degrees), manoeuvre, seed
LOGS = {
    "unstated_load": (350, False, 2, reaching_arm, 71),
    "reach_200": (200, False, 4, reaching_arm, 72),
    "swing_350": (350, False, 6, swinging_arm, 73),
    "swing_200": (200, False, 8, stretched_arm, 74),
    "reach_stated": (350, True, 2, reaching_arm, 75),
    "swing_stated": (350, True, 6, swinging_arm, 76),
    "swing_none": (0, False, 16, stretched_arm, 77),
}


def main():
    arguments = lab_arguments(__doc__, list(LOGS)[:1])
    import model
    from simulate import Scenario
    for name in arguments.names:
        kilograms, is_stated, degrees, arm, seed = LOGS[name]
        slope = (-degrees * math.pi / 180, 0.0)
        machine = model.rigid(yaw0=0.0, payload=float(kilograms))
        scenario = Scenario(name, machine, 12.0, arm, standing, slope=slope, clear=2.5, seed=seed)
        urdf = model.urdf(machine if is_stated else model.rigid(yaw0=0.0))
        write_fixture(scenario, *run(scenario), arguments.out, every=LOG_EVERY, urdf=urdf)
        thin_truth(arguments.out / f"{name}.truth.parquet", 2)


if __name__ == "__main__":
    main()
