"""Make rnea_reference.json: ground wrenches of the lab's machines from Pinocchio, to test Tipwatch's Newton-Euler against.

    python -m venv .venv && .venv/bin/pip install pin mujoco numpy
    .venv/bin/python make_rnea_reference.py LAB OUT

LAB is the folder of the simulation lab (model.py, simulate.py, machine_file.py). OUT receives rnea_reference.json, and of both machines
NAME.urdf and NAME.toml, to which it belongs. The seeds are fixed. Made with Python 3.11, pin 4.1.0, mujoco 4.0.0, numpy 2.4.6.

{"machines": {NAME: {"urdf": file, "machine_file": file, "cases": [case, ...]}}}, SI units, base_link axes. A case has

    measured               joint -> [position, rate, acceleration], what a log would bring
    specific_force         of base_link's origin, base axes
    angular_velocity, angular_acceleration   of base_link, base axes
    joints                 joint -> [position, rate, acceleration], all movable joints, closed chains solved
    force, moment          that the surroundings must supply, moment about base_link's origin, base axes
    wheel_centres          wheel -> position in base_link

The wrench is rnea with no gravity and the specific force as the acceleration of the base. The closed chains come from the lab's plane
trigonometry (`simulate.triangle`), their derivatives from differences of eighth order. Two checks stop the script when they fail: the
derivatives with another step width, and the wrench against MuJoCo's inverse dynamics (which carries a dummy gram in a massless link).
"""
import argparse
import json
import sys
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

STEP_RAD = 0.02          # of the differences: truncation and rounding both near 1e-13
OFFSETS = np.arange(-4, 5)
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])

# Ranges of position, and half widths of rate and acceleration, to draw the measured joints from.
RANGES = {
    "slew": ((-2.5, 2.5), 0.8, 1.5),
    "lift": ((-1.75, -1.0), 0.5, 1.0),
    "tilt": ((-2.0, -0.8), 0.6, 1.2),
    "extension": ((0.0, 0.6), 0.5, 1.0),
    "steer_fl": ((-0.5, 0.5), 0.4, 1.0),
    "steer_fr": ((-0.5, 0.5), 0.4, 1.0),
    "suspension_left": ((-0.18, -0.03), 0.1, 0.5),
    "suspension_right": ((-0.18, -0.03), 0.1, 0.5),
}
WHEEL_RANGE = ((-3.0, 3.0), 8.0, 10.0)


def derivatives(function, at, step=STEP_RAD):
    """Value, first and second derivative of a vector function."""
    values = np.array([function(at + k * step) for k in OFFSETS])
    return values[4], FIRST @ values / step, SECOND @ values / step**2


def close_chain(machine, linkage, measured):
    """Position, rate and acceleration of pivot, rod and cylinder, from whichever of pivot and rod is measured."""
    import simulate

    def triangle(angle):
        return np.array(simulate.triangle(machine, linkage, angle))

    rod_is_measured = linkage.rod in measured
    angle = simulate.solve_pivot(machine, linkage, measured[linkage.rod][0]) if rod_is_measured else measured[linkage.pivot][0]
    value, slope, curvature = derivatives(triangle, angle)
    _, other_slope, other_curvature = derivatives(triangle, angle, STEP_RAD / 2)
    assert np.allclose(slope, other_slope, rtol=0, atol=1e-11) and np.allclose(curvature, other_curvature, rtol=0, atol=1e-9)
    if rod_is_measured:
        position, rate, acceleration = measured[linkage.rod]
        assert abs(value[0] - position) < 1e-14
        pivot_rate = rate / slope[0]
        pivot = angle, pivot_rate, (acceleration - curvature[0] * pivot_rate**2) / slope[0]
    else:
        pivot = measured[linkage.pivot]
    follow = [(value[i], slope[i] * pivot[1], slope[i] * pivot[2] + curvature[i] * pivot[1] ** 2) for i in (0, 1)]
    rod = measured[linkage.rod] if rod_is_measured else follow[0]
    return {linkage.pivot: pivot, linkage.rod: rod, linkage.cylinder: follow[1]}


def draw_measured(machine, rng):
    rods = [linkage.rod for linkage in machine.linkages if linkage.rod.startswith("suspension")]
    names = machine.arm_joints + rods + list(machine.steer.values()) + [link for link, _ in machine.wheels.values()]
    measured = {}
    for name in names:
        (low, high), rate, acceleration = RANGES.get(name, WHEEL_RANGE)
        measured[name] = (rng.uniform(low, high), rng.uniform(-rate, rate), rng.uniform(-acceleration, acceleration))
    return measured


