"""Suspension control in a closed loop with a simulated machine: its effect on contact forces from an independent simulator.

    python -m venv .venv && .venv/bin/pip install mujoco numpy matplotlib
    cargo build --workspace --release --bins --examples
    .venv/bin/python tests/closed_loop/closed_loop.py LAB TARGET/release OUT [MANOEUVRE ...]

LAB is the folder of the simulation laboratory (its machine `bogie` has two bogies, each turned by an actuator). OUT receives machine file, URDF,
results.json and closed_loop.png. Every manoeuvre runs with the rods locked at mid-stroke and twice with the rods controlled by `tipwatch stabilise`,
which at each control step receives joints, IMU and attitude of the simulation as a line:

- servo: its commanded positions and velocities go to stiff simulated servos of the rods;
- hydraulic: its valve commands go to the valves and cylinders of `examples/cylinders`, whose forces move the rods. It also receives their pressures.

The results are MuJoCo's contact forces averaged over 20 ms: spread (35) with each pair of wheels once, the smallest load, and the distance of the
centre of pressure from the middle. For comparison, the best posture is the least spread, at each sample, of the rods locked at five positions of the
stroke. The first 2 s are left out: the rods start to move at time zero, and their inertia first loads the wrong side. The default test run does not
include this script, which needs MuJoCo, the laboratory and some minutes. The exit code is 1 if a wheel lifted that could have been held down, if a
mean spread did not fall, if a largest spread rose by more than 2.5 %, or if, at any time of the whole run, the smallest load was below the smaller of
the machine's limit and that of the locked rods.
"""
import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

CONTROL_S = 0.02
OIL_S = 1e-3                                # step of the cylinders
LIMIT_N, MOST_SPREAD = 500.0, 1.025          # limits.min_load of the machine file; of the locked rods
HALF_WHEELBASE, HALF_TRACK = 1.15, 0.875    # of the machine (m)
POSTURES = (-0.2, -0.15, -0.1, -0.05, 0.0)  # rods (m)
DEGREE = math.pi / 180


def smooth(t, start, end):
    s = min(1.0, max(0.0, (t - start) / (end - start)))
    return s * s * s * (10 + s * (-15 + 6 * s))


def pose(lift_deg, tilt_deg, extension, slew):
    """Joint targets from the angles of the arm's published parameter set."""
    return {"slew": slew, "lift": lift_deg * DEGREE - 2.0736, "tilt": tilt_deg * DEGREE - 0.4116, "extension": extension,
            "suspension_right": -0.1, "suspension_left": -0.1}


def swing(t):
    """The arm swings from side to side in front."""
    s = smooth(t, 0, 2)
    return pose(50, -85, 0.15 + 0.1 * s * math.sin(0.7 * t), 0.8 * s * math.sin(0.5 * t))


def folded(t):
    """The paper's manoeuvre: the arm, folded over the platform, is raised and lowered a little."""
    s = smooth(t, 0, 2)
    return pose(FOLDED[0] + 4 * s * math.sin(0.4 * t), FOLDED[1], 0.0, 0.1 * s * math.sin(0.3 * t))


FOLDED = (110.0, -153.0)          # lift and tilt (degrees): the centre of mass 15 cm in front of the middle
REACH = (35.0, -50.0, 0.78, 0.75)    # lift and tilt (degrees), extension (m), slew (rad)


def reach(t):
    """The arm reaches forward until a rear wheel lifts, then returns."""
    s = smooth(t, 3, 7) - smooth(t, 12, 16)
    return pose(REACH[0] + (60 - REACH[0]) * (1 - s), REACH[1] - 35 * (1 - s), 0.1 + (REACH[2] - 0.1) * s, REACH[3])


MANOEUVRES = {"swing": (swing, 16.0), "folded": (folded, 20.0), "reach": (reach, 18.0)}


