"""Simulate the manoeuvres of the calibration matrix: clean logs of sound sensors, with everything that is true about them.

    .venv/bin/python manoeuvres.py LAB OUT [--set NAME] [--only PATTERNS]

LAB is the folder of the simulation laboratory. Each log has a folder OUT/SET/MACHINE.MANOEUVRE of its own with

    clean.mcap       the log without noise: IMU 250 Hz, joint states 100 Hz, odometry 50 Hz
    machine.toml, machine.urdf
    truth.parquet    wheel loads at 500 Hz [N] and the tilt against the ground [rad]
    truth.json       lifts, tip-over, payload, tyres, slope, and the drawn parameters of the manoeuvre

SET is `set`, on which constants may be chosen, or `held`, on which they are judged: the same manoeuvres with other parameters. Every other name draws
parameters of its own, too, so that nothing can have been chosen on them. A folder that has a truth.json is left as it is, and a machine that cannot do
a manoeuvre with what is drawn for it (its arm is too short to lift a wheel) has none. Times are seconds after the origin of the laboratory's clock (`writelog.T0`), which is that of the stamps, too.
"""
import argparse
import dataclasses
import fnmatch
import json
import math
import sys
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Callable

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "data"))
from fixture_tools import arm_pose, smooth, stamp, standing, thinned, typestore, via, write_mcap    # noqa: E402

SETS = ("set", "held")
SETTLE_S = 2.5
LIFT_S = 0.05          # a load of zero counts as a lift from this duration on
TIP_RAD = math.radians(10)
AFTER_FALL_S = 3.0     # the log goes on for so long after the machine has come to rest after its fall
SIDE_RAD = math.radians(60)


# ---- machines

@dataclass
class Kind:
    """A machine of the matrix: how it is built, and what the laboratory's writers do not know of it."""
    build: Callable[[float], object]               # payload [kg] -> model.Machine
    size: float = 1.0                              # lengths, as a multiple of the laboratory's machines
    mass: float = 1.0                              # masses, likewise
    tyre: tuple = (8e5, 1.2e4)                     # N/m, N s/m
    wheel: tuple = (0.35, 0.12)                    # radius and half width [m]
    half_track: float = 0.875
    half_base: float = 1.15
    rods: tuple = ()
    free_joints: tuple = ()
    edit_toml: Callable[[str], str] = lambda text: text
    edit_urdf: Callable[[str], str] = lambda text: text
    edit_mjcf: Callable[[str], str] = lambda text: text


PIVOT_STOP = math.radians(6)


def pivoting(wheels, x):
    """The rigid machine with two wheels on an axle that turns freely about its middle, up to stops."""
    def build(payload):
        import model
        machine, axle = model.rigid(yaw0=0.0, payload=payload), "pivot_axle"
        links = [dataclasses.replace(l, parent=axle, pos=(0, l.pos[1], 0)) if l.name in wheels else l for l in machine.links]
        first = next(k for k, l in enumerate(links) if l.name in wheels)
        links.insert(first, model.Link(axle, "base_link", (x, 0, -0.10), np.eye(3), (axle, "revolute", (1, 0, 0)), 140.0, (0, 0, 0), np.diag([25.0, 3.0, 25.0])))
        return dataclasses.replace(machine, links=links)
    hinge = "<joint name='pivot_axle' type='hinge' axis='1 0 0'"
    stops = f"{hinge} range='{-PIVOT_STOP} {PIVOT_STOP}' damping='200' solreflimit='0.004 1' solimplimit='0.98 0.99 0.001'"

    def edit_urdf(text):
        before, axle, after = text.partition("<joint name='pivot_axle'")
        return before + axle + after.replace("lower='-10' upper='10'", f"lower='{-PIVOT_STOP}' upper='{PIVOT_STOP}'", 1)
    return Kind(build, free_joints=("pivot_axle",), edit_urdf=edit_urdf, edit_mjcf=lambda text: text.replace(hinge, stops),
                edit_toml=lambda text: text.replace("front_share = 0.5\ntyre", 'free_joints = ["pivot_axle"]\ntyre'))


def scaled(machine, length, mass):
    """A geometrically similar machine: all lengths times `length`, all masses times `mass`."""
    vector = lambda v: tuple(length * np.array(v, float))
    links = [dataclasses.replace(l, pos=vector(l.pos), com=vector(l.com), mass=l.mass * mass, inertia=l.inertia * mass * length**2) for l in machine.links]
    linkages = [dataclasses.replace(k, rod_point=vector(k.rod_point), anchor_point=vector(k.anchor_point)) for k in machine.linkages]
    wheels = {name: (link, radius * length) for name, (link, radius) in machine.wheels.items()}
    return dataclasses.replace(machine, name=f"{machine.name}_scaled", links=links, linkages=linkages, wheels=wheels, imu=vector(machine.imu), z0=machine.z0 * length)


HEAVY = 1.3, 2.1    # lengths, masses
LIGHT = 0.42, 0.0213


