"""The stabiliser against IPOPT: the same random problems, a model of its own.

    python -m venv .venv && .venv/bin/pip install casadi numpy
    cargo build --release -p tipwatch-suspension --example suspension_problems
    .venv/bin/python mechanics/suspension/benches/ipopt/compare.py TARGET/release/examples/suspension_problems [COUNT]

The model here is written from the URDF and the machine file alone, in the frame of the ground: positions of every body as
functions of time, velocities and accelerations by CasADi's differentiation, Newton-Euler, the plane of the wheels, the four
loads on tyres that deflect, the stability angles, the cost (30). It shares no line with the repository. IPOPT solves (30)-(31) in
full, with (31e), (31f) as equations, from the rods at rest, with exact derivatives compiled by the C compiler.

Compared are cost, argument, and where the reduced curvature is too small to tell the argument, the projected gradient. Both sides
are timed in this run: per problem the shortest of several solutions, on this side the wall time that CasADi measures within the
solver, so without Python.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import time
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import casadi as ca
import numpy as np

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"
REPEATS = 3


# ---------------------------------------------------------------------------------------------- machine
def numbers(text):
    return [float(word) for word in text.split()]


def rpy(r, p, y):
    cr, sr, cp, sp, cy, sy = math.cos(r), math.sin(r), math.cos(p), math.sin(p), math.cos(y), math.sin(y)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                     [-sp, cp * sr, cp * cr]])


def origin(element):
    found = element.find("origin")
    if found is None:
        return np.zeros(3), np.eye(3)
    return np.array(numbers(found.get("xyz", "0 0 0"))), rpy(*numbers(found.get("rpy", "0 0 0")))


class Machine:
    def __init__(self, name):
        self.file = tomllib.loads((DATA / f"{name}.toml").read_text())
        robot = ET.parse(DATA / f"{name}.urdf").getroot()
        self.links, self.joints = {}, {}
        for link in robot.findall("link"):
            inertial = link.find("inertial")
            if inertial is not None:
                com, turn = origin(inertial)
                i = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
                tensor = np.array([[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]])
                self.links[link.get("name")] = (float(inertial.find("mass").get("value")), com, turn @ tensor @ turn.T)
        for joint in robot.findall("joint"):
            axis = joint.find("axis")
            place, turn = origin(joint)
            self.joints[joint.find("child").get("link")] = dict(
                name=joint.get("name"), kind=joint.get("type"), parent=joint.find("parent").get("link"), place=place, turn=turn,
                axis=np.array(numbers(axis.get("xyz"))) if axis is not None else np.array([1.0, 0, 0]))
        self.gravity = self.file["gravity"]
        self.stiffness = self.file["contact"]["tyre_stiffness"]
        self.suspension = self.file["suspension"]
        self.linkages = {k["name"]: k for k in self.file["linkage"]}

    def chain(self, link):
        """The joints from the base to a link."""
        found = []
        while link in self.joints:
            found.append(self.joints[link])
            link = found[-1]["parent"]
        return found[::-1]


def turn_about(axis, angle):
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return ca.SX.eye(3) + ca.sin(angle) * ca.SX(k) + (1 - ca.cos(angle)) * ca.SX(k @ k)


def pose(machine, link, q):
    """Rotation and place of a link in the base, with joint positions q by name."""
    r, p = ca.SX.eye(3), ca.SX.zeros(3)
    for joint in machine.chain(link):
        p = p + r @ joint["place"]
        r = r @ joint["turn"]
        if joint["kind"] in ("revolute", "continuous"):
            r = r @ turn_about(joint["axis"], q[joint["name"]])
        elif joint["kind"] == "prismatic":
            p = p + r @ (joint["axis"] * q[joint["name"]])
    return r, p


def close(machine, q, linkage, rod=None):
    """Sets the joints of a triangle from its pivot, or from its rod."""
    spec = machine.linkages[linkage]
    by_name = {joint["name"]: (child, joint) for child, joint in machine.joints.items()}
    (pivot_link, pivot), (_, cylinder), (rod_link, slide) = (by_name[spec[key]] for key in ("pivot", "cylinder", "rod"))
    assert pivot["parent"] in (cylinder["parent"], "lift_link", "lift_boom", "arm_column", "base_link")
    # in the frame of the link that carries the cylinder, axes of the cylinder's hinge at zero
    mount = cylinder["turn"]
    to_rod = slide["place"] + np.array(spec["rod_end"]["xyz"])  # along x from the hinge
    assert abs(to_rod[1]) + abs(to_rod[2]) < 1e-9
    base_pivot_r, base_pivot_p = pose(machine, pivot["parent"], q)
    base_mount_r, base_mount_p = pose(machine, cylinder["parent"], q)

    def eye(angle):
        trial = dict(q)
        trial[spec["pivot"]] = angle
        r, p = pose(machine, pivot_link, trial)
        anchor_r, anchor_p = pose(machine, spec["anchor"]["link"], trial)
        place = anchor_p + anchor_r @ np.array(spec["anchor"]["xyz"])
        hinge = base_mount_p + base_mount_r @ cylinder["place"]
        return (base_mount_r @ mount).T @ (place - hinge)

    if rod is not None:
        # law of cosines: squared length = k + a cos + b sin, the branch near zero
        length = rod + to_rod[0]
        square = lambda angle: ca.sumsqr(eye(angle))
        s0, s1, s2 = square(0.0), square(math.pi / 2), square(math.pi)
        k, a = (s0 + s2) / 2, (s0 - s2) / 2
        b = s1 - k
        constant = [float(ca.evalf(ca.SX(v))) for v in (k, a, b)]
        k, a, b = constant
        m, at = math.hypot(a, b), math.atan2(b, a)
        turned = ca.acos((length * length - k) / m)
        sign = 1.0 if math.sin(-at) > 0 else -1.0
        q[spec["pivot"]] = at + sign * turned
    v = eye(q[spec["pivot"]])
    axis = cylinder["axis"]
    across = ca.cross(ca.SX(axis), ca.SX([1, 0, 0]))
    q[spec["cylinder"]] = ca.atan2(ca.dot(v, across), v[0])
    q[spec["rod"]] = ca.sqrt(ca.sumsqr(v)) - to_rod[0]


def plane(centres, radii):
    """Slopes a, b of the plane z = a x + b y + d under wheels of these radii: Newton on the normal equations."""
    mean = sum(centres) / len(centres)
    m = ca.SX.zeros(2)
    rho = [c - mean for c in centres]
    scatter = sum(r[:2] @ r[:2].T for r in rho)
    lift = sum(r[:2] * r[2] for r in rho)
    q = sum(r[:2] * radius for r, radius in zip(rho, radii))
    for _ in range(3):
        s = ca.sqrt(1 + ca.sumsqr(m))
        m = ca.solve(scatter + q @ m.T / s, lift - q / s)
    normal = ca.vertcat(-m[0], -m[1], 1) / ca.sqrt(1 + ca.sumsqr(m))
    forward = ca.SX([1, 0, 0]) - normal * normal[0]
    forward = forward / ca.norm_2(forward)
    return ca.horzcat(forward, ca.cross(normal, forward), normal)  # base from ground


class Model:
    """Symbols of one instant. The suspension moves what stands on `moved`; all else moves on the base as measured, and
    comes into the problem as numbers, so that the solver need not work it out again at every iterate."""

    def __init__(self, machine):
        self.machine = machine
        rods = machine.suspension["linkages"]
        self.arm_names = ["slew", "lift", "tilt", "extension", "wheel_fl", "wheel_fr", "wheel_rl", "wheel_rr"]
        self.t = ca.SX.sym("t")
        self.measured = ca.SX.sym("measured", 3, len(self.arm_names))
        self.rods = ca.SX.sym("rods", 3, len(rods))  # position, rate, acceleration
        taylor = lambda jet, k: jet[0, k] + jet[1, k] * self.t + jet[2, k] * self.t ** 2 / 2
        q = {name: taylor(self.measured, k) for k, name in enumerate(self.arm_names)}
        for k, name in enumerate(rods):
            close(machine, q, name, rod=taylor(self.rods, k))
        for name in machine.linkages:
            if name not in rods:
                close(machine, q, name)
        self.q = q
        pivots = {machine.linkages[name]["pivot"] for name in rods} | {machine.linkages[name]["cylinder"] for name in rods}
        on_suspension = lambda link: any(joint["name"] in pivots for joint in machine.chain(link))
        self.moved = [link for link in machine.links if on_suspension(link)]
        self.carried = [link for link in machine.links if not on_suspension(link)]
        self.wheels = list(machine.file["wheels"])
        self.radii = [machine.file["wheels"][n]["radius"] for n in self.wheels]
        self.centres = [pose(machine, machine.file["wheels"][n]["link"], q)[1] for n in self.wheels]
        self.frame = plane(self.centres, self.radii)  # base from ground
        self.corner = sum(self.centres) / len(self.wheels) - self.frame[:, 2] * (sum(self.radii) / len(self.radii))

    def jets(self, expressions):
        """Value, first and second derivative in time of each, now."""
        shapes = [e.shape for e in expressions]
        flat = ca.vertcat(*[ca.vec(e) for e in expressions])
        first = ca.jacobian(flat, self.t)
        second = ca.jacobian(first, self.t)
        orders = ca.horzsplit(ca.cse(ca.substitute(ca.horzcat(flat, first, second), self.t, 0)))
        found, at = [], 0
        for rows, columns in shapes:
            size = rows * columns
            found.append([ca.reshape(order[at:at + size], rows, columns) for order in orders])
            at += size
        return found

    @staticmethod
    def spin(r, r1, r2):
        """Angular velocity and its rate of a rotation, in the axes it turns into."""
        vee = lambda m: ca.vertcat(m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]) / 2
        return vee(r1 @ r.T), vee(r2 @ r.T + r1 @ r1.T)

    def bodies(self, links):
        """Mass, place, velocity, acceleration, spin, its rate and inertia tensor of bodies in base axes."""
        machine, poses = self.machine, [pose(self.machine, link, self.q) for link in links]
        coms = [p + r @ machine.links[link][1] for (r, p), link in zip(poses, links)]
        jets = self.jets(coms + [r for r, _ in poses])
        found = []
        for k, link in enumerate(links):
            (p, v, a), rotation = jets[k], jets[len(links) + k]
            found.append([p, v, a, *self.spin(*rotation), rotation[0] @ ca.SX(machine.links[link][2]) @ rotation[0].T])
        return found

    def base_on_ground(self):
        """Rotation ground from base, and the base's place and motion there."""
        to_ground = self.frame.T
        rotation, place = self.jets([to_ground, -to_ground @ self.corner])
        return rotation[0], place, self.spin(*rotation)

    def ground_motion(self):
        """Specific force, angular velocity and acceleration of the ground's frame, and up, from what the IMU feels."""
        f, w, alpha, up = (ca.SX.sym(n, 3) for n in ("f", "w", "alpha", "up"))
        imu = self.machine.file["imu"]
        base_r, base_p = pose(self.machine, imu["link"], self.q)
        imu_r = self.frame.T @ base_r @ rpy(*imu["rpy"])
        imu_p = self.frame.T @ (base_p + base_r @ np.array(imu["xyz"]) - self.corner)
        rotation, (p, v, a), now = self.jets([imu_r, imu_p, self.frame])
        spin, spin_rate = self.spin(*rotation)
        omega = rotation[0] @ w - spin
        turning = rotation[0] @ alpha - spin_rate - ca.cross(omega, spin)
        force = rotation[0] @ f - a - 2 * ca.cross(omega, v) - ca.cross(turning, p) - ca.cross(omega, ca.cross(omega, p))
        inputs = [self.measured, self.rods, f, w, alpha, up]
        return ca.Function("ground", inputs, [force, omega, turning, now[0].T @ up])

    def carried_bodies(self):
        """What stands on the base, from the measured joints, as numbers."""
        flat = ca.vertcat(*[ca.vec(part) for body in self.bodies(self.carried) for part in body])
        return ca.Function("carried", [self.measured], [flat])

    def loads_and_angles(self, ground_force, omega, turning, up, carried):
        """The signed loads by wheel and the stability angles front, left, rear, right."""
        m = self.machine
        rotation, (p, v, a), (spin, spin_rate) = self.base_on_ground()
        # how the base moves, in its axes
        back = rotation.T
        w = back @ (omega + spin)
        alpha = back @ (turning + spin_rate + ca.cross(omega, spin))
        f = back @ (ground_force + ca.cross(turning, p) + ca.cross(omega, ca.cross(omega, p)) + 2 * ca.cross(omega, v) + a)
        parts = [carried[k * 24:(k + 1) * 24] for k in range(len(self.carried))]
        parts = [[c[0:3], c[3:6], c[6:9], c[9:12], c[12:15], ca.reshape(c[15:24], 3, 3)] for c in parts]
        force, moment, mass, first = ca.SX.zeros(3), ca.SX.zeros(3), 0.0, ca.SX.zeros(3)
        for link, (p, v, a, s, s1, tensor) in zip(self.carried + self.moved, parts + self.bodies(self.moved)):
            link_mass = m.links[link][0]
            acceleration = f + ca.cross(alpha, p) + ca.cross(w, ca.cross(w, p)) + 2 * ca.cross(w, v) + a
            total, total_rate = w + s, alpha + s1 + ca.cross(w, s)
            force += link_mass * acceleration
            moment += ca.cross(p, link_mass * acceleration) + tensor @ total_rate + ca.cross(total, tensor @ total)
            mass += link_mass
            first += link_mass * p
        now = lambda e: ca.substitute(e, self.t, 0)
        centres, frame = [now(c) for c in self.centres], now(self.frame)

        def solve(stand, radii):
            points = [stand.T @ c for c in centres]  # in the axes of the plane, from the base's origin
            normal = stand[:, 2]
            height = sum(ca.dot(normal, c) - r for c, r in zip(centres, radii)) / len(centres)
            at = moment - ca.cross(normal * height, force)
            rows = [[1, 1, 1, 1], [p[1] for p in points], [-p[0] for p in points]]
            half = dict(FR=0.5, FL=-0.5, RR=-0.5, RL=0.5)  # (54) with D = 0.5
            rows.append([half[n] for n in self.wheels])
            matrix = ca.vertcat(*[ca.horzcat(*row) for row in rows])
            right = ca.vertcat(ca.dot(normal, force), ca.dot(stand[:, 0], at), ca.dot(stand[:, 1], at), 0)
            return ca.solve(matrix, right), points, height

        # tyres deflect under their loads: the plane leans
        loads, _, _ = solve(frame, self.radii)
        radii = [r - loads[k] / m.stiffness for k, r in enumerate(self.radii)]
        stand = plane(centres, radii)
        loads, points, height = solve(stand, radii)
        com = stand.T @ (first / mass)
        down = -(stand.T @ (frame @ up))
        by = dict(zip(self.wheels, points))
        angles = []
        for a, b in (("FR", "FL"), ("FL", "RL"), ("RL", "RR"), ("RR", "FR")):
            start = ca.vertcat(by[a][:2], height)
            along = ca.vertcat(by[b][:2], height) - start
            along = along / ca.norm_2(along)
            out = start - com
            out = out - along * ca.dot(along, out)
            fall = down - along * ca.dot(along, down)
            angles.append(ca.atan2(ca.dot(ca.cross(out, fall), along), ca.dot(out, fall)))
        return loads, ca.vertcat(*angles)