class Lines:
    """A program that answers lines of JSON."""

    def __init__(self, *command):
        self.command = command
        self.process = subprocess.Popen(command, text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def ask(self, line):
        self.process.stdin.write(json.dumps(line) + "\n")
        self.process.stdin.flush()
        return self.read()

    def read(self):
        answer = self.process.stdout.readline()
        if not answer:
            raise SystemExit(f"{self.command[0]} has ended")
        return json.loads(answer)

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class Loop:
    """Replaces the mujoco module inside the laboratory's simulation: before each step the rods receive the latest command."""

    def __init__(self, mujoco, machine, programs, machine_path, clear_s, kind):
        self._mujoco, self.machine, self.programs, self.machine_path, self.clear_s = mujoco, machine, programs, machine_path, clear_s
        self.kind, self.cylinders, self.oil, self.oil_due = kind, None, None, 0.0
        self.stabiliser, self.command, self.due, self.sums, self.count, self.log = None, None, 0.0, None, 0, []

    def __getattr__(self, name):
        return getattr(self._mujoco, name)

    def measured(self, model, data):
        """Positions and velocities of the joints as in a log."""
        names = [*self.machine.arm_joints, *[k.rod for k in self.machine.linkages if k.rod.startswith("suspension")],
                 *[link for link, _ in self.machine.wheels.values()]]
        at = lambda name: model.joint(name).id
        return {n: (float(data.qpos[model.jnt_qposadr[at(n)]]), float(data.qvel[model.jnt_dofadr[at(n)]])) for n in names}

    def mj_step(self, model, data):
        if self.kind != "locked" and data.time >= self.clear_s - CONTROL_S:
            self.steer(model, data)
        self._mujoco.mj_step(model, data)
        sensed = np.array(data.sensordata[:6])
        self.sums = sensed if self.sums is None else self.sums + sensed
        self.count += 1

    def steer(self, model, data):
        if data.time >= self.due:
            self.ask(model, data)
            self.due = data.time + CONTROL_S - 1e-9
        if self.kind == "hydraulic":
            return self.press(model, data)
        since = data.time - (self.due - CONTROL_S)
        for k, rod in enumerate(self.stabiliser.ready["rods"]):
            import simulate
            kp, kv = simulate.GAINS[rod]
            velocity = 0.0 if self.command["hold"] else self.command["velocity"][k]
            end = self.command["position"][k]
            position = end - velocity * max(0.0, CONTROL_S - since)
            data.ctrl[model.actuator(rod).id] = position + kv / kp * velocity

    def press(self, model, data):
        """The cylinders push the rods."""
        rods = self.stabiliser.ready["rods"]
        ids = [model.actuator(rod).id for rod in rods]
        places = [model.joint(rod).id for rod in rods]
        extension = [float(data.qpos[model.jnt_qposadr[p]]) - self.stabiliser.ready["stroke_m"][0] for p in places]
        velocity = [float(data.qvel[model.jnt_dofadr[p]]) for p in places]
        if self.cylinders is None:
            self.cylinders = Lines(str(self.programs / "examples" / "cylinders"), str(self.machine_path))
            self.friction = self.cylinders.read()["friction"]
            self.oil = self.cylinders.ask({"load": [float(data.actuator_force[i]) for i in ids], "extension": extension})
            for i in ids:    # from a servo to a force
                model.actuator_gainprm[i, 0] = 1.0
                model.actuator_biasprm[i, :] = 0.0
        if data.time >= self.oil_due:
            self.oil_due = data.time + OIL_S - 1e-9
            self.oil = self.cylinders.ask({"opening": self.command["opening"], "extension": extension, "velocity": velocity, "seconds": OIL_S})
        for i, force, v in zip(ids, self.oil["force"], velocity):
            data.ctrl[i] = force - self.friction * v

    def close(self):
        for program in (self.stabiliser, self.cylinders):
            if program:
                program.close()

    def ask(self, model, data):
        joints = self.measured(model, data)
        felt = self.sums / self.count
        self.sums, self.count = None, 0
        if self.stabiliser is None:
            self.stabiliser = Lines(str(self.programs / "tipwatch"), "stabilise", "--machine", str(self.machine_path), "--step", str(CONTROL_S))
            self.stabiliser.ready = self.stabiliser.ask({"joints": {n: p for n, (p, _) in joints.items()}})
            self.before, self.felt, self.turning = joints, felt, np.zeros(3)
            self.rates = {n: 0.0 for n in joints}
        # accelerations: differences over one step, smoothed over several
        for n in joints:
            self.rates[n] += 0.3 * ((joints[n][1] - self.before[n][1]) / CONTROL_S - self.rates[n])
        self.turning = self.turning + 0.3 * ((felt[3:] - self.felt[3:]) / CONTROL_S - self.turning)
        self.felt = self.felt + 0.5 * (felt - self.felt)
        self.before = joints
        rotation = data.xmat[model.body(self.machine.base).id].reshape(3, 3)
        pressures = {"pressures": self.oil["pressures"]} if self.oil else {}
        self.command = self.stabiliser.ask(pressures | {
            "joints": {n: [p, v, self.rates[n]] for n, (p, v) in joints.items()},
            "rods": [joints[rod][0] for rod in self.stabiliser.ready["rods"]],
            "specific_force": self.felt[:3].tolist(), "angular_velocity": self.felt[3:].tolist(),
            "angular_acceleration": self.turning.tolist(), "up": rotation[2].tolist()})
        self.log.append((data.time - self.clear_s, self.command["status"], *self.command["position"]))


def run(name, kind, programs, machine_path, rod=-0.1):
    import model
    import mujoco
    import simulate
    arm, seconds = MANOEUVRES[name]
    rods = {"suspension_right": rod, "suspension_left": rod}
    scenario = simulate.Scenario(name, model.bogie(), seconds, lambda t: arm(t) | rods, lambda t: (0.0, 0.0), clear=2.5, noise=0.0)
    loop = Loop(mujoco, scenario.machine, programs, machine_path, scenario.clear, kind)
    simulate.mujoco = loop
    try:
        _, _, rows = simulate.run(scenario)
    finally:
        simulate.mujoco = mujoco
        loop.close()
    every = 10    # of 500 Hz
    wheels = ("fl", "fr", "rl", "rr")
    loads = np.array([[row[f"load_{w}"] for w in wheels] for row in rows])
    loads = loads[: len(loads) // every * every].reshape(-1, every, 4).mean(axis=1)
    t = np.array([row["t"] for row in rows])[: len(loads) * every : every]
    return t, loads, loop.log


def spread(loads):
    return sum(np.abs(loads[:, i] - loads[:, j]) for i in range(4) for j in range(i))


def figures(t, loads, log):
    used = t > 2.0    # after the control has started
    least = loads[used].min(axis=0)
    front, left = (loads[used] @ np.array(signs) / loads[used].sum(axis=1) for signs in ([1, 1, -1, -1], [1, -1, 1, -1]))
    offset = np.hypot(HALF_WHEELBASE * front, HALF_TRACK * left)
    return {"mean_offset_of_pressure_m": float(offset.mean()), "mean_spread_n": float(spread(loads[used]).mean()), "largest_spread_n": float(spread(loads[used]).max()),
            "least_load_n": dict(zip(("fl", "fr", "rl", "rr"), map(float, least))), "smallest_load_n": float(least.min()),
            "seconds_with_a_wheel_off": float((loads[used] < 1.0).any(axis=1).sum() * (t[1] - t[0])),
            "statuses": {s: sum(1 for entry in log if entry[1] == s) for s in sorted({entry[1] for entry in log})}}


def draw(results, path):
    import matplotlib
    matplotlib.use("agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(2, len(results), figsize=(4 * len(results), 5), constrained_layout=True, sharex="col", squeeze=False)
    for column, (name, runs) in enumerate(results.items()):
        for (kind, (t, loads, _)), colour in zip(runs.items(), ("#E69F00", "#0072B2", "#009E73")):
            axes[0][column].plot(t, spread(loads) / 1e3, color=colour, linewidth=1, label=kind)
            axes[1][column].plot(t, loads.min(axis=1) / 1e3, color=colour, linewidth=1, label=kind)
        axes[0][column].set_title(f"{name}: spread of the loads", fontsize=9)
        axes[1][column].set_title("smallest load", fontsize=9)
        axes[1][column].set_xlabel("s")
        for row in axes:
            row[column].set_ylabel("kN")
            row[column].grid(alpha=0.3)
        axes[0][column].legend(fontsize=8)
    figure.savefig(path, dpi=90)


def below(locked, controlled):
    """The smallest load under control less the smaller of the limit and that of the locked rods: the least over the run (N)."""
    rows = min(len(locked), len(controlled))
    least = [loads[:rows].min(axis=1) for loads in (locked, controlled)]
    return float((least[1] - np.minimum(least[0], LIMIT_N)).min())


def main(lab, programs, out, *names):
    sys.path.insert(0, lab)
    import machine_file
    import model
    programs, out = Path(programs), Path(out)
    out.mkdir(parents=True, exist_ok=True)
    (out / "bogie.urdf").write_text(model.urdf(model.bogie()))
    machine_path = out / "bogie.toml"
    machine_path.write_text(machine_file.machine_toml(model.bogie(), "bogie.urdf"))
    results, told, failed = {}, {}, False
    for name in names or MANOEUVRES:
        results[name] = {kind: run(name, kind, programs, machine_path) for kind in ("locked", "servo", "hydraulic")}
        told[name] = {kind: figures(*of) for kind, of in results[name].items()}
        fixed = told[name]["locked"]
        t = results[name]["locked"][0]
        still = [spread(run(name, "locked", programs, machine_path, rod)[1]) for rod in POSTURES]
        rows = min(map(len, still))
        best = float(np.min([s[:rows] for s in still], axis=0)[t[:rows] > 2.0].mean())
        told[name]["best_posture_mean_spread_n"] = best
        for kind in ("servo", "hydraulic"):
            controlled = told[name][kind]
            gain = (fixed["mean_spread_n"] - controlled["mean_spread_n"]) / (fixed["mean_spread_n"] - best)
            worst = below(results[name]["locked"][1], results[name][kind][1])
            controlled |= {"gain_share": gain, "least_against_locked_n": worst}
            less = 100 * (1 - controlled["mean_spread_n"] / fixed["mean_spread_n"])
            print(f"{name}, {kind}: spread {fixed['mean_spread_n']:.0f} -> {controlled['mean_spread_n']:.0f} N ({less:.1f} % less, {100 * gain:.0f} % of what the best posture can do), "
                  f"largest {fixed['largest_spread_n']:.0f} -> {controlled['largest_spread_n']:.0f} N, centre of pressure {100 * fixed['mean_offset_of_pressure_m']:.1f} -> "
                  f"{100 * controlled['mean_offset_of_pressure_m']:.1f} cm from the middle, smallest load {fixed['smallest_load_n']:.0f} -> {controlled['smallest_load_n']:.0f} N, "
                  f"a wheel off the ground {fixed['seconds_with_a_wheel_off']:.2f} -> {controlled['seconds_with_a_wheel_off']:.2f} s, against the smaller of limit and locked {worst:.0f} N, "
                  f"{controlled['statuses']}", flush=True)
            failed |= less <= 0 or (name == "reach" and controlled["smallest_load_n"] <= 1.0) or worst < 0
            failed |= controlled["largest_spread_n"] > MOST_SPREAD * fixed["largest_spread_n"]
    (out / "results.json").write_text(json.dumps(told, indent=1))
    draw(results, out / "closed_loop.png")
    raise SystemExit(int(failed))


if __name__ == "__main__":
    main(*sys.argv[1:])
