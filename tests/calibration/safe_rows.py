"""What the monitor says of rows in which a wheel is off the ground, and of rows in which none is near it, with sound and with wrong sensors.

    .venv/bin/python safe_rows.py LAB LOGS TABLE.csv --program PATH [--drive DRIVE] [--uncommissioned] [--set held] [--only PATTERNS] [--variants PATTERNS]
        [--page PAGE.md]

LAB, LOGS and the variants are those of `matrix.py`. Each variant is analysed with the causal estimator, whose verdicts are those of the live monitor
bit for bit, under a machine file that is bound to a commissioning: of the same machine, with sound sensors, by DRIVE.mcap with DRIVE.toml and DRIVE.urdf,
which is that of the fixture `commissioning_wide` if none is stated: it has moved all joints where these logs work. It states plane ground and wheels whose heights are measured to a millimetre, without which no rigid machine is Safe. Only logs of that machine
are analysed. What is wrong in a variant has become wrong after the commissioning. With `--uncommissioned` the same machine file is not bound to
one: what is proven then, the session has proven. TABLE.csv receives one row per log and variant; what it has already is not run again. `--page` writes the summary between the marks of a
page of the book.
"""
import argparse
import csv
import fnmatch
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "data"))
sys.path.insert(0, str(HERE))
from matrix import family, groups, share, table, tips_at, true_loads, variants_of    # noqa: E402
from variants import Log    # noqa: E402

BEGIN, END = "<!-- begin: safe rows -->", "<!-- end: safe rows -->"
FIXTURE = HERE.parent / "data" / "commissioning_wide"
SETTLED_S = 2.0             # rows before it are Unknown by design
OFF_GROUND_S = 0.1          # a lifted row lies so far within a true lift: what a filter lags is not the question here
# A row is truly safe if by the true loads U = 1 - load / static load of every wheel is below the limit `warning`, and was for as long as a level is held,
# and will be for the horizon of the prediction: all by the defaults of the machine file. Of these, calm is what is below `notice` for as long.
LIMITS = {"clear": 0.9, "calm": 0.75}
HELD_S, HORIZON_S = 1.0, 2.0
LEVELS = ("safe", "notice", "assumed", "warning", "danger", "unknown", "fault")
COLUMNS = ["set", "log", "variant", "sound", "wrong_from_s", "commissioned", "exit", *(f"{of}_{what}" for of in ("lifted", *LIMITS)
           for what in ("rows", *LEVELS, "trusted")), "error"]


def machine_file(program, folder, drive, is_commissioned):
    """Writes the machine into this folder and commissions it if it is to be; returns its file."""
    for kind in ("mcap", "urdf"):
        (folder / f"{drive.name}.{kind}").write_bytes(drive.with_suffix(f".{kind}").read_bytes())
    stated = '[uncertainty]\nwheel_position = 0.001\nwheel_radius = 0.001\n\n[contact]\nground = "plane"\n'
    text = drive.with_suffix(".toml").read_text()
    assert "[uncertainty]" not in text and "[contact]\n" in text
    text = text.replace("[contact]\n", stated)
    if not is_commissioned:
        (folder / "machine.toml").write_text(text)
        return folder / "machine.toml"
    (folder / "machine.toml").write_text('commissioning = "commissioning.json"\n' + text)
    command = [str(program), "check-machine", "machine.toml", "--log", f"{drive.name}.mcap", "--commissioning", "commissioning.json"]
    subprocess.run(command, cwd=folder, capture_output=True, check=True)
    return folder / "machine.toml"


def judged(folder, variant, program, machine, is_commissioned):
    import polars
    import writelog
    log = Log(folder)
    truth = log.truth
    row = dict.fromkeys(COLUMNS, "") | {"set": truth["set"], "log": truth["log"], "variant": variant.name, "sound": int(variant.is_sound),
                                        "wrong_from_s": variant.wrong_from, "commissioned": int(is_commissioned)}
    with tempfile.TemporaryDirectory(dir=machine.parent) as out:
        out = Path(out)
        variant.apply(log).write(out / "log.mcap")
        command = [program, "analyze", out / "log.mcap", "--machine", machine, "--out", out / "out", "--quiet", "--estimator", "causal"]
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True)
        row |= {"exit": done.returncode, "error": done.stderr.strip().splitlines()[-1][:200] if done.stderr.strip() else ""}
        if not (out / "out" / "samples.parquet").exists():
            return row
        samples = polars.read_parquet(out / "out" / "samples.parquet", columns=["time_ns", "verdict", "verdict_basis"])
        static = {wheel: of["static_load_n"] for wheel, of in json.loads((out / "out" / "summary.json").read_text())["wheels"].items()}
    t = (samples["time_ns"].to_numpy() - writelog.T0) * 1e-9
    begins = t[0] + SETTLED_S
    tips = tips_at(folder)
    lifted = np.zeros(len(t), bool)
    for spans in truth["lifts"].values():
        for onset, end in spans:
            lifted |= (t > onset + OFF_GROUND_S) & (t < (math.inf if end is None else end - OFF_GROUND_S))
    times, _, raw = true_loads(str(folder))
    used = np.max([1.0 - load / static[wheel.removeprefix("load_").lower()] for wheel, load in raw.items()], axis=0)
    from_to = np.searchsorted(times, t - HELD_S), np.searchsorted(times, t + HORIZON_S, "right")
    largest = np.array([used[first:last].max(initial=-math.inf) for first, last in zip(*from_to)])
    is_known = (t > begins) & (t + HORIZON_S <= min(times[-1], tips))
    parts = {"lifted": lifted & (t >= variant.wrong_from) & (t < tips + 1.0)} | {of: is_known & (largest < limit) for of, limit in LIMITS.items()}
    level, basis = samples["verdict"].to_numpy(), samples["verdict_basis"].to_numpy()
    for of, which in parts.items():
        row[f"{of}_rows"] = int(which.sum())
        row |= {f"{of}_{name}": int((which & (level == name)).sum()) for name in LEVELS}
        row[f"{of}_trusted"] = int((which & np.isin(level, ["safe", "notice"]) & (basis == "proven")).sum())
    return row


