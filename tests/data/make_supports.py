"""Make `crane` and `forklift`: machines on supports other than four wheels, with the true load of each of them from MuJoCo.

    .venv/bin/python make_supports.py LAB OUT [name...]

LAB is the folder of the simulation laboratory (only its time origin is used); OUT receives NAME.mcap, NAME_clean.mcap (the same without
noise), NAME.toml, .urdf and .truth.parquet (loads at 100 Hz, mean over 10 ms). Machines and manoeuvres are described here, contact forces are MuJoCo's.

crane       12 t crane on four wheels and four outriggers, 42 s, level ground. It drives, extends its outriggers and lifts its wheels off the
            ground (4 to 12 s), slews its boom over the sides (13 to 30 s), while the ground under the rear right foot sinks by 30 mm from 15 to
            18 s. From 22 s on the boom is over the front left corner and the rear right foot carries nothing. It folds, lowers itself to
            its wheels (32 to 38 s) and drives on. Joint states 50 Hz, IMU 50 Hz, forces and states of the outriggers 20 Hz, all with noise.
forklift    4.5 t forklift with a rear axle that swings about a pivot (three-point support), standing on a side slope of 12 degrees, 11.5 s. It
            lifts a load of 1.2 t to 3.6 m from 2 to 10 s. From 8.2 s on the uphill front wheel is off the ground; when the axle reaches its stop the machine goes on tipping over.
"""
import math
from pathlib import Path

import numpy as np

from fixture_tools import lab_arguments, smooth, stamp, typestore, via, write_mcap

DEGREE = math.pi / 180
STEP_S = 0.0005
ROW_S = 0.01
SEED = 16


class Part:
    """A body: its parent, its joint (kind, axis, [range]), where it is on the parent, its box inertia (mass, centre, size)."""

    def __init__(self, name, parent, joint, at, mass, centre, size, contact=None):
        self.name, self.parent, self.joint, self.at = name, parent, joint, at
        self.mass, self.centre, self.size, self.contact = mass, centre, size, contact

    def inertia(self):
        x, y, z = self.size
        return [self.mass / 12 * (b * b + c * c) for b, c in ((y, z), (x, z), (x, y))]


def numbers(values):
    return " ".join(f"{value:.9g}" for value in values)


def urdf(name, parts):
    text = [f'<robot name="{name}">']
    for part in parts:
        i = part.inertia()
        text.append(f'  <link name="{part.name}"><inertial><origin xyz="{numbers(part.centre)}"/><mass value="{part.mass:.9g}"/>'
                    f'<inertia ixx="{i[0]:.9g}" iyy="{i[1]:.9g}" izz="{i[2]:.9g}" ixy="0" ixz="0" iyz="0"/></inertial>'
                    f'<visual><origin xyz="{numbers(part.centre)}"/><geometry><box size="{numbers(part.size)}"/></geometry></visual></link>')
    for part in parts:
        if not part.parent:
            continue
        kind, axis, limits = part.joint
        kind = {"hinge": "revolute" if limits else "continuous", "slide": "prismatic"}[kind]
        limit = f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="1e6" velocity="10"/>' if limits else ""
        text.append(f'  <joint name="{part.name}" type="{kind}"><parent link="{part.parent}"/><child link="{part.name}"/>'
                    f'<origin xyz="{numbers(part.at)}"/><axis xyz="{numbers(axis)}"/>{limit}</joint>')
    return "\n".join(text + ["</robot>", ""])


def mjcf(parts, gravity, extra_bodies, actuators, start_height):
    def body(part):
        kind = '<freejoint/>' if not part.parent else ""
        if part.parent:
            joint, axis, limits = part.joint
            limited = f'limited="true" range="{numbers(limits)}"' if limits else ""
            free = "pendulum" in part.name
            damping = 200 if free else 20
            kind = f'<joint name="{part.name}" type="{joint}" axis="{numbers(axis)}" {limited} damping="{damping}"/>'
        at = numbers((0, 0, start_height)) if not part.parent else numbers(part.at)
        inner = "".join(body(child) for child in parts if child.parent == part.name)
        site = '<site name="imu"/>' if not part.parent else ""
        return (f'<body name="{part.name}" pos="{at}">{kind}<inertial pos="{numbers(part.centre)}" mass="{part.mass}" '
                f'diaginertia="{numbers(part.inertia())}"/>{site}{part.contact or ""}{inner}</body>')

    drives = "".join(f'<position name="{name}" joint="{name}" kp="{kp}" kv="{kv}"/>' if kind == "position" else
                     f'<velocity name="{name}" joint="{name}" kv="{kv}"/>' for name, kind, kp, kv in actuators)
    return (f'<mujoco><compiler angle="radian" autolimits="true"/><option timestep="{STEP_S}" gravity="{numbers(gravity)}" integrator="implicitfast" '
            f'cone="elliptic" impratio="10"/><worldbody><geom name="floor" type="plane" size="100 100 1" contype="1" conaffinity="1" '
            f'friction="1 0.005 0.0001"/>{extra_bodies}{body(parts[0])}</worldbody><actuator>{drives}</actuator>'
            '<sensor><accelerometer name="f" site="imu"/><gyro name="w" site="imu"/></sensor></mujoco>')


