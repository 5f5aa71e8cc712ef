"""How often a fleet in which nothing changed raises an alarm, and how often a machine that falls is found:
`fleets.py TIPWATCH PATTERN.json [FLEETS [SEED]]`.

PATTERN is the record of a real log with a lift, `state/*.json` of a screen; a fleet is copies of it with other machines, days and margins,
which `tipwatch screen --gather` compares. Fleets without a change: normal margins; skewed ones with days without work, as machines have
them; days that resemble their neighbours (first order); wheels that lift on one day in five. A machine that falls goes from 50 to 5 % for
its last five days. SEED chooses other fleets.
"""

import collections
import copy
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

DAY_NS = 86_400_000_000_000
program, pattern = sys.argv[1], json.loads(Path(sys.argv[2]).read_text())
fleets = int(sys.argv[3]) if len(sys.argv) > 3 else 200
first = int(sys.argv[4]) if len(sys.argv) > 4 else 0
lift = next(event for event in pattern["result"]["events"] if event["kind"] == "wheel_lift")


def outliers(logs):
    """What the page of these logs tells: machine, day, margin, shares of the time below the notice level and lifted, seconds."""
    with tempfile.TemporaryDirectory() as place:
        state = Path(place, "state")
        state.mkdir()
        for number, (machine, day, margin, exposed, lifted, duration_s) in enumerate(logs):
            record = copy.deepcopy(pattern)
            record.update(path=f"/logs/{number:06}.mcap", log_id=f"{number:064x}")
            record["machine"]["name"] = f"fw-{machine:03}"
            facts = record["result"]["facts"]
            facts["start_ns"] = (20_000 + day) * DAY_NS
            facts["worst"].update(margin=margin, sigma=0.01)
            facts["exposure"]["exposed_s"] = exposed * duration_s
            record["result"]["events"] = [{**lift, "duration_s": lifted * duration_s}] if lifted else []
            facts["coverage"].update(covered_s=duration_s, computable_s=duration_s, valid_share=1.0)
            (state / f"{number:06}-x-y.json").write_text(json.dumps(record))
        subprocess.run([program, "screen", "--gather", "--out", place, "-q"], check=True)
        sql = "SELECT * FROM comparisons WHERE verdict = 'outlier'"
        return json.loads(subprocess.check_output([program, "query", place, sql, "--json"]))


def usual(kind, machines, days, chance):
    logs = []
    for machine in range(machines):
        own, state = chance.gauss(0, 0.03), chance.gauss(0, 1)
        for day in range(days):
            if kind == "normal":
                logs.append((machine, day, 0.5 + own + chance.gauss(0, 0.03), max(0.0, chance.gauss(0.02, 0.002)), 0.0, 600))
            elif kind == "lifts":
                lifted = chance.uniform(0.002, 0.05) if chance.random() < 0.2 else 0.0
                logs.append((machine, day, 0.5 + chance.gauss(0, 0.03), 0.1, lifted, 600))
            elif kind != "skewed":
                state = kind * state + (1 - kind**2) ** 0.5 * chance.gauss(0, 1)
                logs.append((machine, day, 0.5 + own + 0.06 * state, 0.02, 0.0, 600))
            elif chance.random() > 0.3:
                margin = 0.5 + own + 0.05 * chance.random() - min(0.6, chance.expovariate(1 / 0.07))
                exposed = 0.0 if chance.random() < 0.7 else min(0.5, chance.expovariate(20))
                logs.append((machine, day, margin, exposed, 0.0, 600 * chance.uniform(0.7, 1.3)))
    return logs


def fallen(machines, days, at, chance):
    level = lambda machine, day: 0.05 if machine == 2 and day >= at else 0.5
    return [(m, d, level(m, d) + chance.gauss(0, 0.02), 0.02, 0.0, 600) for m in range(machines) for d in range(days)]


unchanged = [("normal", 20, 24), ("skewed", 20, 40), ("skewed", 5, 60), ("lifts", 20, 40)]
for kind, machines, days in [*unchanged, *[(0.5, 20, 40), (0.7, 20, 40), (0.7, 5, 60), (0.7, 100, 18)]]:
    fleet = lambda seed: usual(kind, machines, days, random.Random(31 * (first + seed) + machines))
    found = [outliers(fleet(seed)) for seed in range(fleets)]
    kinds = collections.Counter((c["compared_with"], c["quantity"]) for told in found for c in told)
    print(f"no change, {kind}, {machines} machines, {days} days: "
          f"{sum(map(bool, found))} of {fleets} fleets with an alarm {dict(kinds)}", flush=True)
for machines, days in [(5, 18), (20, 18), (100, 18), (5, 60), (20, 60), (100, 60)]:
    runs = 5 if machines == 100 else 10
    found = [outliers(fallen(machines, days, days - 5, random.Random(900 + first + seed))) for seed in range(runs)]
    is_it = lambda c: c["machine"] == "fw-002" and c["compared_with"] == "history"
    print(f"one fell, {machines} machines, {days} days: found {sum(any(map(is_it, told)) for told in found)} of {runs}, "
          f"others {sum(any(c['machine'] != 'fw-002' for c in told) for told in found)}", flush=True)
