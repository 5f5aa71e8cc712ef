"""Write what the matrix found into a page of the book: doubts of sound sensors, onsets, alarms, bands, unstated loads, and wrong sensors.

    .venv/bin/python doubts_table.py LOGS TABLE.csv PAGE.md [--set held]

TABLE.csv is what `matrix.py` wrote, LOGS what `manoeuvres.py` wrote. What stands between the marks `<!-- begin: doubts -->` and `<!-- end: doubts -->` of the
page is replaced.
"""
import argparse
import csv
import json
import math
from pathlib import Path

import numpy as np

from matrix import (ESTIMATORS, dated, family, groups, is_found, kind_of, lift_onsets, lost_to_doubt, number, share, standing_doubts, table, tipping_onsets,
                    tips_at)

BEGIN, END = "<!-- begin: doubts -->", "<!-- end: doubts -->"
UNEVEN = ("bump_one", "bump_both", "ramp_over")
LATE_S = 0.35      # Danger later than this after a lift is late
SETTLING_S = 0.3   # rows of the causal estimator before it are Unknown


def by_estimator(rows, cell):
    return [cell([row for row in rows if row["estimator"] == estimator]) for estimator in ESTIMATORS]


def both(rows, cell):
    return " / ".join(str(found) for found in by_estimator(rows, cell))


def total(rows, name):
    return sum(int(row[name] or 0) for row in rows)


def percent(part, whole):
    return f"{100 * part / whole:.1f} % of {whole}"


def with_all(rows, key):
    return [("all", rows), *sorted(groups(rows, key).items())]


# ---- sound sensors

def doubts(rows):
    lines = []
    for kind, part in with_all(rows, kind_of):
        lines.append([kind, len(part) // len(ESTIMATORS), both(part, lambda of: sum(bool(standing_doubts(row)) for row in of)),
                      both(part, lambda of: sum(map(lost_to_doubt, of))), total(part, "false_danger"), total(part, "false_warning"), total(part, "alarms_asked")])
    head = ["variant", "logs", "logs with a doubt", "rows lost to doubt", "false Danger, rows", "false Warning, rows", "rows of the causal estimator"]
    return table(head, lines)


def spread(pairs):
    z = np.array([error / sigma for error, sigma in pairs if sigma])
    if not len(z):
        return ["–"] * 4
    near = sum(abs(error) <= max(0.1, 2 * (sigma or 0)) for error, sigma in pairs)
    return [f"{math.sqrt(np.mean(z**2)):.2f}", f"{np.median([sigma for _, sigma in pairs if sigma]):.2f}",
            f"{np.quantile([abs(error) for error, _ in pairs], 0.95):.2f}", share(near, len(pairs))]


def onsets(rows, of):
    """`of` is lift_onsets or tipping_onsets."""
    lines = []
    for estimator in ESTIMATORS:
        for machine, part in with_all([row for row in rows if row["estimator"] == estimator], lambda row: row["machine"]):
            found = of(part)
            if of is lift_onsets:
                counts = [total(part, "true_lifts"), total(part, "missed_lifts"), total(part, "false_lifts")]
            else:
                over = [row for row in part if row["true_tip_over"] == "1"]
                counts = [len(over), sum(row["found_tip_over"] != "1" for row in over), sum(row["true_tip_over"] != "1" and row["found_tip_over"] == "1" for row in part)]
            if not counts[0]:
                continue
            bounds = [(error, sigma) for error, sigma, bound in found if bound == "at_or_before"]
            held = share(sum(error >= -2 * (sigma or 0) for error, sigma in bounds), len(bounds))
            lines.append([f"{machine}, {estimator}", *counts, len(dated(found)), *spread(dated(found)), held])
    what = "lifts" if of is lift_onsets else "tip-overs"
    return table([what, "true", "missed", "false", "dated", "error / sigma, root mean square", "sigma [s], median", "error [s], 95 %", "within 0.1 s or two sigma", "\"or earlier\", and true"], lines)


def alarms(rows):
    lines = []
    rows = [row for row in rows if row["estimator"] == "causal" and row["danger_share"]]
    is_of = {"stated load": lambda row: row["load_is_stated"] == "1" and row["manoeuvre"] not in UNEVEN, "unstated load on the tool": lambda row: row["load_is_stated"] == "0",
             "ridges": lambda row: row["manoeuvre"] in UNEVEN}
    for name, part in ((name, list(filter(of, rows))) for name, of in is_of.items()):
        late = [number(row["danger_s"]) - max(number(row["true_first_lift_s"]), number(row["begins_s"]) + SETTLING_S) for row in part if row["danger_s"]]
        if part:
            lines.append([name, len(part), share(sum(s <= LATE_S for s in late), len(part)), len(part) - len(late), *([f"{np.median(late):.2f}", f"{max(late):.2f}"] if late else ["–"] * 2),
                          f"{np.median([number(row['danger_share']) for row in part]):.2f}"])
    head = ["logs with a lifted wheel", "logs", f"Danger within {LATE_S} s of the first lift", "never", "delay [s], median", "largest", "share of Danger in rows with a wheel in the air, median"]
    return table(head, lines)


