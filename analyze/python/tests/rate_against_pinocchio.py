"""Rate of ``Machine.evaluate`` against a loop over Pinocchio's ``rnea``: prints the ratio; needs ``pin`` and a quiet machine.

    PYTHONPATH=... python analyze/python/tests/rate_against_pinocchio.py [ROWS [MACHINE URDF]]

Against the batch in Rust (``cargo bench -p tipwatch-mechanics``, line "loads, from columns to columns", one thread): the
machine of that benchmark, ``mechanics/tests/data/rigid.toml`` and ``.urdf``, with ``RAYON_NUM_THREADS=1``.
"""

import sys
import time
from pathlib import Path

import numpy as np
import pinocchio

import tipwatch as tw

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"
# rows of the loop: its time is proportional to them
LOOP_ROWS = 100_000
REPEATS = 5


def main():
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    machine = tw.Machine(*sys.argv[2:4]) if len(sys.argv) > 2 else tw.Machine(DATA / "forwarder6.toml")
    # the base moves, as it does in the equations of the wheel loads
    model = pinocchio.buildModelFromXML(machine.urdf, pinocchio.JointModelFreeFlyer())
    data = model.createData()
    generator = np.random.default_rng(1)
    configurations = np.tile(pinocchio.neutral(model), (LOOP_ROWS, 1))
    velocities, accelerations = generator.normal(size=(2, LOOP_ROWS, model.nv))
    # around zero: linkages can close there
    scatter = generator.normal(0.0, 0.2, size=(3, rows, len(machine.joints)))
    positions, rates, joint_accelerations = scatter[0] + machine.zero_posture, scatter[1], scatter[2]
    loop, batch = [], []
    for _ in range(REPEATS):  # interleaved: both see the same load of the machine
        loop.append(seconds(lambda: [
            pinocchio.rnea(model, data, q, v, a) for q, v, a in zip(configurations, velocities, accelerations)
        ]) / LOOP_ROWS)
        batch.append(seconds(lambda: machine.evaluate(positions, rates, joint_accelerations)) / rows)
    print(f"loop over rnea {min(loop) * 1e6:.2f} us a row, evaluate {min(batch) * 1e6:.3f} us a row")
    print(f"ratio {min(loop) / min(batch):.1f} (median {np.median(loop) / np.median(batch):.1f})")


def seconds(call):
    started = time.perf_counter()
    call()
    return time.perf_counter() - started


if __name__ == "__main__":
    main()