def pinocchio_wrench(model, joints, base):
    """The first six of rnea, and the positions of all link frames."""
    data = model.createData()
    q, v, a = pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)
    v[3:6] = base["angular_velocity"]
    a[0:3], a[3:6] = base["specific_force"], base["angular_acceleration"]
    assert set(model.names[2:]) == set(joints)
    for name, (position, rate, acceleration) in joints.items():
        joint = model.joints[model.getJointId(name)]
        if joint.nq == 2:
            q[joint.idx_q], q[joint.idx_q + 1] = np.cos(position), np.sin(position)
        else:
            q[joint.idx_q] = position
        v[joint.idx_v], a[joint.idx_v] = rate, acceleration
    wrench = pin.rnea(model, data, q, v, a).copy()[:6]
    pin.framesForwardKinematics(model, data, q)
    return wrench, lambda link: data.oMf[model.getFrameId(link, pin.FrameType.BODY)].translation.copy()


def mujoco_wrench(model, joints, base):
    """The same wrench by MuJoCo's inverse dynamics, contacts and closures switched off, tyres unloaded."""
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    data.qpos[3] = 1.0
    data.qvel[3:6] = base["angular_velocity"]
    data.qacc[0:3], data.qacc[3:6] = base["specific_force"], base["angular_acceleration"]
    for name, (position, rate, acceleration) in joints.items():
        joint = model.joint(name).id
        data.qpos[model.jnt_qposadr[joint]] = position
        data.qvel[model.jnt_dofadr[joint]], data.qacc[model.jnt_dofadr[joint]] = rate, acceleration
    mujoco.mj_inverse(model, data)
    return data.qfrc_inverse[:6].copy()


def make_case(machine, pin_model, mujoco_model, rng):
    measured = draw_measured(machine, rng)
    joints = dict(measured)
    for linkage in machine.linkages:
        joints |= close_chain(machine, linkage, measured)
    base = {
        "specific_force": (np.array([0.0, 0.0, 9.8]) + rng.uniform(-3.0, 3.0, 3)).tolist(),
        "angular_velocity": rng.uniform(-0.6, 0.6, 3).tolist(),
        "angular_acceleration": rng.uniform(-1.5, 1.5, 3).tolist(),
    }
    wrench, position_of = pinocchio_wrench(pin_model, joints, base)
    difference = np.abs(wrench - mujoco_wrench(mujoco_model, joints, base)).max() / np.abs(wrench).max()
    assert difference < 5e-6, f"Pinocchio and MuJoCo differ by {difference:.1e}"
    print(f"{machine.name}: force {wrench[:3].round(1)} N, moment {wrench[3:].round(1)} N m, MuJoCo differs by {difference:.1e} of the largest")
    numbers = lambda table: {name: [float(x) for x in values] for name, values in table.items()}
    return {
        "measured": numbers(measured),
        **base,
        "joints": numbers(joints),
        "force": wrench[:3].tolist(),
        "moment": wrench[3:].tolist(),
        "wheel_centres": {wheel: position_of(link).tolist() for wheel, (link, _) in machine.wheels.items()},
    }


def make_machine(name, machine, cases, rng, out):
    import model
    from machine_file import machine_toml
    (out / f"{name}.urdf").write_text(model.urdf(machine))
    (out / f"{name}.toml").write_text(machine_toml(machine, f"{name}.urdf"))
    pin_model = pin.buildModelFromUrdf(str(out / f"{name}.urdf"), pin.JointModelFreeFlyer())
    pin_model.gravity.linear = np.zeros(3)
    mujoco_model = mujoco.MjModel.from_xml_string(model.mjcf(machine))
    mujoco_model.opt.gravity[:] = 0.0
    mujoco_model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    return {
        "urdf": f"{name}.urdf",
        "machine_file": f"{name}.toml",
        "cases": [make_case(machine, pin_model, mujoco_model, rng) for _ in range(cases)],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation lab")
    parser.add_argument("out", type=Path, help="folder to write to")
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.lab))
    import model
    arguments.out.mkdir(parents=True, exist_ok=True)
    machines = {
        "rigid": make_machine("rigid", model.rigid(yaw0=0.0), 5, np.random.default_rng(11), arguments.out),
        "bogie": make_machine("bogie", model.bogie(), 3, np.random.default_rng(12), arguments.out),
    }
    (arguments.out / "rnea_reference.json").write_text(json.dumps({"machines": machines}, indent=1) + "\n")


if __name__ == "__main__":
    main()
