"""python save_model.py LAB OUT: the lab's `rigid` machine for the C++ peer, and Python's own figures.

Writes OUT/rigid.txt (Boost text archive of the Pinocchio model: free-flyer and every joint, cylinders and rods included) and
OUT/rigid_state.txt (one random state q, v, a and tau = rnea(q, v, a) from Python, to check the C++ program). Prints one line of JSON: ns per pin.rnea call in a loop.
"""
import json, sys, tempfile, time
sys.path.insert(0, sys.argv[1])
import numpy as np, pinocchio as pin
import model, oracle

out = sys.argv[2]
m = oracle.build(model.rigid(yaw0=0.0), tempfile.mkstemp(suffix=".urdf")[1])
m.saveToText(f"{out}/rigid.txt")
rng = np.random.default_rng(1)
states = [(pin.normalize(m, rng.uniform(-1, 1, m.nq)), rng.uniform(-1, 1, m.nv), rng.uniform(-1, 1, m.nv)) for _ in range(1024)]
d = m.createData()
q, v, a = states[0]
with open(f"{out}/rigid_state.txt", "w") as f:
    for x in (q, v, a, pin.rnea(m, d, q, v, a).copy()):
        f.write(f"{len(x)} " + " ".join(repr(float(y)) for y in x) + "\n")
ns = []
for _ in range(50):
    t = time.perf_counter_ns()
    for q, v, a in states:
        pin.rnea(m, d, q, v, a)
    ns.append((time.perf_counter_ns() - t) / len(states))
print(json.dumps(dict(peer="pinocchio python", version=pin.__version__, machine="rigid", joints=m.njoints - 1, nv=m.nv, states=len(states), repeats=len(ns), ns_min=round(min(ns), 1), ns_median=round(float(np.median(ns)), 1))))