def cost_of(wheels, loads, angles):
    psi = lambda a, b: 1e-3 if a[0] == b[0] else 1.0
    pairs = [(i, j) for i in range(4) for j in range(i + 1, 4)]
    spread = sum(psi(wheels[i], wheels[j]) * ((loads[i] - loads[j]) / 1000) ** 2 for i, j in pairs)
    return spread + 100 / angles[0] + 10 / angles[1] + 100 / angles[2] + 10 / angles[3]


# ---------------------------------------------------------------------------------------------- problem
class Nlp:
    def __init__(self, model, mode, variables, head):
        self.model, self.head, self.mode, self.n = model, head, mode, variables
        n = variables
        x1, v1, a = ca.SX.sym("x1", n), ca.SX.sym("v1", n), ca.SX.sym("a", n)
        x0, v0 = ca.SX.sym("x0", n), ca.SX.sym("v0", n)
        dt, look = head["step"], head["look_ahead"]
        equalities = [x1 - x0 - dt * v1, v1 - v0 - dt * a]
        unknown = [x1, v1, a]
        if mode == "literal":
            place, rate, acceleration = x1, v1, a
        else:
            place = ca.SX.sym("p", n)
            unknown.append(place)
            rate = acceleration = ca.SX.zeros(n)
            equalities.append(place - x0 - 2 / 3 * look * v0 - look ** 2 / 6 * a)
        ground = [ca.SX.sym(k, 3) for k in ("force", "omega", "turning", "up")]
        carried = ca.SX.sym("carried", 24 * len(model.carried))
        loads, angles = model.loads_and_angles(*ground, carried)
        each = lambda v: ca.horzcat(*[v[min(k, n - 1)] for k in range(2)])
        moved = ca.vertcat(each(place), each(rate), each(acceleration))
        outputs = ca.substitute(ca.vertcat(loads, angles), model.rods, moved)
        outputs = ca.cse(outputs)
        loads, angles = outputs[:4], outputs[4:]
        self.operations = ca.Function("f", [ca.vertcat(*unknown), model.measured, *ground, carried, x0, v0], [outputs]).n_instructions()
        cost = cost_of(model.wheels, loads, angles)
        z = ca.vertcat(*unknown)
        p = ca.vertcat(ca.vec(model.measured), *ground, carried, x0, v0)
        g = ca.vertcat(*equalities, loads / 1000, angles - head["min_stability_angle"])
        self.carried_of = model.carried_bodies()
        self.equal, self.size = sum(e.numel() for e in equalities), z.numel()
        self.inequal = g.numel() - self.equal
        options = {
            "print_time": False, "record_time": True, "jit": os.environ.get("INTERPRETED") is None, "compiler": "shell", "jit_options": {"flags": ["-O1"], "verbose": False},
            "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-13, "bound_relax_factor": 0.0, "acceptable_iter": 0, "max_iter": 200,
                      "dual_inf_tol": 1e-9, "constr_viol_tol": 1e-11, "compl_inf_tol": 1e-11},
        }
        problem = {"x": z, "p": p, "f": cost, "g": g}
        self.solver = ca.nlpsol("solver", "ipopt", problem, options)
        # where rounding keeps it from 1e-13
        easier = {**options, "jit": False, "ipopt": {**options["ipopt"], "tol": 1e-11, "dual_inf_tol": 1e-7, "compl_inf_tol": 1e-9}}
        self.easier = ca.nlpsol("easier", "ipopt", problem, easier)
        # reduced to the variable that the stabiliser reports: gradient and Hessian there
        u = place if mode != "literal" else a
        if mode == "literal":
            reduced = ca.substitute(ca.substitute(cost, x1, x0 + dt * (v0 + dt * a)), v1, v0 + dt * a)
            margins = ca.substitute(ca.substitute(ca.vertcat(loads, angles), x1, x0 + dt * (v0 + dt * a)), v1, v0 + dt * a)
        else:
            reduced, margins = cost, ca.vertcat(loads, angles)
        self.reduced = ca.Function("reduced", [u, p], [reduced, ca.gradient(reduced, u), ca.hessian(reduced, u)[0], margins])

    def limits(self, x, v):
        """Bounds of (31b-d) for one rod."""
        s, head = self.model.machine.suspension, self.head
        u = lambda d: 2 / math.pi * math.atan(d / head["zone"])
        down, up = u(x - s["stroke"][0]), u(s["stroke"][1] - x)
        rho = head["acceleration_at_stop"]
        share = lambda w: rho + (1 - rho) * w
        return s["stroke"], [-s["max_velocity"] * down, s["max_velocity"] * up], \
            [-s["max_acceleration"] * share(down), s["max_acceleration"] * share(up)]

    def solve(self, case, ground):
        n, head = self.n, self.head
        x, v = case["x"][:n], case["v"][:n]
        bounds = [self.limits(*xv) for xv in zip(x, v)]
        lower = [np.array([b[k][0] for b in bounds]) for k in range(3)]
        upper = [np.array([b[k][1] for b in bounds]) for k in range(3)]
        start = [np.array(x), np.zeros(n), np.zeros(n)]
        if self.mode != "literal":
            lower.append(lower[0]), upper.append(upper[0]), start.append(np.array(x))
        measured = np.array([case["joints"][name] for name in self.model.arm_names]).T
        carried = np.array(self.carried_of(measured)).flatten()
        p = np.concatenate([measured.flatten(order="F"), ground, carried, x, v])
        arguments = dict(x0=np.concatenate(start), p=p, lbx=np.concatenate(lower), ubx=np.concatenate(upper),
                         lbg=np.zeros(self.equal + self.inequal), ubg=np.concatenate([np.zeros(self.equal), np.full(self.inequal, np.inf)]))
        best = math.inf
        for _ in range(REPEATS):
            result = self.solver(**arguments)
            stats = self.solver.stats()
            if stats["t_wall_total"] < best:
                best = stats["t_wall_total"]
                inside = sum(stats[k] for k in stats if k.startswith("t_wall_nlp_"))
        ok, status = stats["success"], stats["return_status"]
        if not ok:
            result = self.easier(**arguments)
            ok, status = self.easier.stats()["success"], self.easier.stats()["return_status"]
        z = np.array(result["x"]).flatten()
        u = z[3 * n:4 * n] if self.mode != "literal" else z[2 * n:3 * n]
        # the range of that variable under (31b-f)
        dt, look = head["step"], head["look_ahead"]
        ranges = []
        for k in range(n):
            stroke, vel, acc = bounds[k]
            a = [max(acc[0], (vel[0] - v[k]) / dt, (stroke[0] - x[k] - dt * v[k]) / dt ** 2),
                 min(acc[1], (vel[1] - v[k]) / dt, (stroke[1] - x[k] - dt * v[k]) / dt ** 2)]
            if self.mode != "literal":
                reach = [x[k] + 2 / 3 * look * v[k] + look ** 2 / 6 * b for b in a]
                a = [min(max(reach[0], stroke[0]), stroke[1]), min(max(reach[1], stroke[0]), stroke[1])]
            ranges.append(a)
        return dict(u=u, cost=float(result["f"]), p=p, ranges=np.array(ranges), seconds=best, inside=inside,
                    ok=ok, status=status, iterations=stats["iter_count"])