def tyre(name, radius, width):
    """A wheel with a soft contact."""
    return (f'<geom name="{name}" type="ellipsoid" size="{radius} {width} {radius}" contype="1" conaffinity="1" mass="0" friction="1 0.005 0.0001" '
            f'solref="0.04 1" solimp="0.9 0.95 0.02"/>')


def simulate(xml, contacts, control, duration, sinking=None):
    """Rows every 10 ms: state, specific force, mean contact force of each support."""
    import mujoco
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    geoms = {model.geom(geom).id: support for support, geom in contacts.items()}
    joints = [model.joint(i).name for i in range(1, model.njnt)]
    for name, kind in ((model.actuator(i).name, model.actuator(i).biasprm[1]) for i in range(model.nu)):
        if kind:    # a position
            data.joint(name).qpos[0] = control(0.0)[name]
    settle = 2.0
    per_row = round(ROW_S / STEP_S)
    rows, sums, f, w, count, middle = [], dict.fromkeys(contacts, 0.0), np.zeros(3), np.zeros(3), 0, {}
    for step in range(round((duration + settle) / STEP_S)):
        t = step * STEP_S - settle
        for name, value in control(max(t, 0.0)).items():
            data.actuator(name).ctrl = value
        if sinking:
            data.mocap_pos[0][2] = sinking(t)
        mujoco.mj_step(model, data)
        count += 1
        f, w = f + data.sensor("f").data, w + data.sensor("w").data
        force = np.zeros(6)
        for i in range(data.ncon):
            for geom in data.contact[i].geom:
                if geom in geoms:
                    mujoco.mj_contactForce(model, data, i, force)
                    sums[geoms[geom]] += force[0]
        if 2 * count == per_row:
            middle = {"t": t, "q": {j: float(data.joint(j).qpos[0]) for j in joints}, "v": {j: float(data.joint(j).qvel[0]) for j in joints},
                      "quat": data.qpos[3:7].copy()}
        if count == per_row:
            if t >= 0:
                rows.append(middle | {"f": f / count, "w": w / count, "loads": {k: v / count for k, v in sums.items()}})
            sums, f, w, count = dict.fromkeys(contacts, 0.0), np.zeros(3), np.zeros(3), 0
    return rows


# ---- crane

WHEELS = {"FL": (1.6, 0.95), "FR": (1.6, -0.95), "RL": (-1.6, 0.95), "RR": (-1.6, -0.95)}
FEET = {"OFL": (2.2, 1.0), "OFR": (2.2, -1.0), "ORL": (-2.2, 1.0), "ORR": (-2.2, -1.0)}
FOOT = "-60000 -600"    # stiffness and damping of a contact per effective mass
BEAM_M, JACK_DOWN_M = 1.4, 0.62    # axle height 0.5: a foot at 0.5 touches


