"""What the monitor says in hours of sessions with sound sensors: how many rows of each level, and whether any is a Fault.

    .venv/bin/python sessions.py LAB LOGS TABLE.csv --program target/release/tipwatch-live --set NAME,NAME [--seeds FIRST:END]

LAB, LOGS and the sets are those of `matrix.py`. Every log in which the machine does not fall is one session for each seed of noise: `replay` sends it as
fast as the monitor reads it. TABLE.csv receives one row per session as soon as it has ended; what it has already is not run again.
"""
import argparse
import collections
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "data"))
sys.path.insert(0, str(HERE))
from variants import Log, noise    # noqa: E402

LEVELS = ("safe", "notice", "assumed", "warning", "danger", "unknown", "fault")
COLUMNS = ["set", "log", "seed", "seconds", "rows", *LEVELS, "doubted", "exit", "replay_exit", "error"]
LONGEST_S = 900     # of a session: what takes longer hangs


def session(program, folder, seed, clean):
    truth = clean.truth
    with tempfile.TemporaryDirectory(prefix="session-") as scratch:
        log = clean.copy()
        noise(log, seed)
        path = f"{scratch}/log.mcap"
        log.write(path)
        common = ["--machine", folder / "machine.toml", "--prefix", f"{Path(scratch).name}_"]
        monitor = [program, "monitor", *common, "--json", "--allow-untimed", "--state", f"{scratch}/state"]
        replay = [program, "replay", path, *common, "--speed", "max", "--lossless", "--wait", "60"]
        with started(monitor, f"{scratch}/monitor") as monitor, started(replay, f"{scratch}/replay") as replay:
            replayed = ended(replay, LONGEST_S)
            # without a session it would wait for one for ever
            monitored = ended(monitor, LONGEST_S if replayed == 0 else 10)
        out, said = [Path(f"{scratch}/monitor.{of}").read_text() for of in ("out", "err")]
        said += Path(f"{scratch}/replay.err").read_text()
    # the last line of a monitor that was stopped may be cut off
    rows = [json.loads(line) for line in out.splitlines(keepends=True) if line.endswith("\n")]
    levels = collections.Counter(row["verdict"] for row in rows)
    row = {"set": truth["set"], "log": truth["log"], "seed": seed, "seconds": round(truth["duration_s"], 2), "rows": len(rows), "exit": monitored, "replay_exit": replayed}
    row |= {level: levels[level] for level in LEVELS} | {"doubted": sum(row["basis"] == "doubted" for row in rows)}
    is_whole = rows and replayed == 0 and monitored is not None
    return row | {"error": "" if is_whole else (said.strip().splitlines() or ["no row"])[-1][:200]}


def started(arguments, output):
    """What it writes goes to files: nobody reads a pipe while another program is waited for."""
    with open(f"{output}.out", "w") as out, open(f"{output}.err", "w") as err:
        return subprocess.Popen(list(map(str, arguments)), stdout=out, stderr=err)


def ended(program, longest_s):
    """Its exit code; None if it had to be stopped."""
    try:
        return program.wait(longest_s)
    except subprocess.TimeoutExpired:
        program.kill()
        program.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path)
    parser.add_argument("logs", type=Path)
    parser.add_argument("table", type=Path)
    parser.add_argument("--program", type=Path, required=True)
    parser.add_argument("--set", required=True)
    parser.add_argument("--seeds", default="1:4")
    arguments = parser.parse_args()
    sys.path.insert(0, str(arguments.lab))
    first, end = map(int, arguments.seeds.split(":"))
    done, is_new = set(), not arguments.table.exists() or not arguments.table.stat().st_size
    if not is_new:
        with open(arguments.table) as file:
            known = csv.DictReader(file)
            if known.fieldnames != COLUMNS:
                sys.exit(f"expected the columns {','.join(COLUMNS)} in {arguments.table}, found {','.join(known.fieldnames)}")
            done = {(row["set"], row["log"], int(row["seed"])) for row in known}
    with open(arguments.table, "a", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS)
        if is_new:
            writer.writeheader()
        for folder in sorted(path for name in arguments.set.split(",") for path in (arguments.logs / name).iterdir()):
            truth = folder / "truth.json"
            if not truth.exists() or json.loads(truth.read_text())["tilt_10deg_s"]:
                continue    # falls
            clean = Log(folder)
            for seed in range(first, end):
                if (clean.truth["set"], clean.truth["log"], seed) not in done:
                    writer.writerow(session(arguments.program, folder, seed, clean))
                    file.flush()
    with open(arguments.table) as file:
        rows = list(csv.DictReader(file))
    total = {name: sum(int(row[name]) for row in rows) for name in ("rows", *LEVELS, "doubted")}
    hours = sum(float(row["seconds"]) for row in rows) / 3600
    print(f"{len(rows)} sessions, {hours:.2f} h, {total}; sessions with a Fault: {sum(int(row['fault']) > 0 for row in rows)}, "
          f"without rows: {sum(int(row['rows']) == 0 for row in rows)}")


if __name__ == "__main__":
    main()