def compare(program, mode, variables, count):
    lines = subprocess.run([program, mode, str(variables), str(count)], capture_output=True, text=True, check=True).stdout.splitlines()
    head, cases = json.loads(lines[0]), [json.loads(line) for line in lines[1:]]
    model = Model(Machine("bogie"))
    began = time.time()
    os.chdir(tempfile.mkdtemp())  # where the C compiler leaves its files
    nlp = Nlp(model, mode, variables, head)
    ground_of = model.ground_motion()
    print(f"\n{mode}, {variables} variable(s): {count} problems; model of {nlp.operations} operations, compiled in {time.time() - began:.0f} s", flush=True)
    rods = model.machine.suspension["linkages"]
    worst = dict(cost=0.0, argument=0.0, gradient=0.0, model=0.0)
    ours, theirs, own, iterations = [], [], [], []
    agreed = flat = both_lost = 0
    odd = []
    for i, case in enumerate(cases):
        measured = np.array([case["joints"][name] for name in model.arm_names]).T
        moving = np.array([[case["x"][k], case["v"][k], case["joints"][name][2]] for k, name in enumerate(rods)]).T
        ground = np.concatenate([np.array(g).flatten() for g in ground_of(
            measured, moving, case["specific_force"], case["angular_velocity"], case["angular_acceleration"], case["up"])])
        found = nlp.solve(case, ground)
        ours.append(case["seconds"]), theirs.append(found["seconds"]), own.append(found["seconds"] - found["inside"])
        iterations.append(found["iterations"])
        if case["status"] == "margin_lost" and not found["ok"]:
            both_lost += 1
            continue
        if case["status"] != "optimal" or not found["ok"]:
            odd.append((i, case["status"], found["status"]))
            continue
        mine = np.array(case["target"][:variables])
        cost, gradient, hessian, margins = (np.array(v) for v in nlp.reduced(mine, found["p"]))
        cost = cost.item()
        worst["model"] = max(worst["model"], abs(cost - case["cost"]) / abs(case["cost"]))
        excess = (cost - found["cost"]) / abs(found["cost"])
        half = (found["ranges"][:, 1] - found["ranges"][:, 0]) / 2
        # in halves of the range: curvature on the variables that no bound holds
        z = (mine - found["ranges"][:, 0]) / np.maximum(half, 1e-12) - 1
        g, h = gradient.flatten() * half, hessian * np.outer(half, half)
        free = [k for k in range(variables) if half[k] > 1e-9 and abs(z[k]) < 1 - 1e-7]
        held = margins.min() < 1e-6 * 1000 or (margins[4:] - head["min_stability_angle"]).min() < 1e-6
        curvature = np.linalg.eigvalsh(h[np.ix_(free, free)]).min() if free else math.inf
        largest = max(np.abs(np.linalg.eigvalsh(h)).max(), 1e-300)
        apart = np.max(np.abs(mine - found["u"]) / np.maximum(2 * half, 1e-9))
        if curvature > 1e-6 * largest:
            if apart > 1e-6:
                # another optimum: the problem is not convex
                odd.append((i, "argument", apart, mine, found["u"], curvature / largest, excess))
                continue
            worst["argument"] = max(worst["argument"], apart)
        elif not held:
            flat += 1
            worst["gradient"] = max(worst["gradient"], np.abs(g[free]).max() / abs(cost) if free else 0.0)
        worst["cost"] = max(worst["cost"], abs(excess))
        agreed += 1
    ours, theirs, own = (np.array(v) * 1e6 for v in (ours, theirs, own))
    at = lambda v, share: float(np.quantile(v, share))
    print(f"  both optimal {agreed}, neither can keep all margins {both_lost}, otherwise {len(odd)} {odd[:6]}")
    print(f"  worst: cost {worst['cost']:.1e} of it, argument {worst['argument']:.1e} of its range, "
          f"projected gradient {worst['gradient']:.1e} of the cost ({flat} flat), model {worst['model']:.1e}")
    for name, v in (("stabiliser", ours), ("IPOPT", theirs), ("  of that without the model", own)):
        print(f"  {name:27} median {at(v, 0.5):9.2f} us   99.9 % {at(v, 0.999):9.2f} us   least {v.min():9.2f} us")
    print(f"  IPOPT / stabiliser: median of the ratios {np.median(theirs / ours):.0f}, of the medians {np.median(theirs) / np.median(ours):.0f}; "
          f"without its model {np.median(own) / np.median(ours):.0f}; {np.median(iterations):.0f} iterations")
    return odd


if __name__ == "__main__":
    program, count = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 2000
    wanted = sys.argv[3:] or ["look-ahead,1", "look-ahead,2", "literal,1", "literal,2"]
    for which in wanted:
        mode, variables = which.split(",")
        compare(program, mode, int(variables), count)