def run(arguments):
    done = set()
    if arguments.table.exists():
        with open(arguments.table) as file:
            done = {(row["set"], row["log"], row["variant"]) for row in csv.DictReader(file) if row["commissioned"] == str(int(not arguments.uncommissioned))}
    is_new = not arguments.table.exists()
    with open(arguments.table, "a", newline="") as file, tempfile.TemporaryDirectory(prefix="safe-rows-") as scratch:
        writer = csv.DictWriter(file, COLUMNS)
        if is_new:
            writer.writeheader()
        machine = machine_file(arguments.program.resolve(), Path(scratch), arguments.drive, not arguments.uncommissioned)
        fits = lambda name, patterns: any(fnmatch.fnmatch(name, pattern) for pattern in patterns.split(","))
        for folder in sorted((arguments.logs / arguments.set).iterdir()):
            if not (folder / "truth.json").exists() or not fits(folder.name, arguments.only):
                continue
            if (folder / "machine.urdf").read_bytes() != arguments.drive.with_suffix(".urdf").read_bytes():
                continue    # another machine
            has_lifts = any(json.loads((folder / "truth.json").read_text())["lifts"].values())
            for variant in variants_of(str(folder)).values():
                if not variant.is_sound and not has_lifts:
                    continue    # a wrong sensor is asked about lifted rows only
                if fits(variant.name, arguments.variants) and (arguments.set, folder.name, variant.name) not in done:
                    writer.writerow(judged(folder, variant, arguments.program, machine, not arguments.uncommissioned))
                    file.flush()


def total(rows, name):
    return sum(int(row[name] or 0) for row in rows)


def summary(rows, which):
    logs = len({row["log"] for row in rows})
    text = f"Made by `tests/calibration/safe_rows.py` from {len(rows)} analyses of {logs} logs of the set `{which}`.\n"
    of_commissioned, of_others = ([row for row in rows if row["commissioned"] == is_it] for is_it in "10")
    sound, lines = [row for row in of_commissioned if row["sound"] == "1"], []
    for name, part in [("all", sound), *sorted(groups(sound, lambda row: row["log"]).items())]:
        if of := total(part, "clear_rows"):
            calm = share(total(part, "calm_safe"), total(part, "calm_rows"))
            lines.append([name, of, share(total(part, "clear_trusted"), of), calm, *(total(part, f"clear_{level}") for level in LEVELS)])
    text += "\n" + table(["sound sensors, commissioned", "truly safe rows", "Safe or Notice, and proven", "calm rows that are Safe",
                          *(level.title() for level in LEVELS)], lines)
    for title, part in (("wrong since the commissioning", of_commissioned), ("wrong, and never commissioned", of_others)):
        wrong = [row for row in part if row["sound"] == "0"]
        if not wrong:
            continue
        families = sorted(groups(wrong, lambda row: family(row["variant"])).items(), key=lambda item: -total(item[1], "lifted_trusted"))
        shown = [(name.replace("-", " ", 1), rows) for name, rows in families if total(rows, "lifted_trusted")]
        lines = [[name, len(rows), total(rows, "lifted_rows"), total(rows, "lifted_trusted"), *(total(rows, f"lifted_{level}") for level in LEVELS)]
                 for name, rows in [("all", wrong), *shown]]
        text += "\n" + table([title, "logs", "lifted rows", "Safe or Notice, and proven", *(level.title() for level in LEVELS)], lines)
        text += f"\n{len(families) - len(shown)} of {len(families)} kinds have no such row.\n"
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation laboratory")
    parser.add_argument("logs", type=Path, help="folder that manoeuvres.py wrote")
    parser.add_argument("table", type=Path, help="table to write, one row per log and variant")
    parser.add_argument("--program", type=Path, required=True, help="the program to run")
    parser.add_argument("--drive", type=Path, default=FIXTURE, help="drive of the commissioning, without its extension")
    parser.add_argument("--uncommissioned", action="store_true", help="do not bind a commissioning")
    parser.add_argument("--set", default="held", help="folder of LOGS")
    parser.add_argument("--only", default="*", help="patterns of logs, with commas")
    parser.add_argument("--variants", default="*", help="patterns of variants, with commas")
    parser.add_argument("--page", type=Path, help="page of the book")
    arguments = parser.parse_args()
    os.environ.setdefault("POLARS_MAX_THREADS", "1")
    sys.path.insert(0, str(arguments.lab))
    run(arguments)
    with open(arguments.table) as file:
        rows = [row for row in csv.DictReader(file) if row["set"] == arguments.set]
    text = summary(rows, arguments.set)
    print(text)
    if arguments.page:
        before, rest = arguments.page.read_text().split(BEGIN)
        arguments.page.write_text(f"{before}{BEGIN}\n\n{text}\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