def kinds():
    import make_forwarder
    import model
    length, mass = HEAVY
    rigid = Kind(lambda payload: model.rigid(yaw0=0.0, payload=payload))
    # 9.3 t on six wheels, the rear ones in pairs on free bogies
    forwarder = Kind(make_forwarder.forwarder, tyre=make_forwarder.TYRE, wheel=(make_forwarder.RADIUS, make_forwarder.HALF_WIDTH),
                     half_track=make_forwarder.HALF_TRACK, half_base=2.1, free_joints=tuple(make_forwarder.BOGIES), edit_toml=make_forwarder.edit_toml)
    return {
        "rigid": rigid,
        "soft": dataclasses.replace(rigid, tyre=(2e5, 6e3)),
        "pivot": pivoting(("wheel_rl", "wheel_rr"), -1.15),
        "front_pivot": pivoting(("steer_fl", "steer_fr"), 1.15),
        "bogie": Kind(lambda payload: model.bogie(payload=payload), rods=("suspension_right", "suspension_left")),
        # 7.4 t on softer tyres, with its IMU off the middle
        "heavy": Kind(lambda payload: dataclasses.replace(scaled(model.rigid(yaw0=0.0, payload=payload / mass), length, mass), imu=(-0.45, 0.3, 0.4)),
                      size=length, mass=mass, tyre=(6e5, 1.4e4), wheel=(0.35 * length, 0.12 * length),
                      half_track=0.875 * length, half_base=1.15 * length),
        "forwarder": forwarder,
        # with loads at its tool that can turn it over
        "carrier": dataclasses.replace(forwarder, mass=5.0),
        # 75 kg on hard wheels: a robot that moves its arm far faster than the machines that the estimator's defaults are made for
        "light": Kind(lambda payload: scaled(model.rigid(yaw0=0.0, payload=payload / LIGHT[1]), *LIGHT), size=LIGHT[0], mass=LIGHT[1], tyre=(6e4, 250.0),
                      wheel=(0.35 * LIGHT[0], 0.12 * LIGHT[0]), half_track=0.875 * LIGHT[0], half_base=1.15 * LIGHT[0],
                      edit_toml=lambda text: text.replace("min_load = 500.0", "min_load = 10.0")),
    }


def centre_of_mass(machine, posture):
    """Of a machine whose base is at the origin and level [m]."""
    from model import rx, ry, rz
    from simulate import solve_pivot, triangle
    q = dict(posture)
    for k in machine.linkages:
        if k.pivot not in q:
            q[k.pivot] = solve_pivot(machine, k, q.get(k.rod, 0.0))
        q[k.rod], q[k.cylinder] = triangle(machine, k, q[k.pivot])
    turn = {(1, 0, 0): rx, (0, 1, 0): ry, (0, 0, 1): rz}
    frames, moment, total = {None: (np.zeros(3), np.eye(3))}, np.zeros(3), 0.0
    for link in machine.links:    # parents stand before their children
        at, axes = frames[link.parent]
        if link.parent:
            at, axes = at + axes @ np.array(link.pos, float), axes @ link.R
        if link.joint:
            name, kind, axis = link.joint
            value = q.get(name, 0.0)
            if kind == "prismatic":
                at = at + axes @ (value * np.array(axis, float))
            else:
                axes = axes @ turn[tuple(axis)](value)
        frames[link.name] = at, axes
        moment, total = moment + link.mass * (at + axes @ np.array(link.com, float)), total + link.mass
    return moment / total


def shares(kind, machine, posture, slope=(0.0, 0.0), acceleration=0.0):
    """Where the line of action meets the ground, forward and to the left, as shares of half the wheelbase and of half the track.
    On four equal tyres a wheel lifts where their absolute values add up to 1, and the machine tips where one of them reaches 1."""
    from model import G, rx, ry
    down = (ry(slope[1]) @ rx(slope[0])).T @ np.array([0, 0, -G]) - np.array([acceleration, 0, 0])
    centre = centre_of_mass(machine, posture)
    middle = np.mean([p for p in wheel_places(machine)], axis=0)
    ground = middle[2] - kind.wheel[0]
    met = centre + down * (centre[2] - ground) / -down[2]
    return (met[0] - middle[0]) / kind.half_base, (met[1] - middle[1]) / kind.half_track


def wheel_places(machine):
    for link, _ in machine.wheels.values():
        at, name = np.zeros(3), link
        while name:
            part = machine.link(name)
            at, name = at + (np.array(part.pos, float) if part.parent else 0), part.parent
        yield at


class CannotDo(Exception):
    """What is drawn for a manoeuvre is beyond a machine."""


def reach_where(wanted, measure):
    """The reach from 0 to 1 at which a measure that grows with it is `wanted`."""
    low, high = 0.0, 1.0
    if measure(high) < wanted:
        raise CannotDo(f"a full reach gives {measure(high):.2f}, not the {wanted:.2f} of this manoeuvre")
    if measure(low) > wanted:
        raise CannotDo(f"no reach gives {measure(low):.2f}, more than the {wanted:.2f} of this manoeuvre")
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if measure(middle) < wanted else (low, middle)
    return high


# ---- manoeuvres

class Draw:
    """Parameters drawn uniformly by name, and kept for the truth."""

    def __init__(self, seed):
        self.random, self.values = np.random.default_rng(seed), {}

    def __call__(self, name, low, high):
        self.values[name] = float(self.random.uniform(low, high))
        return self.values[name]

    def sign(self, name):
        self.values[name] = float(self.random.choice([-1, 1]))
        return self.values[name]


