"""T* of the machine on bogies, from Pinocchio: how the loads of a machine at rest answer to position and acceleration of
its suspension's rods.

    python make_critical_step_reference.py LAB OUT

LAB is the simulation lab (its model.py and simulate.py). The rods move alike, the bogies stand on level ground, so the
base turns about the bogies' pivots by minus their angle. Loads are those of equal springs. Nothing of this repository
takes part.
"""

import json
import math
import sys
import tempfile
from pathlib import Path

LAB, OUT = Path(sys.argv[1]), Path(sys.argv[2])
sys.path.insert(0, str(LAB))

import model  # noqa: E402
import numpy as np  # noqa: E402
import pinocchio as pin  # noqa: E402
import simulate  # noqa: E402
from scenarios import pose  # noqa: E402

MACHINE = model.bogie()
with tempfile.NamedTemporaryFile("w", suffix=".urdf") as urdf:
    urdf.write(model.urdf(MACHINE))
    urdf.flush()
    MODEL = pin.buildModelFromUrdf(urdf.name, pin.JointModelFreeFlyer())
MODEL.gravity.linear = np.array([0, 0, -model.G])
DATA = MODEL.createData()
STEP = 1e-3  # m, of the differences that give rates


def joints(arm, x):
    """Positions of all joints with the rods at x."""
    q = dict(arm)
    for k in MACHINE.linkages:
        if k.rod.startswith("suspension"):
            q[k.pivot] = simulate.solve_pivot(MACHINE, k, x)
        q[k.rod], q[k.cylinder] = simulate.triangle(MACHINE, k, q[k.pivot])
    return q


def front_less_rear(arm, x, xdd):
    """Load of the front wheels less that of the rear ones with the rods at x, at rest but accelerating."""
    before, here, after = (joints(arm, x + s * STEP) for s in (-1, 0, 1))
    q, a = pin.neutral(MODEL), np.zeros(MODEL.nv)
    by = {name: (after[name] - before[name]) / (2 * STEP) for name in here}
    for i in range(2, MODEL.njoints):
        joint = MODEL.joints[i]
        if joint.nq == 1:
            q[joint.idx_q] = here[MODEL.names[i]]
            a[joint.idx_v] = by[MODEL.names[i]] * xdd
    lean = model.ry(-here["bogie_right"])
    q[3:7] = pin.Quaternion(lean).coeffs()
    a[4] = -by["bogie_right"] * xdd
    tau = pin.rnea(MODEL, DATA, q, np.zeros(MODEL.nv), a)
    pin.framesForwardKinematics(MODEL, DATA, q)
    force, moment = lean @ tau[:3], lean @ tau[3:6]
    points = {}
    for name, (link, radius) in MACHINE.wheels.items():
        centre = DATA.oMf[MODEL.getFrameId(link, pin.FrameType.BODY)].translation
        points[name] = centre - np.array([0, 0, radius])
    middle = sum(points.values()) / 4
    moment = moment - np.cross(middle, force)
    rows = [np.ones(4), [p[1] - middle[1] for p in points.values()], [middle[0] - p[0] for p in points.values()]]
    loads = np.linalg.lstsq(np.array(rows), np.array([force[2], moment[0], moment[1]]), rcond=None)[0]
    return sum(load * (1 if name[0] == "F" else -1) for name, load in zip(points, loads))


def reference(lift, tilt, extension, slew, x):
    arm = pose(lift, tilt, extension, slew)
    h = 1e-4
    by_position = (front_less_rear(arm, x + h, 0) - front_less_rear(arm, x - h, 0)) / (2 * h)
    by_acceleration = front_less_rear(arm, x, 0.5) - front_less_rear(arm, x, -0.5)
    return dict(arm=arm, rod=x, by_position=by_position, by_acceleration=by_acceleration,
                time=math.sqrt(-by_acceleration / by_position))


POSTURES = [  # of the lab's scenarios: lift, tilt (deg), extension (m), slew (deg)
    (45, -70, 0.3, 90),
    (45, -70, 0.3, 180),
    (45, -70, 0.3, 0),
    (20, -50, 0.5, 0),
    (20, -40, 0.6, 10),
    (30, -30, 0.2, -60),
]
found = [reference(*posture, x) for posture in POSTURES for x in (-0.18, -0.1, -0.03)]
(OUT / "critical_step_reference.json").write_text(json.dumps(found, indent=1) + "\n")
for f in found:
    print(f"{f['rod']:6.2f} {f['by_position']:10.1f} {f['by_acceleration']:9.1f} {f['time']:.4f}")