def crane():
    side = lambda y: 1.0 if y > 0 else -1.0
    parts = [Part("base_link", None, None, None, 7000, (0, 0, 0.35), (5.0, 1.6, 0.7))]
    for name, (x, y) in WHEELS.items():
        parts.append(Part(f"wheel_{name.lower()}", "base_link", ("hinge", (0, 1, 0), None), (x, y, 0), 150, (0, 0, 0), (0.8, 0.3, 0.8),
                          tyre(f"c_{name}", 0.5, 0.15)))
    for name, (x, y) in FEET.items():
        foot = name.lower()
        parts.append(Part(f"beam_{foot}", "base_link", ("slide", (0, side(y), 0), (0, 1.6)), (x, y, 0.1), 120, (0, 0, 0), (0.2, 1.2, 0.2)))
        bits = 'contype="4" conaffinity="4"' if name == "ORR" else 'contype="1" conaffinity="1"'
        parts.append(Part(f"jack_{foot}", f"beam_{foot}", ("slide", (0, 0, -1), (0, 0.9)), (0, 0, -0.1), 60, (0, 0, 0.1), (0.2, 0.2, 0.4),
                          f'<geom name="c_{name}" type="sphere" size="0.05" pos="0 0 0.05" {bits} mass="0" friction="1 0.005 0.0001" '
                          f'solref="{FOOT}" solimp="0.95 0.95 0.001"/>'))
    parts += [Part("slew", "base_link", ("hinge", (0, 0, 1), None), (-0.6, 0, 0.8), 2200, (-0.9, 0, 0.4), (1.8, 1.4, 1.0)),
              Part("luff", "slew", ("hinge", (0, -1, 0), (-0.2, 1.4)), (0.3, 0, 0.6), 900, (3.0, 0, 0), (6.0, 0.4, 0.4)),
              Part("load", "luff", ("slide", (1, 0, 0), (0, 4)), (6.0, 0, 0), 1400, (0, 0, -0.4), (0.4, 0.4, 0.8))]
    return parts


def crane_control(t):
    drive = 0.8 * (smooth(t, 0.5, 1.5) - smooth(t, 2.5, 3.5) + smooth(t, 38.5, 39.5) - smooth(t, 40.5, 41.5)) / 0.5
    beam = BEAM_M * (smooth(t, 4, 6.5) - smooth(t, 36.2, 38))
    jack = JACK_DOWN_M * (smooth(t, 6.5, 12) - smooth(t, 32, 36.2))
    out = {f"beam_{foot.lower()}": beam for foot in FEET} | {f"jack_{foot.lower()}": jack for foot in FEET}
    out |= {f"wheel_{wheel.lower()}": drive for wheel in WHEELS}
    out["slew"] = via(t, (13, 0), (17, 1.57), (19, 1.57), (23, 0.62), (26, 0.62), (30, 0)) if t > 13 else 0.0
    out["luff"] = 1.1 - 0.8 * (smooth(t, 13, 16) - smooth(t, 27, 31))
    out["load"] = 3.0 * (smooth(t, 19, 23) - smooth(t, 25.5, 28))
    return out


def crane_sinks(t):
    return -0.1 - 0.03 * smooth(t, 15, 18)


CRANE_TOML = """\
# Made by make_supports.py: a crane that drives on four wheels and works on four outriggers.
name = "crane"
urdf = "crane.urdf"

[imu]
link = "base_link"

{wheels}{feet}
[arm]
root = "slew"

[contact]
transition = 1.0

[limits.reference_posture]
luff = 1.1

[uncertainty]
mass_share = 0.005
com = 0.002
accelerometer_bias = 0.01

[signals]
joint_states = "/joint_states"
imu = "/imu/data"
"""


def crane_toml():
    wheels = "".join(f'[wheels.{w}]\nlink = "wheel_{w.lower()}"\nradius = 0.5\nraised = {{ topic = "/outriggers/wheels_free", field = "data" }}\n\n' for w in WHEELS)
    feet = "".join(f'[supports.{foot}]\nlink = "jack_{foot.lower()}"\nset = {{ topic = "/outriggers/set", field = "data[{i}]" }}\n'
                   f'force = {{ topic = "/outriggers/force", field = "data[{i}]" }}\nforce_sigma = 200.0\n\n' for i, foot in enumerate(FEET))
    return CRANE_TOML.format(wheels=wheels, feet=feet)