@dataclass
class Plan:
    """What a manoeuvre asks of the laboratory."""
    duration: float
    arm: Callable[[float], dict]
    drive: Callable[[float], tuple] = standing
    slope: tuple = (0.0, 0.0)                      # rad
    ground: str = ""
    wrench: Callable | None = None
    payload: float = 0.0                           # kg, true
    stated: tuple | None = None                    # mass and standard deviation in the machine file [kg]
    softness: float = 1.0                          # true tyre stiffness as a share of the stated one
    falls: bool = False
    arm_touches: bool = False                      # the tool can touch the ground


class Setting:
    """What a manoeuvre is planned with: a machine and its drawn parameters."""

    def __init__(self, kind, draw):
        self.kind, self.draw = kind, draw

    def pose(self, lift, tilt, out, slew, rods=-0.1):
        """Joint targets in degrees, and metres for a machine of size 1."""
        return arm_pose(lift, tilt, out * self.kind.size, slew) | {rod: rods for rod in self.kind.rods}

    def reaching(self, reach, slew):
        """From folded (0) to stretched out (1)."""
        return self.pose(52 - 34 * reach, -95 + 70 * reach, 0.05 + 1.15 * reach, slew)

    def folded(self):
        lift, tilt, slew = self.draw("lift", 46, 54), self.draw("tilt", -95, -85), self.draw("slew", 165, 195)
        return self.pose(lift, tilt, 0.1, slew)

    def load(self, kilograms):
        """A payload as heavy for this machine as so many kilograms are for the laboratory's machines."""
        return kilograms * self.kind.mass

    def grappled(self, low, high):
        """A payload that the machine file states within 2 %: its mass, and what is stated."""
        mass = self.load(self.draw("payload", low, high))
        stated = mass / (1 + self.draw("error", -0.02, 0.02))
        return mass, (stated, 0.02 * stated)

    def working(self, begin=1.0, end=1e9, around=180.0, wide=55.0):
        """The arm moves in all its joints."""
        rate = [self.draw(f"rate_{k}", 0.5, 1.3) for k in range(4)]
        phase = [self.draw(f"phase_{k}", 0, 2 * math.pi) for k in range(4)]

        def arm(t):
            on = smooth(t, begin, begin + 2) - smooth(t, end - 2, end)
            lift, tilt, out, slew = (on * math.sin(rate[k] * t + phase[k]) for k in range(4))
            return self.pose(48 + 6 * lift, -88 + 9 * tilt, 0.2 + 0.15 * out, around + wide * slew)
        return arm

    def level(self, degrees=1.5):
        """Nearly level ground."""
        return tuple(math.radians(self.draw(name, -degrees, degrees)) for name in ("roll_deg", "pitch_deg"))

    def ridges(self, sides, count=12):
        """Cylinders across the path, sunk so that their tops are at their heights."""
        text, x = "", 2.2 * self.kind.size
        for i in range(count):
            x += self.draw(f"gap_{i}", 1.2, 2.6)
            height = self.draw(f"height_{i}", 0.01, 0.035)
            side = sides or self.draw.sign(f"side_{i}")
            half, y = (3.0, 0.0) if sides else (0.5, side * self.kind.half_track)
            text += (f"<geom name='ridge_{i}' type='cylinder' size='1.5 {half}' pos='{x} {y} {height - 1.5}' quat='0.7071067811865476 0.7071067811865476 0 0' "
                     "contype='2' conaffinity='1' friction='0.9 0.01 0.005' condim='4' solref='0.004 1.0' solimp='0.98 0.98 0.001'/>")
        return text


def stand(s):
    pose = s.folded()
    return Plan(14.0, lambda _t: pose, slope=s.level(3))


def arm_work(s):
    return Plan(20.0, s.working(), slope=s.level())


def arm_swing(s):
    """The arm stands, swings as fast as the joints of a robot, and stands again."""
    begin, seconds = s.draw("begin", 2.5, 4.0), s.draw("seconds", 8.0, 10.0)
    rate = [2 * math.pi * s.draw(f"rate_{k}", low, high) for k, (low, high) in enumerate([(0.4, 0.7), (0.3, 0.6), (0.3, 0.6)])]
    wide = [s.draw(f"wide_{k}", low, high) for k, (low, high) in enumerate([(30, 45), (5, 9), (8, 14)])]

    def arm(t):
        on = smooth(t, begin, begin + 1) - smooth(t, begin + seconds, begin + seconds + 1)
        slew, lift, tilt = (on * width * math.sin(w * (t - begin)) for w, width in zip(rate, wide))
        return s.pose(44 + lift, -80 + tilt, 0.3, 90 + slew)
    return Plan(18.0, arm)


def arm_work_slope(s):
    return Plan(16.0, s.working(around=180, wide=30), slope=s.level(5))


def payload_in_band(s):
    mass = s.load(s.draw("payload", 150, 220))
    stated = mass / (1 + s.draw("error", -0.05, 0.05))
    return Plan(16.0, s.working(wide=35), payload=mass, stated=(stated, 0.05 * stated), slope=s.level())