def bands(rows):
    lines = []
    for name, is_in in (("plane ground", False), ("ridges and ramps", True)):
        part = [row for row in rows if (row["manoeuvre"] in UNEVEN) == is_in and row["loads_compared"]]
        if not part:
            continue
        within = lambda of: percent(total(of, "loads_in_band"), total(of, "loads_compared"))
        rms = lambda of: f"{np.median([number(row['load_z_rms']) for row in of]):.2f}"
        off = lambda of: f"{np.median([number(row['load_rms_percent']) for row in of]):.2f} %"
        lines.append([name, len(part) // len(ESTIMATORS), *by_estimator(part, within), both(part, rms), both(part, off)])
    head = ["ground", "logs", "loads within two sigma, smoother", "causal", "error / sigma, median log", "error as a share of the mean load, median log"]
    return table(head, lines)


def explanations(rows):
    """What explains a fall: the machine as stated where all is stated, else the load on the tool, and how heavy it is."""
    lines = []
    for name, kind, is_stated in (("stated load", "stated_machine", "1"), ("unstated load on the tool", "load_on_tool", "0")):
        for estimator in ESTIMATORS:
            part = [row for row in rows if row["load_is_stated"] == is_stated and row["true_tip_over"] == "1" and row["estimator"] == estimator and row["explained_by"]]
            if not part:
                continue
            off = [(number(row["found_load_kg"]) - number(row["true_load_kg"] or 0), number(row["found_load_sigma_kg"]), number(row["true_load_kg"])) for row in part if row["found_load_kg"]]
            of_true = [(abs(error) / true, sigma / true) for error, sigma, true in off if true]
            lines.append([f"{name}, {estimator}", len(part), sum(row["explained_by"] == kind for row in part), len(off), sum(abs(error) <= 2 * sigma for error, sigma, _ in off),
                          *([sum(share <= 0.15 for share, _ in of_true), f"{100 * max(share for share, _ in of_true):.0f} %", f"{100 * np.median([sigma for _, sigma in of_true]):.0f} %"]
                            if of_true else ["–"] * 3)])
    return table(["falls", "explained", "most probable: what is true", "load estimated", "within two sigma", "within 15 %", "largest error", "sigma, median"], lines)


# ---- wrong sensors

def wrong_ones(rows):
    found = lambda of: f"{sum(is_found(row) for row in of)} of {len(of)}"
    delay = lambda of: f"{np.median([float(row['delay_s']) for row in of if row['delay_s'] != '']):.1f}" if any(row["delay_s"] != "" for row in of) else "–"
    unseen = lambda of: sum((number(row["wrong_valid_share"]) or 0) > 0.05 and not is_found(row) for row in of)
    lines = [[name.replace("-", " ", 1), *by_estimator(part, found), *by_estimator(part, delay), by_estimator(part, unseen)[0]]
             for name, part in with_all(rows, lambda row: family(row["variant"]))]
    return table(["wrong sensor", "found", "causal", "after [s], median", "causal", "not found though loads are wrong"], lines)


def text(rows, which):
    rows = [row for row in rows if row["exit"] != "1"]
    sound, wrong = ([row for row in rows if row["sound"] == is_it] for is_it in "10")
    stated = [row for row in sound if row["load_is_stated"] == "1"]
    count = len({(row["log"], row["variant"]) for row in rows})
    parts = [f"Made by `tests/calibration/doubts_table.py` from {count} variants of {len({row['log'] for row in rows})} logs of the set `{which}`, {len(rows)} analyses.\n"]
    parts += ["### Doubts and false alarms\n", doubts(stated)]
    parts += ["### Onsets\n", onsets(stated, lift_onsets), onsets(stated, tipping_onsets)]
    parts += ["### The live verdict\n", alarms(sound), "### Bands\n", bands(stated), "### What explains a fall\n", explanations(sound)]
    if wrong:
        parts += [f"### Wrong sensors\n\nOf {', '.join(f'`{log}`' for log in sorted({row['log'] for row in wrong}))}.\n", wrong_ones(wrong)]
    return "\n".join(parts)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", type=Path, help="folder that manoeuvres.py wrote")
    parser.add_argument("table", type=Path, help="table that matrix.py wrote")
    parser.add_argument("page", type=Path, help="page of the book")
    parser.add_argument("--set", default="held")
    arguments = parser.parse_args()
    with open(arguments.table) as file:
        rows = [row for row in csv.DictReader(file) if row["set"] == arguments.set and row["exit"] not in ("script", "timeout")]
    for row in rows:
        row["tips_at"] = tips_at(arguments.logs / row["set"] / row["log"])
    page = arguments.page.read_text()
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    arguments.page.write_text(f"{before}{BEGIN}\n\n{text(rows, arguments.set)}\n{END}{after}")


if __name__ == "__main__":
    main()