def make_crane(out):
    parts = crane()
    joints = [part.name for part in parts if part.parent]
    actuators = []
    for part in parts[1:]:
        if part.name.startswith("wheel"):
            actuators.append((part.name, "velocity", 0, 2000))
        elif part.name.startswith("jack"):
            actuators.append((part.name, "position", 2.5e6, 8e4))
        elif part.name == "luff":
            actuators.append((part.name, "position", 6e6, 6e5))
        else:
            actuators.append((part.name, "position", 2e6, 2e5))
    patch = ('<body name="patch" mocap="true" pos="0 0 -0.1"><geom type="box" size="30 30 0.1" contype="4" conaffinity="4" '
             'friction="1 0.005 0.0001"/></body>')
    xml = mjcf(parts, (0, 0, -9.80665), patch, actuators, 0.5)
    contacts = {name: f"c_{name}" for name in [*WHEELS, *FEET]}
    rows = simulate(xml, contacts, crane_control, 42.0, crane_sinks)
    # the operator's display: a foot is set from its first contact until its jack is retracted
    is_set = dict.fromkeys(FEET, False)
    for row in rows:
        for foot in FEET:
            if row["loads"][foot] > 300 and row["t"] < 32:
                is_set[foot] = True
            if row["t"] > 32 and row["loads"][foot] < 50:
                is_set[foot] = False
        row["set"] = dict(is_set)
        row["free"] = all(row["loads"][wheel] <= 0 for wheel in WHEELS)
    write(out, "crane", parts, joints, rows, (1.0, 0, 0, 0), crane_toml())


# ---- forklift

FORK_WHEELS = {"FL": (0.0, 0.5, 0.33), "FR": (0.0, -0.5, 0.33), "RL": (0.0, 0.45, 0.27), "RR": (0.0, -0.45, 0.27)}
FORKLIFT_TOML = """\
# Made by make_supports.py: a forklift whose rear axle swings about a pivot.
name = "forklift"
urdf = "forklift.urdf"

[imu]
link = "base_link"

[wheels.FL]
link = "wheel_fl"
radius = 0.33
[wheels.FR]
link = "wheel_fr"
radius = 0.33
[wheels.RL]
link = "wheel_rl"
radius = 0.27
[wheels.RR]
link = "wheel_rr"
radius = 0.27

[arm]
root = "lift"

[contact]
free_joints = ["pendulum_axle"]

[uncertainty]
mass_share = 0.005
com = 0.002
accelerometer_bias = 0.01

[signals]
joint_states = "/joint_states"
imu = "/imu/data"
"""


def make_forklift(out):
    parts = [Part("base_link", None, None, None, 2900, (-1.05, 0, 0.45), (2.0, 1.0, 0.9)),
             Part("wheel_fl", "base_link", ("hinge", (0, 1, 0), None), (0, 0.5, 0), 40, (0, 0, 0), (0.5, 0.2, 0.5), tyre("c_FL", 0.33, 0.1)),
             Part("wheel_fr", "base_link", ("hinge", (0, 1, 0), None), (0, -0.5, 0), 40, (0, 0, 0), (0.5, 0.2, 0.5), tyre("c_FR", 0.33, 0.1)),
             Part("pendulum_axle", "base_link", ("hinge", (1, 0, 0), (-3 * DEGREE, 3 * DEGREE)), (-1.6, 0, 0.05), 150, (0, 0, -0.05), (0.2, 0.9, 0.2)),
             Part("wheel_rl", "pendulum_axle", ("hinge", (0, 1, 0), None), (0, 0.45, -0.11), 30, (0, 0, 0), (0.4, 0.2, 0.4), tyre("c_RL", 0.27, 0.1)),
             Part("wheel_rr", "pendulum_axle", ("hinge", (0, 1, 0), None), (0, -0.45, -0.11), 30, (0, 0, 0), (0.4, 0.2, 0.4), tyre("c_RR", 0.27, 0.1)),
             Part("lift", "base_link", ("slide", (0, 0, 1), (0, 4)), (0.45, 0, 0.0), 1400, (0.5, 0, 0.45), (1.0, 1.0, 0.9))]
    slope = 12.0 * DEGREE
    gravity = (0, -9.80665 * math.sin(slope), -9.80665 * math.cos(slope))    # the right side is downhill
    actuators = [(p.name, "velocity", 0, 3000) for p in parts if p.name.startswith("wheel")] + [("lift", "position", 2e6, 2e5)]
    xml = mjcf(parts, gravity, "", actuators, 0.33)
    control = lambda t: {p.name: 0.0 for p in parts if p.name.startswith("wheel")} | {"lift": 3.6 * smooth(t, 2, 10)}
    rows = simulate(xml, {w: f"c_{w}" for w in FORK_WHEELS}, control, 11.5)
    joints = [part.name for part in parts if part.parent]
    half = 0.5 * slope
    # from MuJoCo's world to a world whose z axis is up: a turn about x
    write(out, "forklift", parts, joints, rows, (math.cos(half), math.sin(half), 0, 0), FORKLIFT_TOML)