def tool_force(s):
    """The arm takes a load and puts it down again; the force on the tool is measured."""
    mass, arm = s.load(s.draw("taken", 120, 220)), s.working(wide=30)
    return Plan(14.0, arm, wrench=lambda t: (0.0, 0.0, -mass * 9.8066 * (smooth(t, 4, 5) - smooth(t, 10, 10.8))))


def drive(s):
    pose, speed, yaw = s.folded(), s.draw("speed", 1.0, 2.2), s.draw("yaw", -0.15, 0.15)
    return Plan(16.0, lambda _t: pose, lambda t: (speed * (smooth(t, 1, 4) - smooth(t, 12, 15)), yaw * (smooth(t, 5, 7) - smooth(t, 9, 11))), slope=s.level())


def drive_and_work(s):
    speed, yaw, arm = s.draw("speed", 0.6, 1.4), s.draw("yaw", -0.2, 0.2), s.working(wide=20)
    return Plan(18.0, arm, lambda t: (speed * (smooth(t, 1, 3) - smooth(t, 10, 12)), yaw * (smooth(t, 3, 5) - smooth(t, 7, 9))), slope=s.level())


def hard_brake(s):
    pose, speed, takes = s.folded(), s.draw("speed", 2.0, 3.0), s.draw("takes", 0.9, 1.4)
    go = lambda t: smooth(t, 0.5, 3) - smooth(t, 4, 4 + takes) + smooth(t, 6.5, 9) - smooth(t, 10, 10 + takes)
    return Plan(14.0, lambda _t: pose, lambda t: (speed * go(t), 0.0), slope=s.level())


def corner(s):
    pose, speed, yaw = s.folded(), s.draw("speed", 1.4, 2.2), s.draw.sign("side") * s.draw("yaw", 0.35, 0.6)
    return Plan(15.0, lambda _t: pose, lambda t: (speed * (smooth(t, 0.5, 3) - smooth(t, 11, 13)), yaw * (smooth(t, 3.5, 5) - smooth(t, 9, 10.5))))


def slalom(s):
    speed, yaw, rate, arm = s.draw("speed", 1.2, 1.9), s.draw("yaw", 0.25, 0.45), s.draw("rate", 0.7, 1.2), s.working(wide=10)
    return Plan(18.0, arm, lambda t: (speed * (smooth(t, 0.5, 3) - smooth(t, 15, 16.5)), yaw * (smooth(t, 3, 4) - smooth(t, 14, 15)) * math.sin(rate * t)))


def side_slope(s):
    roll, speed, arm = s.draw.sign("side") * s.draw("roll_deg", 5, 9), s.draw("speed", 0.4, 0.9), s.working(wide=25)
    return Plan(18.0, arm, lambda t: (speed * (smooth(t, 1, 3) - smooth(t, 11, 13)), 0.0), slope=(math.radians(roll), 0.0))


def up_down(s):
    pitch, speed, pose = s.draw.sign("side") * s.draw("pitch_deg", 5, 10), s.draw("speed", 0.8, 1.5), s.folded()
    return Plan(18.0, lambda _t: pose, lambda t: (speed * via(t, (1, 0), (3, 1), (6, 1), (8, 0), (9, 0), (11, -1), (14, -1), (16, 0)), 0.0), slope=(0.0, math.radians(pitch)))


def bump_one(s):
    pose, speed = s.folded(), s.draw("speed", 0.5, 1.0)
    return Plan(16.0, lambda _t: pose, lambda t: (speed * (smooth(t, 1, 3) - smooth(t, 13, 14.5)), 0.0), ground=s.ridges(None))


def bump_both(s):
    pose, speed = s.folded(), s.draw("speed", 0.5, 1.2)
    return Plan(16.0, lambda _t: pose, lambda t: (speed * (smooth(t, 1, 3) - smooth(t, 13, 14.5)), 0.0), ground=s.ridges("both"))


def ramp_over(s):
    """Onto a bed by a ramp, as for loading, across it, and down another one."""
    pose, speed, size = s.folded(), s.draw("speed", 0.7, 1.3), s.kind.size
    up, down = math.radians(s.draw("up_deg", 10, 22)), math.radians(s.draw("down_deg", 10, 22))
    surface = "contype='2' conaffinity='1' friction='0.9 0.01 0.005' condim='4' solref='0.004 1.0' solimp='0.98 0.98 0.001'"
    height, x, text = s.draw("height", 0.7, 1.1) * size, 3.0 * size, ""
    for name, pitch, length in (("up", up, height / math.sin(up)), ("bed", 0.0, s.draw("bed", 3.0, 6.0) * size), ("down", -down, height / math.sin(down))):
        # a box whose upper face begins at x, 0 or the bed's height, and rises by its pitch
        z = height if name != "up" else 0.0
        end = x + length * math.cos(pitch), z + length * math.sin(pitch)
        middle = 0.5 * (x + end[0]) + 0.5 * math.sin(pitch), 0.5 * (z + end[1]) - 0.5 * math.cos(pitch)
        text += (f"<geom name='{name}' type='box' size='{0.5 * length} 4 0.5' pos='{middle[0]} 0 {middle[1]}' "
                 f"quat='{math.cos(0.5 * pitch)} 0 {-math.sin(0.5 * pitch)} 0' {surface}/>")
        x = end[0]
    seconds = (x + 4.0 * size) / speed
    return Plan(seconds + 4.0, lambda _t: pose, lambda t: (speed * (smooth(t, 1, 3) - smooth(t, 1 + seconds, 3 + seconds)), 0.0), ground=text)


