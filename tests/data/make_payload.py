"""Make `lift_payload`: a machine with a payload that its machine file lacks, and the forces of its cylinders.

    .venv/bin/python make_payload.py LAB OUT

LAB is the folder of the simulation laboratory, OUT receives lift_payload.mcap (noisy, joint states 100 Hz, IMU 125 Hz, odometry 25 Hz),
lift_payload.toml, lift_payload.urdf (without the payload) and lift_payload.truth.parquet (wheel loads at 500 Hz). The log also has at 50 Hz

    /actuators                      sensor_msgs/JointState: effort [N] of lift_rod and tilt_rod, positive where it pushes the rod out
    /lift_cylinder/piston_pressure  sensor_msgs/FluidPressure [Pa]
    /lift_cylinder/rod_pressure

The simulation drives the arm by torques at its pivots. By virtual work the force of a rod is the pivot torque divided by dx/dtheta, where x is the
rod coordinate of the triangle. Seal friction, a share FRICTION of the force, opposes the motion: the measured force is larger while the rod extends
and smaller while it retracts. The pressures give the same force: piston pressure times piston area minus rod pressure times ring area.
"""
import math

import numpy as np

from fixture_tools import arm_pose, lab_arguments, run, smooth, stamp, standing, typestore, via, write_fixture

PAYLOAD_KG = 320.0
EVERY_ROW = 10                              # of the 500 Hz rows
FORCE_NOISE, PRESSURE_NOISE = 300.0, 5e4    # N, Pa
FRICTION, CREEP = 0.02, 2e-3                # share of the force; speed in m/s at which friction reaches three quarters of it
PISTON, ROD = 0.080, 0.045                  # diameters, m
PISTON_AREA, RING_AREA = math.pi / 4 * PISTON**2, math.pi / 4 * (PISTON**2 - ROD**2)
ROD_PRESSURE, RETURN_THROTTLE = 2.0e6, 4e6  # Pa at rest; Pa per m/s of outward motion


def arm(t):
    s = smooth(t, 0, 3)
    lift = via(t, (0.3, 0), (2.6, 1), (4.4, 0.2), (6.4, 0.8))
    return arm_pose(34 + 18 * lift, -86 + 10 * s * math.sin(1.3 * t), 0.12 + 0.06 * s * math.sin(0.9 * t), 165 + 30 * s * math.sin(0.8 * t))


def rod_rate(machine, linkage, angle):
    """dx/dtheta of a triangle: rod extension per pivot angle."""
    from simulate import triangle
    step = 1e-6
    return (triangle(machine, linkage, angle + step)[0] - triangle(machine, linkage, angle - step)[0]) / (2 * step)


def rod_force(machine, linkage, mujoco_model, row):
    """Actuator force of a triangle from the torque at its pivot [N]."""
    angle = row["qpos"][mujoco_model.jnt_qposadr[mujoco_model.joint(linkage.pivot).id]]
    return row["actuators"][linkage.pivot] / rod_rate(machine, linkage, angle)


def measured_force(machine, linkage, mujoco_model, row):
    """The same with seal friction, and the rod velocity."""
    force = rod_force(machine, linkage, mujoco_model, row)
    velocity = row["qvel"][mujoco_model.jnt_dofadr[mujoco_model.joint(linkage.rod).id]]
    return force + FRICTION * abs(force) * math.tanh(velocity / CREEP), velocity


def hydraulics(scenario, mujoco_model, rows, types):
    """The messages of the cylinder topics."""
    rng = np.random.default_rng(scenario.seed + 100)
    machine = scenario.machine
    header_type, time_type = types.types["std_msgs/msg/Header"], types.types["builtin_interfaces/msg/Time"]
    joint_state, fluid_pressure = types.types["sensor_msgs/msg/JointState"], types.types["sensor_msgs/msg/FluidPressure"]
    none = np.zeros(0)
    for row in rows[::EVERY_ROW]:
        time_ns = stamp(row["t"])
        header = header_type(stamp=time_type(sec=time_ns // 10**9, nanosec=time_ns % 10**9), frame_id="")

        def late():
            return time_ns + int(rng.uniform(0.2, 3.0) * 1e6)

        forces = [measured_force(machine, linkage, mujoco_model, row) for linkage in machine.linkages]
        effort = np.round([force + rng.normal(0, FORCE_NOISE) for force, _ in forces])
        names = [linkage.rod for linkage in machine.linkages]
        message = joint_state(header=header, name=names, position=none, velocity=none, effort=effort)
        yield late(), "/actuators", "sensor_msgs/msg/JointState", message
        force, velocity = forces[0]    # the lift cylinder
        rod_side = ROD_PRESSURE + RETURN_THROTTLE * velocity
        piston_side = (force + rod_side * RING_AREA) / PISTON_AREA
        for side, pressure in (("piston", piston_side), ("rod", rod_side)):
            value = float(round(pressure + rng.normal(0, PRESSURE_NOISE), -2))
            message = fluid_pressure(header=header, fluid_pressure=value, variance=PRESSURE_NOISE**2)
            yield late(), f"/lift_cylinder/{side}_pressure", "sensor_msgs/msg/FluidPressure", message


def scenario():
    import model
    from simulate import Scenario
    return Scenario("lift_payload", model.rigid(yaw0=0.0, payload=PAYLOAD_KG), 7.0, arm, standing, clear=2.5, seed=51)


def main():
    arguments = lab_arguments(__doc__, [])
    import model
    lifting = scenario()
    mujoco_model, rows = run(lifting)
    events = hydraulics(lifting, mujoco_model, rows, typestore())
    write_fixture(lifting, mujoco_model, rows, arguments.out, urdf=model.urdf(model.rigid(yaw0=0.0)), more=events)


if __name__ == "__main__":
    main()
