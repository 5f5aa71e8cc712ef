"""Makes a fleet's logs to screen: `python make_logs.py LAB OUT [COUNT]`.

LAB is the folder of the simulation lab (its README tells what to install). Each of eight manoeuvres, on slopes and
with reaches drawn from a seed, is simulated once; its log is then written over and over with the noise of another
seed, on another day, by one of four machines of the same build. OUT gets `logs/<machine>/<day>_<number>.mcap`,
a machine file for each machine, `fleet.toml`, and the lab's own machine for the Python baseline (`machine.pickle`).
The same seeds give the same bytes.
"""
import dataclasses
import math
import pickle
import sys
from pathlib import Path

lab, out, count = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 200
sys.path.insert(0, str(lab))
import numpy as np
import scenarios
import simulate
import writelog
from machine_file import machine_toml
from model import rigid, urdf

MACHINES = ["fw-01", "fw-02", "fw-03", "fw-04"]
MANOEUVRES = 8
DAY_NS = 86_400_000_000_000
FIRST_NS = 1_780_272_000_000_000_000          # 2026-06-01 00:00 UTC
D = math.pi / 180


def manoeuvre(seed):
    """An arm that works (even seeds) or a drive with a brake (odd ones), on a slope, with a reach of the seed's."""
    rng = np.random.default_rng(1000 + seed)
    base = scenarios.flat_arm() if seed % 2 == 0 else scenarios.drive_brake()
    reach, turn, roll, pitch = rng.uniform(0.0, 1.0), rng.uniform(0.5, 1.5), rng.uniform(-7, 7) * D, rng.uniform(-4, 4) * D
    if seed % 2:
        def drive(t):
            v, brake = 1.4 + 0.8 * reach, 3.0 - 1.6 * turn / 1.5
            smooth = scenarios.smooth
            return v * (smooth(t, 1, 5) - smooth(t, 14, 14 + brake)), 0.3 * turn * (smooth(t, 6, 7.5) - smooth(t, 10, 11.5))
        return dataclasses.replace(base, name="m", slope=(0.2 * roll, 0.0), drive=drive)

    def arm(t):
        s = scenarios.smooth(t, 0, 3)
        return scenarios.pose(45 - 20 * s * reach + 6 * s * math.sin(0.8 * t), -85 + 30 * s * reach + 9 * s * math.sin(1.1 * t),
                              0.2 + 0.25 * s * reach, 60 * turn * s * math.sin(0.35 * t))
    return dataclasses.replace(base, name="m", arm=arm, slope=(roll, pitch), duration=30, drive=lambda t: (0.0, 0.0))


def main():
    machine = rigid(yaw0=0.0)
    for folder in MACHINES:
        (out / "logs" / folder).mkdir(parents=True, exist_ok=True)
    (out / "forwarder.urdf").write_text(urdf(machine))
    for name in MACHINES:
        (out / f"{name}.toml").write_text(machine_toml(dataclasses.replace(machine, name=name), "forwarder.urdf"))
    rules = [f'[[machine]]\nfile = "{name}.toml"\npath = "**/{name}/*"\n' for name in MACHINES]
    (out / "fleet.toml").write_text("\n".join(rules))
    (out / "machine.pickle").write_bytes(pickle.dumps(machine))
    for seed in range(MANOEUVRES):
        scenario = manoeuvre(seed)
        model, _, rows = simulate.run(scenario)
        print(f"manoeuvre {seed}: {rows[-1]['t']:.1f} s", flush=True)
        for number in range(seed, count, MANOEUVRES):
            turn = number // MANOEUVRES
            name, day = MACHINES[(turn + number) % 4], (turn + number % 3) % 28
            folder = out / "logs" / name
            writelog.T0 = FIRST_NS + day * DAY_NS + (6 + number % 11) * 3_600_000_000_000
            noisy = dataclasses.replace(scenario, seed=5000 + number, name="writing")
            writelog.write(noisy, model, rows, folder)
            (folder / "writing.mcap").rename(folder / f"{1 + day:02d}_{number:03d}.mcap")
        for leftover in (out / "logs").glob("*/writing.*"):
            leftover.unlink()


main()