def stop_and_go(s):
    pose, speed, period = s.folded(), s.draw("speed", 0.6, 1.6), s.draw("period", 3.4, 4.6)

    def go(t):
        phase = (t - 1.0) % period if t > 1 else 0.0
        return speed * (smooth(phase, 0.0, 0.3 * period) - smooth(phase, 0.5 * period, 0.75 * period))
    return Plan(20.0, lambda _t: pose, lambda t: (go(t), 0.0), slope=s.level())


def reversing(s):
    pose, speed, yaw = s.folded(), s.draw("speed", 0.6, 1.3), s.draw("yaw", -0.3, 0.3)
    return Plan(18.0, lambda _t: pose, lambda t: (speed * via(t, (1, 0), (3, -1), (7, -1), (9, 0), (10, 1), (13, 1), (14, -0.8), (16, 0)), yaw * (smooth(t, 3, 4.5) - smooth(t, 6, 7.5))), slope=s.level())


def suspension(s):
    """The rods turn the bogies while the arm works and the machine stands, then drives."""
    speed, high, rate, roll, work = s.draw("speed", 0.4, 0.8), s.draw("high", 0.005, 0.02), s.draw("rate", 0.5, 1.0), s.draw("roll", 0.0, 0.002), s.working(wide=25)

    def arm(t):
        on = smooth(t, 2, 4)
        both, one = high * on * math.sin(rate * t), roll * on * math.sin(0.7 * rate * t)
        return work(t) | {"suspension_right": -0.1 + both + one, "suspension_left": -0.1 + both - one}
    return Plan(20.0, arm, lambda t: (speed * (smooth(t, 11, 13) - smooth(t, 17, 19)), 0.0))


def soft_ground(s):
    return Plan(18.0, s.working(wide=40), softness=s.draw("softness", 0.3, 0.6))


def lift_return(s):
    """The arm reaches out over a corner until the opposite wheel lifts, waits, and comes back."""
    side, lifted, (mass, stated) = s.draw.sign("side"), s.draw("lifted", 1.06, 1.15), s.grappled(230, 280)
    slew, takes, roll = side * s.draw("slew", 120, 140), s.draw("takes", 3.0, 4.5), s.draw("roll_deg", 1.0, 3.0)
    slope, machine = (-side * math.radians(roll), 0.0), s.kind.build(mass)
    reach = reach_where(lifted, lambda r: sum(map(abs, shares(s.kind, machine, s.reaching(r, slew), slope))))
    arm = lambda t: s.reaching(reach * (smooth(t, 1.5, 1.5 + takes) - smooth(t, 3.5 + takes, 6.5 + takes)), slew)
    return Plan(9.0 + takes, arm, slope=slope, payload=mass, stated=stated)


def brake_lift(s):
    """Braking lifts the rear wheels; they come down again."""
    speed, deceleration, lifted = s.draw("speed", 2.2, 3.0), s.draw("deceleration", 3.0, 4.5), s.draw("lifted", 1.03, 1.10)
    mass, stated = s.grappled(40, 80)
    takes, machine = 1.875 * speed / deceleration, s.kind.build(mass)    # the greatest slope of `smooth` is 1.875 times its mean
    reach = reach_where(lifted, lambda r: shares(s.kind, machine, s.reaching(r, 0), acceleration=-deceleration)[0])
    return Plan(13.0, lambda _t: s.reaching(reach, 0), lambda t: (speed * (smooth(t, 0.5, 4.5) - smooth(t, 6, 6 + takes)), 0.0), payload=mass, stated=stated)


def tipping_reach(s, payload, stated):
    """The arm reaches out over the downhill side until the machine falls."""
    side, beyond, takes = s.draw.sign("side"), s.draw("beyond", 1.05, 1.12), s.draw("takes", 4.0, 7.0)
    roll, slew = s.draw("roll_deg", 5, 9), side * s.draw("slew", 75, 105)
    machine, measure = s.kind.build(payload), None
    for roll in np.arange(roll, 20.0, 0.5):    # as steep as it takes for the reach of this arm
        slope = (-side * math.radians(roll), 0.0)
        measure = lambda r: abs(shares(s.kind, machine, s.reaching(r, slew), slope)[1])
        if measure(1.0) > beyond + 0.02:
            break
    reach = reach_where(beyond, measure)
    return Plan(16.0, lambda t: s.reaching(reach * smooth(t, 1.5, 1.5 + takes), slew), slope=slope, payload=payload, stated=stated, falls=True)


def tip_side(s):
    return tipping_reach(s, *s.grappled(150, 250))


def tip_caught(s):
    """The tool reaches the ground first, and catches the machine."""
    return dataclasses.replace(tip_side(s), arm_touches=True)


