"""Write what the matrix found into a page of the book: false alarms on sound logs, detection of wrong sensors, and the spread of onsets.

    .venv/bin/python doubts_table.py LOGS TABLE.csv PAGE.md [--set held]

TABLE.csv is what `matrix.py` wrote, LOGS what `manoeuvres.py` wrote. What stands between the marks `<!-- begin: doubts -->` and `<!-- end: doubts -->` of the
page is replaced.
"""
import argparse
import csv
from pathlib import Path

import numpy as np

from matrix import ESTIMATORS, family, groups, is_found, kind_of, number, spread, standing_doubts, table, tips_at

BEGIN, END = "<!-- begin: doubts -->", "<!-- end: doubts -->"


def of_estimators(rows, cell):
    return [cell([row for row in rows if row["estimator"] == estimator]) for estimator in ESTIMATORS]


def doubted(rows):
    return f"{sum(bool(standing_doubts(row)) for row in rows)} of {len(rows)}"


def found(rows):
    return f"{sum(is_found(row) for row in rows)} of {len(rows)}"


def delay(rows):
    delays = [float(row["delay_s"]) for row in rows if row["delay_s"] != ""]
    return f"{np.median(delays):.1f}" if delays else "–"


def unseen_and_harmful(rows):
    return str(sum((number(row["wrong_valid_share"]) or 0) > 0.05 and not is_found(row) for row in rows))


def text(rows, which):
    sound = [row for row in rows if row["sound"] == "1" and row["load_is_stated"] == "1"]
    wrong = [row for row in rows if row["sound"] == "0"]
    logs = len({row["log"] for row in rows})
    lines = [f"Made by `tests/calibration/doubts_table.py` from {len({(row['log'], row['variant']) for row in rows})} variants of {logs} logs of the set `{which}`.\n"]
    counts = [[kind, *of_estimators(part, doubted)] for kind, part in [("all", sound), *sorted(groups(sound, kind_of).items())]]
    lines += [table(["sound logs", "doubted or faulty", "causal"], counts)]
    counts = [[name.replace("-", " ", 1), *of_estimators(part, found), *of_estimators(part, delay), of_estimators(part, unseen_and_harmful)[0]]
              for name, part in sorted(groups(wrong, lambda row: family(row["variant"])).items())]
    if counts:
        lines.append("The delay is that of the first row that carries the doubt, before the machine tips.\n")
        lines += [table(["wrong sensor", "found", "causal", "after [s], median", "causal", "not found though loads are wrong"], counts)]
    for estimator in ESTIMATORS:
        lines += [f"Onsets by the {estimator}, in the logs of sound sensors:\n", spread([row for row in sound if row["estimator"] == estimator])]
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("logs", type=Path, help="folder that manoeuvres.py wrote")
    parser.add_argument("table", type=Path, help="table that matrix.py wrote")
    parser.add_argument("page", type=Path, help="page of the book")
    parser.add_argument("--set", choices=("set", "held"), default="held")
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