# ---- files

def product(a, b):
    w0, x0, y0, z0 = a
    w1, x1, y1, z1 = b
    return (w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1, w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1,
            w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1, w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1)


CLEAN_BITS = 24


def grid(values, bits):
    return np.round(np.asarray(values, dtype=np.float64) * 2.0**bits) / 2.0**bits


def write(out, name, parts, joints, rows, up_from_world, toml):
    import polars
    for log, is_clean in ((name, False), (f"{name}_clean", True)):
        write_log(out / f"{log}.mcap", joints, rows, up_from_world, is_clean)
    loads = {f"load_{support.lower()}": np.array([row["loads"][support] for row in rows], dtype=np.float32) for support in rows[0]["loads"]}
    polars.DataFrame({"t_ns": [stamp(row["t"]) for row in rows], **loads}).gather_every(2).write_parquet(out / f"{name}.truth.parquet")
    (out / f"{name}.urdf").write_text(urdf(name, parts))
    (out / f"{name}.toml").write_text(toml)
    for support, load in loads.items():
        print(name, support, " ".join(f"{load[min(int(t * 100), len(load) - 1)]:.0f}" for t in np.linspace(0, rows[-1]["t"], 22)))
    print(f"{name}: {(out / f'{name}.mcap').stat().st_size} bytes, {rows[-1]['t']:.1f} s, weight {sum(p.mass for p in parts) * 9.80665:.0f} N", flush=True)


def write_log(path, joints, rows, up_from_world, is_clean):
    types = typestore()
    message = types.types
    random = np.random.default_rng(SEED)
    noise = lambda sigma, n: random.normal(0.0, 0.0 if is_clean else sigma, n)
    quantised = lambda values, bits: grid(values, CLEAN_BITS if is_clean else bits)
    header = lambda t: message["std_msgs/msg/Header"](stamp=message["builtin_interfaces/msg/Time"](sec=t // 10**9, nanosec=t % 10**9), frame_id="base_link")
    layout = message["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    events = []
    for k, row in enumerate(rows):
        t = stamp(row["t"])
        if k % 2 == 0:
            q, v = ([row[kind][j] for j in joints] for kind in ("q", "v"))
            events.append((t, "/joint_states", "sensor_msgs/msg/JointState", message["sensor_msgs/msg/JointState"](
                header=header(t), name=joints, position=quantised(q + noise(1e-4, len(q)), 14), velocity=quantised(v + noise(1e-3, len(v)), 12), effort=np.zeros(0))))
            w, x, y, z = quantised(product(up_from_world, row["quat"]) + noise(2e-4, 4), 15)
            vector = message["geometry_msgs/msg/Vector3"]
            events.append((t, "/imu/data", "sensor_msgs/msg/Imu", message["sensor_msgs/msg/Imu"](
                header=header(t), orientation=message["geometry_msgs/msg/Quaternion"](x=x, y=y, z=z, w=w), orientation_covariance=np.zeros(9),
                angular_velocity=vector(*quantised(row["w"] + noise(1e-3, 3), 14)), angular_velocity_covariance=np.zeros(9),
                linear_acceleration=vector(*quantised(row["f"] + noise(0.02, 3), 11)), linear_acceleration_covariance=np.zeros(9))))
        if k % 5 == 0 and "set" in row:
            array = message["std_msgs/msg/Float64MultiArray"]
            force = np.round([row["loads"][foot] for foot in FEET] + noise(100.0, len(FEET)))
            events.append((t, "/outriggers/force", "std_msgs/msg/Float64MultiArray", array(layout=layout, data=force)))
            flags = message["std_msgs/msg/UInt8MultiArray"](layout=layout, data=np.array([row["set"][foot] for foot in FEET], dtype=np.uint8))
            events.append((t, "/outriggers/set", "std_msgs/msg/UInt8MultiArray", flags))
            events.append((t, "/outriggers/wheels_free", "std_msgs/msg/Bool", message["std_msgs/msg/Bool"](data=bool(row["free"]))))
    write_mcap(events, types, path)


def main():
    arguments = lab_arguments(__doc__, ["crane", "forklift"])
    for name in arguments.names:
        {"crane": make_crane, "forklift": make_forklift}[name](Path(arguments.out))


if __name__ == "__main__":
    main()