def tip_swing(s):
    """The stretched arm is swung from the rear over the side."""
    side, beyond, takes, (mass, stated) = s.draw.sign("side"), s.draw("beyond", 1.03, 1.10), s.draw("takes", 2.0, 3.5), s.grappled(260, 320)
    begin, machine = side * 180, s.kind.build(mass)
    reach = reach_where(beyond, lambda r: abs(shares(s.kind, machine, s.reaching(r, side * 90))[1]))
    return Plan(14.0, lambda t: s.reaching(reach, begin + (side * 85 - begin) * smooth(t, 2.0, 2.0 + takes)), payload=mass, stated=stated, falls=True)


def tip_payload_350(s):
    """The machine file does not know the payload."""
    return tipping_reach(s, s.load(350.0), None)


def tip_payload_200(s):
    return tipping_reach(s, s.load(200.0), None)


def payload_unstated(s):
    """The arm works with a payload that the machine file does not know; no wheel lifts."""
    return Plan(16.0, s.working(wide=30), payload=s.load(s.draw("payload", 150, 350)), slope=s.level())


EVERYWHERE = [stand, arm_work, arm_work_slope, payload_in_band, tool_force, drive, drive_and_work, hard_brake, corner, slalom, side_slope, up_down, ramp_over, bump_one, bump_both,
              stop_and_go, reversing, soft_ground, lift_return, brake_lift, tip_side, tip_caught, tip_swing, tip_payload_350, tip_payload_200,
              payload_unstated]
FALLS = [lift_return, brake_lift, tip_side, tip_swing, tip_caught, tip_payload_350, tip_payload_200]
OF = {"rigid": EVERYWHERE, "heavy": EVERYWHERE, "bogie": [*EVERYWHERE, suspension], "soft": EVERYWHERE, "pivot": EVERYWHERE, "front_pivot": FALLS, "carrier": FALLS,
      "forwarder": [stand, arm_work, arm_work_slope, payload_in_band, drive, drive_and_work, up_down, ramp_over, bump_one, bump_both, stop_and_go, payload_unstated],
      "light": [stand, arm_work, arm_swing]}


# ---- simulation

def with_bodies(kind, plan):
    """An edit of the MJCF text: wheels of the right size, and a chassis that can lie on the ground."""
    z = 0.15 * kind.size

    def edit(xml):
        xml = kind.edit_mjcf(xml)
        radius, half_width = kind.wheel
        xml = xml.replace("size='0.35 0.12 0.35'", f"size='{radius} {half_width} {radius}'")
        contact = "contype='1' conaffinity='2' friction='0.6 0.01 0.005' condim='4' solref='0.02 1.0' solimp='0.9 0.95 0.001'"
        body = [f"<geom name='hull' type='box' size='{1.1 * kind.half_base} {0.7 * kind.half_track} {0.6 * z}' pos='0 0 {z}' {contact}/>",
                f"<geom name='cab' type='box' size='{0.4 * kind.half_base} {0.95 * kind.half_track} {0.65 * kind.size}' pos='{-0.4 * kind.half_base} 0 {0.65 * kind.size}' {contact}/>"]
        if plan.falls:
            begin = xml.index("<site name='imu'")
            end = xml.index("/>", begin) + 2
            xml = xml[:end] + "".join(body) + xml[end:]
        if plan.arm_touches:
            begin = xml.index("\n", xml.index("<body name='tool' ")) + 1
            xml = xml[:begin] + f"<geom name='touching' type='sphere' size='{0.2 * kind.size}' pos='{0.25 * kind.size} {-0.13 * kind.size} 0' {contact}/>\n" + xml[begin:]
        return xml
    return edit


def simulated(scenario, edit_mjcf, tyre, force):
    """The MuJoCo model and the rows of a scenario, with the edits that the laboratory's own run has no arguments for."""
    import model
    import simulate
    gains = dict(simulate.GAINS)
    simulate.mjcf = lambda *a, **k: edit_mjcf(model.mjcf(*a, **k, tyre=tyre))
    simulate.GAINS.update({name: (kp * force, kv * force) for name, (kp, kv) in gains.items()})
    try:
        mujoco_model, _, rows = simulate.run(scenario)
    finally:
        simulate.mjcf = model.mjcf
        simulate.GAINS.update(gains)
    return mujoco_model, rows


def tilts(rows, slope):
    """Angle between the platform and the ground [rad]."""
    from model import rx, ry
    up = (ry(slope[1]) @ rx(slope[0])) @ np.array([0, 0, 1.0])
    return np.array([math.acos(max(-1.0, min(1.0, float(up @ row["R"][:, 2])))) for row in rows])


