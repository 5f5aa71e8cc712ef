"""Records of a fleet that exists in numbers only: `records.py PLACE COUNT PATTERN.json`.

PATTERN is the record of a real log, `state/*.json` of a screen; copies of it with other paths, machines, days and margins go into
PLACE/state. `tipwatch screen --gather --out PLACE` then builds data set and page, without a log.
"""

import copy
import hashlib
import json
import random
import sys
from pathlib import Path

DAY_NS = 86_400_000_000_000


def main():
    place, count, pattern = Path(sys.argv[1]), int(sys.argv[2]), json.loads(Path(sys.argv[3]).read_text())
    (place / "state").mkdir(parents=True, exist_ok=True)
    chance = random.Random(7)
    machines = max(1, count // 1000)
    for number in range(count):
        record = copy.deepcopy(pattern)
        machine, turn = number % machines, number // machines
        record["path"] = f"/fleet/fw-{machine:04}/2026/{turn:05}/shift_{number:06}.mcap"
        record["log_id"] = hashlib.sha256(str(number).encode()).hexdigest()
        record["machine"]["name"] = f"{machine:04}"
        facts, lifts = record["result"]["facts"], chance.random() < 0.02
        facts["start_ns"] = 20_454 * DAY_NS + turn % 365 * DAY_NS + chance.randrange(DAY_NS)
        margin = -abs(chance.gauss(0, 0.05)) if lifts else min(0.95, max(0.01, chance.gauss(0.55, 0.12)))
        facts["worst"].update(margin=margin, sigma=0.01 + 0.01 * chance.random())
        facts["margin_any_split"] = max(0.0, margin - 0.3 * chance.random())
        facts["exposure"]["exposed_s"] = facts["coverage"]["computable_s"] * chance.random()
        if moment := facts["worst"].get("moment"):
            moment.update(speed_m_s=3 * chance.random(), tilt_rad=0.2 * chance.random())
        facts["event_counts"].update(wheel_lift=int(lifts), wheel_light=int(margin < 0.1))
        record["result"]["has_report"] = False
        name = f"{record['log_id'][:16]}-{record['analysis_version']}-{number:016x}.json"
        (place / "state" / name).write_text(json.dumps(record))


if __name__ == "__main__":
    main()