def spans(t, is_zero):
    """Begin and end of the spans in which something holds for at least LIFT_S; the end is None if it holds at the last row."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], is_zero.astype(int), [0]))))
    out = []
    for begin, end in edges.reshape(-1, 2):
        last = t[end - 1] if end < len(t) else None
        if t[end - 1] - t[begin] >= LIFT_S:
            out.append([round(float(t[begin]), 4), None if last is None else round(float(last), 4)])
    return out


def facts(t, loads, tilt):
    """Lifts and the fall of a log: `loads` by wheel."""
    tips = np.flatnonzero(tilt >= TIP_RAD)
    until = tips[0] if len(tips) else len(t)    # what happens later is no lift of a standing machine
    lifts = {wheel: spans(t[:until], load[:until] <= 0.0) for wheel, load in loads.items()}
    onsets = [begin for found in lifts.values() for begin, _ in found]
    out = {"lifts": lifts, "first_lift_s": min(onsets, default=None), "lightest_n": {wheel: round(float(load[:until].min()), 1) for wheel, load in loads.items()},
           "tipping_s": None, "tilt_10deg_s": None, "on_side_s": None, "at_rest_s": None, "tilt_end_rad": round(float(tilt[-1]), 4)}
    if len(tips):
        out["tilt_10deg_s"] = round(float(t[tips[0]]), 4)
        # wheels that are in the air when the rotation has reached 10 degrees; the machine tips from the last of their lifts on
        last = {wheel: found[-1][0] for wheel, found in lifts.items() if found and found[-1][1] is None}
        out["tipping_s"] = max(last.values(), default=None)
        out["tipping_wheels"] = sorted(last)
        side = np.flatnonzero(tilt >= SIDE_RAD)
        if len(side):
            out["on_side_s"] = round(float(t[side[0]]), 4)
        moving = np.flatnonzero(np.abs(tilt - tilt[-1]) > math.radians(2))
        if len(moving) and t[moving[-1]] < t[-1] - 1:
            out["at_rest_s"] = round(float(t[moving[-1]]), 4)
    return out


def without_the_rest(rows, tilt):
    """Cuts a log some seconds after the machine has come to rest."""
    moving = np.flatnonzero(np.abs(tilt - tilt[-1]) > math.radians(2))
    if not len(moving) or tilt[-1] < TIP_RAD:
        return len(rows)
    return min(len(rows), int(moving[-1] + AFTER_FALL_S * 500))


def seed_of(name):
    return zlib.crc32(name.encode())


def reference(setting, plan):
    """A posture in which the machine stands on all wheels: that at the start, or with a pivoting axle, which may hang by one wheel then, the arm to the rear."""
    return setting.reaching(0, 180) if "pivot_axle" in setting.kind.free_joints else plan.arm(0.0)


def make(which, machine_name, manoeuvre, kind, out):
    import machine_file
    import model
    import polars
    import writelog
    from simulate import Scenario
    name = f"{machine_name}.{manoeuvre.__name__}"
    seed = seed_of(f"{which}/{name}")
    setting = Setting(kind, Draw(seed))
    plan = manoeuvre(setting)
    nominal, machine = kind.build(0.0), kind.build(plan.payload)
    scenario = Scenario(name, machine, plan.duration, plan.arm, plan.drive, slope=plan.slope, ground=plan.ground, wrench=plan.wrench,
                        noise=0.0, seed=seed % 2**31, clear=SETTLE_S, stop_roll=9.0)
    tyre = tuple(plan.softness * value for value in kind.tyre)
    mujoco_model, rows = simulated(scenario, with_bodies(kind, plan), tyre, kind.size * kind.mass)
    tilt = tilts(rows, plan.slope)
    if manoeuvre is not ramp_over and tilt[0] > TIP_RAD:
        raise CannotDo("it falls before the log begins")
    keep = without_the_rest(rows, tilt) if plan.falls else len(rows)
    rows, tilt = rows[:keep], tilt[:keep]

    out.mkdir(parents=True, exist_ok=True)
    radius, half_width = kind.wheel
    urdf = kind.edit_urdf(model.urdf(nominal)).replace("radius='0.35' length='0.24'", f"radius='{radius}' length='{2 * half_width}'")
    (out / "machine.urdf").write_text(urdf)
    text = kind.edit_toml(machine_file.machine_toml(nominal, "machine.urdf", bool(plan.wrench)))
    posture = ", ".join(f"{joint} = {value:.6f}" for joint, value in reference(setting, plan).items())
    text = text.replace("tyre_stiffness = 8.0e5", f"tyre_stiffness = {kind.tyre[0]}").replace("[limits]", f"[limits]\nreference_posture = {{ {posture} }}")
    if plan.stated:
        payload = next(link for link in machine.links if link.name == "payload")
        at = np.array(payload.pos) + np.array(payload.com)
        text += f'\n[[payload]]\nlink = "tool"\nmass = {plan.stated[0]:.6g}\nmass_sigma = {plan.stated[1]:.6g}\ncom = [{at[0]:.9g}, {at[1]:.9g}, {at[2]:.9g}]\n'
    (out / "machine.toml").write_text(text)

    types = typestore()
    logged = dataclasses.replace(scenario, machine=dataclasses.replace(machine, arm_joints=machine.arm_joints + list(kind.free_joints)))
    # the laboratory's log contains the true machine; a sound log of an unknown payload must not
    events = thinned(writelog.messages(logged, mujoco_model, rows, types), {"/robot_description": 0})
    write_mcap(events, types, out / "clean.mcap")
    t = np.array([row["t"] for row in rows])
    loads = {wheel: np.array([row[f"load_{wheel.lower()}"] for row in rows]) for wheel in machine.wheels}
    columns = {f"load_{wheel.lower()}": load.astype(np.float32) for wheel, load in loads.items()}
    polars.DataFrame({"t_ns": [stamp(x) for x in t], **columns, "tilt": tilt.astype(np.float32)}).write_parquet(out / "truth.parquet")
    truth = {"log": name, "set": which, "machine": machine_name, "manoeuvre": manoeuvre.__name__, "seed": seed, "duration_s": round(float(t[-1]), 3),
             "weight_n": round(float(sum(link.mass for link in machine.links)) * model.G, 1), "payload_kg": plan.payload, "stated_payload_kg": plan.stated and plan.stated[0],
             "load_is_stated": plan.payload == 0.0 or plan.stated is not None, "tyre_stiffness": tyre[0], "stated_tyre_stiffness": kind.tyre[0],
             "slope_rad": plan.slope, "ground": "ridges" if plan.ground else "plane", "falls": plan.falls, "parameters": setting.draw.values,
             # on a ramp the platform is tilted against the plane, and stands on its wheels
             **facts(t, loads, np.zeros_like(tilt) if manoeuvre is ramp_over else tilt)}
    (out / "truth.json").write_text(json.dumps(truth, indent=1))
    return truth


# ---- machines on other supports, which have a simulation of their own

def make_supports_log(which, name, out):
    """The crane or the forklift of `make_supports`, at another speed of its program; the forklift on another slope, and its axle with other stops."""
    import make_supports
    import polars
    draw = Draw(seed_of(f"{which}/{name}"))
    pace = draw("pace", 0.85, 1.1)
    simulate, degree, rows_kept = make_supports.simulate, make_supports.DEGREE, []

    def at_pace(xml, contacts, control, duration, sinking=None):
        rows = simulate(xml, contacts, lambda t: control(t * pace), duration / pace, sinking and (lambda t: sinking(t * pace)))
        rows_kept.extend(rows)
        return rows
    out.mkdir(parents=True, exist_ok=True)
    make_supports.simulate = at_pace
    if name == "forklift":
        make_supports.DEGREE = degree * draw("steeper", 0.95, 1.2)
    try:
        {"crane": make_supports.make_crane, "forklift": make_supports.make_forklift}[name](out)
    finally:
        make_supports.simulate, make_supports.DEGREE = simulate, degree
    (out / f"{name}_clean.mcap").rename(out / "clean.mcap")
    (out / f"{name}.mcap").unlink()
    (out / f"{name}.urdf").rename(out / "machine.urdf")
    (out / "machine.toml").write_text((out / f"{name}.toml").read_text().replace(f"{name}.urdf", "machine.urdf"))
    (out / f"{name}.toml").unlink()
    (out / f"{name}.truth.parquet").unlink()
    t = np.array([row["t"] for row in rows_kept])
    loads = {support: np.array([row["loads"][support] for row in rows_kept]) for support in rows_kept[0]["loads"]}
    tilt = np.array([math.acos(min(1.0, 1 - 2 * (row["quat"][1] ** 2 + row["quat"][2] ** 2))) for row in rows_kept])
    polars.DataFrame({"t_ns": [stamp(x) for x in t], **{f"load_{support.lower()}": load.astype(np.float32) for support, load in loads.items()},
                      "tilt": tilt.astype(np.float32)}).write_parquet(out / "truth.parquet")
    truth = {"log": name, "set": which, "machine": name, "manoeuvre": "program", "duration_s": round(float(t[-1]), 3), "payload_kg": 0.0, "stated_payload_kg": None,
             "load_is_stated": True, "ground": "sinks" if name == "crane" else "plane", "falls": name == "forklift", "parameters": draw.values, **facts(t, loads, tilt)}
    if name == "crane":    # wheels and feet are taken off the ground on purpose
        truth |= {"first_lift_s": None, "lifts": {}}
    (out / "truth.json").write_text(json.dumps(truth, indent=1))
    return truth


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation laboratory")
    parser.add_argument("out", type=Path, help="folder to write to")
    parser.add_argument("--set", help="only this set")
    parser.add_argument("--only", default="*", help="patterns of the logs to make, with commas, such as 'rigid.*'")
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.lab))
    machines = kinds()
    for which in [arguments.set] if arguments.set else SETS:
        for machine_name, all_of in OF.items():
            for manoeuvre in all_of:
                one(arguments, which, f"{machine_name}.{manoeuvre.__name__}", lambda out: make(which, machine_name, manoeuvre, machines[machine_name], out))
        for name in ("crane", "forklift"):
            one(arguments, which, name, lambda out: make_supports_log(which, name, out))


def one(arguments, which, name, making):
    out = arguments.out / which / name
    if not any(fnmatch.fnmatch(name, pattern) for pattern in arguments.only.split(",")) or (out / "truth.json").exists():
        return
    try:
        truth = making(out)
    except CannotDo as error:
        print(f"{which}/{name}: {error}", flush=True)
        return
    print(f"{which}/{name}: {truth['duration_s']:.1f} s, first lift {truth['first_lift_s']}, tipping {truth['tipping_s']}, on its side {truth['on_side_s']}, at rest {truth['at_rest_s']}, "
          f"lightest {min(truth['lightest_n'].values()):.0f} N", flush=True)


if __name__ == "__main__":
    main()
