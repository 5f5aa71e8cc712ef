"""Run Tipwatch on every variant of every manoeuvre, and tabulate what it found beside what is true.

    .venv/bin/python matrix.py LAB LOGS TABLE.csv [--program PATH] [--set NAME] [--only PATTERNS] [--variants PATTERNS] [--kind sound|wrong] [--markdown OUT.md]

LAB is the folder of the simulation laboratory, LOGS what `manoeuvres.py` wrote. TABLE.csv receives one row per log, variant and estimator as soon as it
is known; what it has already is not run again. Then the summary is printed, and written as Markdown. `--print` only summarises. `--keep DIR`
keeps the logs of the variants, and what was found in them. --only and --variants are patterns such as 'rigid.*' and 'noise*'.
"""
import argparse
import csv
import fnmatch
import functools
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zlib
from multiprocessing import Pool
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "data"))
sys.path.insert(0, str(HERE))
from fixture_tools import TRUTH_HALF_WINDOW, savitzky_golay    # noqa: E402
from variants import Log, sound_variants, wrong_variants    # noqa: E402

ESTIMATORS = ("smoother", "causal")
LIMIT_S = 240.0        # for one analysis
NEAR_S = 0.3           # a found lift is that of a true one if they overlap within this time
FALSE_SHARE = 0.05     # a found lift is false if the wheel carries more than this share of the mean load all along
BEARS = {"danger": 0.15, "warning": 0.35}    # an alarm is false where every wheel carries more than this share of the mean load, from 1.5 s before to 0.25 s after
WRONG_SHARE = 0.1      # a load is wrong if it is off by more than this share of the mean load
ENDS_S = 0.5           # left out of the error of loads at both ends
COLUMNS = ["set", "log", "machine", "manoeuvre", "variant", "sound", "load_is_stated", "wrong_from_s", "begins_s", "estimator", "exit", "rows", "valid",
           "rows_before_tipping", "lost_before_tipping", "lost", "lost_after", "doubts", "notes", "gross_inputs", "first_contradiction_s", "delay_s",
           "true_lifts", "missed_lifts", "false_lifts", "lift_errors", "true_tipping_s", "found_tipping_s", "tipping_error_s", "tipping_sigma_s", "tipping_bound",
           "true_tip_over", "found_tip_over", "true_first_lift_s", "danger_s", "danger_share", "alarms_asked", "false_danger", "false_warning",
           "load_rms_percent", "load_z_rms", "loads_compared", "loads_in_band", "wrong_valid_share", "true_load_kg", "found_load_kg", "found_load_sigma_kg", "explained_by", "error"]


# ---- one variant

@functools.lru_cache(2)
def clean(folder):
    return Log(folder)


@functools.lru_cache(2)
def variants_of(folder):
    log = Log(folder, 200)
    return {variant.name: variant for variant in sound_variants(log) + wrong_variants(log)}


@functools.lru_cache(2)
def true_loads(folder):
    """Times [s], smoothed loads by wheel [N], and raw loads."""
    import polars
    import writelog
    table = polars.read_parquet(Path(folder) / "truth.parquet")
    t = (table["t_ns"].to_numpy() - writelog.T0) * 1e-9
    wheels = [column for column in table.columns if column.startswith("load_")]
    raw = {wheel: table[wheel].to_numpy().astype(float) for wheel in wheels}
    if np.median(np.diff(t)) > 0.005:    # means over 10 ms already
        return t, raw, raw
    m = TRUTH_HALF_WINDOW
    return t, {wheel: np.concatenate([np.full(m, np.nan), savitzky_golay(load), np.full(m, np.nan)]) for wheel, load in raw.items()}, raw


def judged(task):
    """The rows of a variant, one per estimator. An error of these scripts becomes a row of its own, so that it does not end the others."""
    try:
        return analysed(task)
    except Exception as error:    # noqa: BLE001
        truth = clean(task[0]).truth
        return [dict.fromkeys(COLUMNS, "") | {"set": truth["set"], "log": truth["log"], "variant": task[1], "estimator": estimator, "exit": "script", "error": repr(error)[:300]}
                for estimator in ESTIMATORS]


def analysed(task):
    folder, name, lab, program, keep = task
    if str(lab) not in sys.path:
        sys.path.insert(0, str(lab))
    folder = Path(folder)
    variant, log = variants_of(str(folder))[name], clean(str(folder))
    scratch = Path(tempfile.mkdtemp(prefix="calibration-"))
    try:
        path = scratch / "log.mcap"
        changed = variant.apply(log)
        if min(len(stream.data) for stream in changed.streams.values()) < 2:
            return []
        changed.write(path)
        covers = max(stream.t[0] for stream in changed.streams.values()), min(stream.t[-1] for stream in changed.streams.values())
        if keep:
            kept = Path(keep) / log.truth["set"] / log.truth["log"]
            kept.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, kept / f"{name}.mcap")
        rows = [row_of(folder, log.truth, variant, estimator, path, covers, holes(changed), scratch / estimator, program) for estimator in ESTIMATORS]
        if keep:
            for estimator in filter(lambda estimator: (scratch / estimator).exists(), ESTIMATORS):
                shutil.copytree(scratch / estimator, kept / f"{name}.{estimator}", dirs_exist_ok=True)
        return rows
    finally:
        shutil.rmtree(scratch)


def holes(log):
    """Spans in which a signal that loads need is missing."""
    out = []
    for topic in ("/imu/data", "/joint_states"):
        t = log.streams[topic].t
        for k in np.flatnonzero(np.diff(t) > 0.15):
            out.append((t[k], t[k + 1]))
    return out


def row_of(folder, truth, variant, estimator, log, covers, gaps, out, program):
    row = dict.fromkeys(COLUMNS, "")
    row |= {"set": truth["set"], "log": truth["log"], "machine": truth["machine"], "manoeuvre": truth["manoeuvre"], "variant": variant.name,
            "sound": int(variant.is_sound), "load_is_stated": int(truth["load_is_stated"]), "wrong_from_s": variant.wrong_from, "begins_s": round(covers[0], 3), "estimator": estimator}
    command = [program, "analyze", log, "--machine", folder / "machine.toml", "--out", out, "--quiet", "--estimator", estimator]
    try:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return row | {"exit": "timeout", "error": f"no end within {LIMIT_S} s"}
    row |= {"exit": done.returncode, "error": done.stderr.strip().splitlines()[-1][:300] if done.stderr.strip() else ""}
    if not (out / "summary.json").exists() or not (out / "samples.parquet").exists():
        return row
    return row | findings(folder, truth, variant, estimator, covers, gaps, out)


def findings(folder, truth, variant, estimator, covers, gaps, out):
    import polars
    import writelog
    seconds = lambda ns: (ns - writelog.T0) * 1e-9
    summary = json.loads((out / "summary.json").read_text())
    events = polars.read_parquet(out / "events.parquet")
    samples = polars.read_parquet(out / "samples.parquet")
    t, is_valid = seconds(samples["time_ns"].to_numpy()), samples["valid"].to_numpy()
    tipping = tips_at(folder)
    before = t < tipping
    row = {"rows": len(t), "valid": int(is_valid.sum()), "rows_before_tipping": int(before.sum()), "lost_before_tipping": int((before & ~is_valid).sum()),
           "lost": json.dumps(reasons(samples, before)), "lost_after": json.dumps(reasons(samples, ~before))}

    doubts, contradictions = [], []
    for event in events.filter(polars.col("kind") == "input_fault").iter_rows(named=True):
        start = seconds(event["start_ns"])
        doubts.append([event["subject"], event["fault"], round(start, 3), event["policy"]])
        if event["fault"] == "contradiction":
            contradictions.append(start)
    row["doubts"] = json.dumps(doubts)
    row["notes"] = json.dumps([note[:160] for note in summary.get("notes", []) if note.startswith("input_fault")])
    row["gross_inputs"] = ";".join(gross["kind"] for gross in summary.get("gross_inputs", []))
    if contradictions:
        row["first_contradiction_s"] = round(min(contradictions), 3)
    # the start of a doubt is dated back to where its evidence began to grow: a reader of the rows is told later
    if not variant.is_sound:
        doubted = [when for when, found in zip(t, samples["reasons"].to_list()) if variant.wrong_from - 1e-3 <= when < tipping and casts_doubt(found)]
        row["delay_s"] = round(float(doubted[0]) - variant.wrong_from, 3) if doubted else ""

    row |= lifts(folder, truth, events, covers, gaps, tipping)
    if truth["tipping_s"] is not None and covers[0] < truth["tipping_s"] < covers[1] - 0.3:
        edges = events.filter(polars.col("kind").is_in(["edge_tipping", "tip_over"])).sort((polars.col("start_ns") - writelog.T0 - int(truth["tipping_s"] * 1e9)).abs())
        row["true_tipping_s"] = truth["tipping_s"]
        if len(edges):
            row["found_tipping_s"] = round(seconds(edges["start_ns"][0]), 4)
            row["tipping_error_s"] = min((round(row["found_tipping_s"] - onset, 4) for onset in tipping_of(truth)), key=abs)
            row["tipping_sigma_s"], row["tipping_bound"] = edges["start_sigma_s"][0], edges["start_bound"][0]
    row["true_tip_over"] = int(truth["tilt_10deg_s"] is not None and covers[1] > truth["tilt_10deg_s"])
    row["found_tip_over"] = int((events["kind"] == "tip_over").sum() > 0)

    first = truth["first_lift_s"]
    row["true_first_lift_s"] = "" if first is None else first
    if first is not None and estimator == "causal":
        row |= danger(truth, samples["verdict"].to_numpy(), t, covers[0])
    if estimator == "causal":
        row |= false_alarms(folder, samples["verdict"].to_numpy(), t, before)
    row |= explained(truth, summary)
    return row | errors(folder, samples, t, is_valid & before)


def danger(truth, verdict, t, begins_s):
    """When the verdict is Danger first since the first lift, and in which share of the rows in which a wheel is in the air."""
    is_danger = verdict == "danger"
    row = {}
    if (found := t[(t >= truth["first_lift_s"]) & is_danger]).size:
        row["danger_s"] = round(float(found[0]), 3)
    in_air = np.any([(t >= onset) & (t <= (math.inf if end is None else end)) for spans in truth["lifts"].values() for onset, end in spans], axis=0) & (t >= begins_s)
    if in_air.any():
        row["danger_share"] = round(float(is_danger[in_air].mean()), 4)
    return row


def tipping_of(truth):
    """When the machine begins to tip. One with a pivoting axle tips about the pivot's line, and when the axle is at its stop about the wheels: either counts."""
    last = [spans[-1][0] for spans in truth["lifts"].values() if spans and spans[-1][1] is None]
    return [truth["tipping_s"], min(last)] if truth["machine"] in ("forklift", "pivot", "front_pivot") else [truth["tipping_s"]]


def false_alarms(folder, verdict, t, before):
    """Rows that raise an alarm while the true loads of all wheels are far from none."""
    truth_t, _, raw = true_loads(folder)
    mean = sum(np.mean(load[:50]) for load in raw.values()) / len(raw)
    low, step = np.min(list(raw.values()), axis=0), np.median(np.diff(truth_t))
    past, future = round(1.5 / step), round(0.25 / step)
    padded = np.concatenate((np.full(past, np.inf), low, np.full(future, np.inf)))
    near = np.interp(t, truth_t, np.lib.stride_tricks.sliding_window_view(padded, past + future + 1).min(1)) / mean
    return {"alarms_asked": int(before.sum())} | {f"false_{level}": int(((verdict == level) & before & (near > share)).sum()) for level, share in BEARS.items()}


def explained(truth, summary):
    """What explains the fall most probably, and the load on the tool that nothing states by it."""
    row = {} if truth["load_is_stated"] else {"true_load_kg": truth["payload_kg"]}
    for fall in summary.get("explained_falls", []):
        if found := (fall["load"] or {}).get("combined"):
            row |= {"found_load_kg": round(found["mass_kg"], 2), "found_load_sigma_kg": round(found["sigma_kg"], 2)}
        if fall["explanations"]:
            row["explained_by"] = max(fall["explanations"], key=lambda of: of["probability"])["kind"]
    return row


def casts_doubt(found):
    """Whether the reasons of a row are those of wrong signals."""
    return any(reason == "contradiction" or reason.endswith("_fault") for reason in found or [])


def reasons(samples, which):
    counts = {}
    for found in samples["reasons"].filter(which & ~samples["valid"].to_numpy()).to_list():
        for reason in found or []:
            counts[reason] = counts.get(reason, 0) + 1
    return counts


def lifts(folder, truth, events, covers, gaps, tipping):
    """True lifts of the time before the tip-over beside those that were found."""
    import polars
    import writelog
    found = [(event["subject"], (event["start_ns"] - writelog.T0) * 1e-9, math.inf if event["end_ns"] is None else (event["end_ns"] - writelog.T0) * 1e-9,
              event["start_sigma_s"], event["start_bound"]) for event in events.filter(polars.col("kind") == "wheel_lift").iter_rows(named=True)]
    missed, matched, true = 0, [], 0
    for wheel, spans in truth["lifts"].items():
        for onset, end in spans:
            is_covered = covers[0] + 0.3 < onset < covers[1] - 0.3 and not any(a - 0.3 < onset < b + 0.3 for a, b in gaps)
            if not is_covered or (end is not None and end - onset < 0.1):
                continue
            true += 1
            near = [lift for lift in found if lift[0] == wheel.lower() and lift[1] < (math.inf if end is None else end + NEAR_S) and lift[2] > onset - NEAR_S]
            if not near:
                missed += 1
                continue
            start, sigma, bound = min(((lift[1], lift[3], lift[4]) for lift in near), key=lambda lift: abs(lift[0] - onset))
            matched.append([wheel, round(start - onset, 4), sigma and round(sigma, 4), bound])
    t, _, raw = true_loads(folder)
    mean = sum(load[0] for load in raw.values()) / len(raw)
    false = 0
    for wheel, start, end, *_ in found:
        at = (t >= start - 0.1) & (t <= min(end, start + 5) + 0.1)
        if start < tipping - 0.1 and at.any() and raw[f"load_{wheel}"][at].min() > FALSE_SHARE * mean:
            false += 1
    return {"true_lifts": true, "missed_lifts": missed, "false_lifts": false, "lift_errors": json.dumps(matched)}


def errors(folder, samples, t, which):
    """Of the loads of valid rows, in percent of the mean load."""
    truth_t, smoothed, _ = true_loads(folder)
    which = which & (t > truth_t[0] + ENDS_S) & (t < truth_t[-1] - ENDS_S)
    if not which.any():
        return {}
    off, z = [], []
    mean = np.nansum([np.nanmean(load) for load in smoothed.values()]) / len(smoothed)
    for wheel, load in smoothed.items():
        e = samples[wheel].to_numpy()[which].astype(float) - np.interp(t[which], truth_t, load)
        off.append(e)
        z.append(e / samples[f"{wheel}_sigma"].to_numpy()[which].astype(float))
    off, z = np.array(off), np.array(z)
    return {"loads_compared": int(np.isfinite(z).sum()), "loads_in_band": int((np.abs(z) < 2).sum()), "load_rms_percent": round(float(100 * math.sqrt(np.nanmean(off**2)) / mean), 3), "load_z_rms": round(float(math.sqrt(np.nanmean(np.minimum(z**2, 1e6)))), 3),
            "wrong_valid_share": round(float(np.nanmean(np.nanmax(np.abs(off), axis=0) > WRONG_SHARE * mean)), 4)}


# ---- all of them

def tasks(arguments, done):
    for which in [arguments.set] if arguments.set else ["set", "held"]:
        # in an order that mixes machines and manoeuvres, so that an unfinished table is a sample of all of them
        for folder in sorted((arguments.logs / which).iterdir(), key=lambda folder: zlib.crc32(folder.name.encode())):
            if not (folder / "truth.json").exists() or not any(fnmatch.fnmatch(folder.name, pattern) for pattern in arguments.only.split(",")):
                continue
            for variant in variants_of(str(folder)).values():
                if arguments.kind and variant.is_sound != (arguments.kind == "sound"):
                    continue
                if any(fnmatch.fnmatch(variant.name, pattern) for pattern in arguments.variants.split(",")) and (which, folder.name, variant.name) not in done:
                    yield str(folder), variant.name, arguments.lab, arguments.program, arguments.keep


def run(arguments):
    done = set()
    if arguments.table.exists():
        with open(arguments.table) as file:
            done = {(row["set"], row["log"], row["variant"]) for row in csv.DictReader(file) if row["estimator"] == ESTIMATORS[-1]}
    todo = list(tasks(arguments, done))
    print(f"{len(todo)} variants to analyse, {len(done)} done", flush=True)
    is_new = not arguments.table.exists()
    with open(arguments.table, "a", newline="") as file, Pool(arguments.processes) as pool:
        writer = csv.DictWriter(file, COLUMNS)
        if is_new:
            writer.writeheader()
        for rows in pool.imap_unordered(judged, todo):
            writer.writerows(rows)
            file.flush()


# ---- summary

def number(text):
    return float(text) if text not in ("", None, "None") else None


def share(part, whole):
    return f"{part} / {whole} ({100 * part / whole:.0f} %)" if whole else "–"


def quantiles(values):
    if not values:
        return "–"
    return "{:.2g} / {:.2g} / {:.2g}".format(*np.quantile(values, [0.05, 0.5, 0.95]))


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(str(cell) for cell in row) + " |" for row in rows]) + "\n"


@functools.cache
def tips_at(folder):
    """When the machine of a log begins to tip [s]."""
    truth = json.loads((folder / "truth.json").read_text())
    times = [truth[name] for name in ("tipping_s", "tilt_10deg_s") if truth[name] is not None]
    return min(times, default=math.inf)


def standing_doubts(row):
    """Doubts that begin before the machine tips: what a fall and its impact do to sensors is not among them."""
    limit = row["tips_at"]
    # an outlier is left out, and casts no doubt; a knock that is in the log may be named
    knock = re.match(r"spike-at=([\d.]+)", row["variant"])
    named = lambda start: knock and abs(start - float(knock[1])) < 0.05
    found = [(subject, fault) for subject, fault, start, _ in json.loads(row["doubts"] or "[]") if start < limit and fault != "outlier" and not named(start)]
    return found + [("gross input", kind) for kind in row["gross_inputs"].split(";") if kind]


NO_DOUBT = {"settling", "tipping", "joints_gap", "imu_gap", "odometry_gap", "tool_wrench_gap"}


def lost_to_doubt(row):
    """Rows before the machine tips that are lost, though their signals are there."""
    return sum(count for reason, count in json.loads(row["lost"] or "{}").items() if reason not in NO_DOUBT)


def kind_of(row):
    return row["variant"].split("-")[0]


def groups(rows, key):
    out = {}
    for row in rows:
        out.setdefault(key(row), []).append(row)
    return out


def summary(rows):
    sound = [row for row in rows if row["sound"] == "1" and row["load_is_stated"] == "1"]
    unstated = [row for row in rows if row["sound"] == "1" and row["load_is_stated"] == "0"]
    wrong = [row for row in rows if row["sound"] == "0"]
    text = []
    for estimator in ESTIMATORS:
        of = lambda part: [row for row in part if row["estimator"] == estimator]
        for title, part in (("sound sensors", of(sound)), ("sound sensors, a load that the machine file does not know", of(unstated))):
            if part:
                text += [f"### {estimator}: {title}\n", sound_table(part, kind_of, "variant"), sound_table(part, lambda row: f"{row['machine']}: {row['manoeuvre']}", "log"),
                         relations(part), onsets(part), spread(part)]
        if of(wrong):
            text += [f"### {estimator}: one wrong sensor\n", wrong_table(of(wrong))]
    return "\n".join(text)


def sound_table(rows, key, name):
    lines = []
    for group, part in [("all", rows), *sorted(groups(rows, key).items())]:
        doubted, total = sum(bool(standing_doubts(row)) for row in part), sum(int(row["rows_before_tipping"] or 0) for row in part)
        rms = [number(row["load_rms_percent"]) for row in part if row["load_rms_percent"]]
        lines.append([group, share(doubted, len(part)), share(sum(map(lost_to_doubt, part)), total), sum(row["exit"] != "0" for row in part), quantiles(rms)])
    return table([name, "logs with any doubt", "rows lost to doubt", "exit not 0", "load error, % of mean load: 5 / 50 / 95 % of logs"], lines)


def relations(rows):
    found = {}
    for row in rows:
        for doubt in set(standing_doubts(row)):
            found.setdefault(doubt, []).append(row)
    lines = [[f"{subject}: {fault}", share(len(part), len(rows)), most(part, kind_of), most(part, lambda row: f"{row['machine']}.{row['manoeuvre']}")] for (subject, fault), part in sorted(found.items(), key=lambda item: -len(item[1]))]
    return table(["check", "logs", "most of them with", "and in"], lines)


def most(rows, key):
    counts = sorted(((len(part), name) for name, part in groups(rows, key).items()), reverse=True)
    return ", ".join(f"{name} {count}" for count, name in counts[:6])


def lift_onsets(rows):
    """Error [s], sigma [s] and bound of each onset of a lift."""
    return [onset[1:] for row in rows for onset in json.loads(row["lift_errors"] or "[]")]


def tipping_onsets(rows):
    return [(number(row["tipping_error_s"]), number(row["tipping_sigma_s"]), row["tipping_bound"]) for row in rows if row["found_tipping_s"]]


def dated(found):
    """Error and sigma of the onsets that have them: what begins at or before a time has none."""
    return [(error, sigma) for error, sigma, bound in found if bound == "at"]


def onsets(rows):
    lines = []
    for group, part in [("all", rows), *sorted(groups(rows, lambda row: row["manoeuvre"]).items())]:
        pairs, tip_pairs = dated(lift_onsets(part)), dated(tipping_onsets(part))
        true, missed, false = (sum(int(row[name] or 0) for row in part) for name in ("true_lifts", "missed_lifts", "false_lifts"))
        tips = [row for row in part if row["true_tipping_s"]]
        found = [row for row in tips if row["found_tipping_s"]]
        overs = [row for row in part if row["true_tip_over"] == "1"]
        danger = [number(row["danger_share"]) for row in part if row["danger_share"]]
        late = [number(row["danger_s"]) - number(row["true_first_lift_s"]) for row in part if row["danger_s"]]
        if not true and not overs and not false:
            continue
        lines.append([group, true, missed, false, quantiles([e for e, _ in pairs]), quantiles([e / s for e, s in pairs if s]), share(len(found), len(tips)),
                      quantiles([e for e, _ in tip_pairs]), quantiles([e / s for e, s in tip_pairs if s]), share(sum(row["found_tip_over"] == "1" for row in overs), len(overs)),
                      quantiles(late), quantiles(danger)])
    falsely = sum(row["found_tip_over"] == "1" and row["true_tip_over"] == "0" for row in rows)
    head = ["manoeuvre", "true lifts", "missed", "false", "error of onset [s]: 5 / 50 / 95 %", "error / sigma", "tippings found", "error [s]", "error / sigma", "tip-overs found",
            "Danger after the lift [s]", "share of rows with Danger until the last wheel is down, or the log ends"]
    return table(head, lines) + f"\ntip-overs found where there is none: {falsely}\n"


def spread(rows):
    """How far onsets are off in their own standard deviations: 1 is right, less is too cautious, more is overconfident. What begins at or before
    a time has no error; it is only asked whether it did."""
    lifts, tips = lift_onsets(rows), tipping_onsets(rows)
    lines = []
    for name, pairs in (("lift of a wheel", dated(lifts)), ("tipping about an edge", dated(tips))):
        z = np.array([error / sigma for error, sigma in pairs if sigma])
        if len(z):
            off = np.abs([error for error, _ in pairs])
            near = sum(abs(error) <= max(0.1, 2 * (sigma or 0)) for error, sigma in pairs)
            lines.append([name, len(pairs), f"{math.sqrt(np.mean(z**2)):.2f}", f"{z.mean():+.2f}", f"{np.quantile(off, 0.95):.2f}", share(near, len(pairs))])
    bounds = [(error, sigma) for error, sigma, bound in lifts + tips if bound == "at_or_before"]
    text = table(["onset", "events", "root mean square of error / sigma", "mean", "error, 95 % [s]", "within 0.1 s or two sigma"], lines)
    held = sum(error >= -2 * (sigma or 0) for error, sigma in bounds)
    return text + f"\nonsets at or before a time: {share(held, len(bounds))} are\n"


def wrong_table(rows):
    lines = []
    for group, part in sorted(groups(rows, lambda row: family(row["variant"])).items()):
        found = [row for row in part if is_found(row)]
        delays = [float(row["delay_s"]) for row in found if row["delay_s"] != ""]
        harmful = [row for row in part if (number(row["wrong_valid_share"]) or 0) > 0.05]
        unseen = [row for row in harmful if not is_found(row)]
        lines.append([group, share(len(found), len(part)), quantiles(delays), share(len(unseen), len(part)), f"{np.mean([number(row['wrong_valid_share']) or 0 for row in part]):.2f}"])
    return table(["wrong sensor", "found", "delay [s]: 5 / 50 / 95 %", f"not found, though more than 5 % of valid rows are off by {100 * WRONG_SHARE:.0f} %", "mean share of such rows"], lines)


def found_after(row):
    """Seconds from the time at which the sensor is wrong to the first doubt about an input, of whatever kind, before the machine tips; None without one."""
    since = float(row["wrong_from_s"])
    # a single sample that an impact causes is left out, and tells nothing of the sensor
    counts = lambda fault: fault != "outlier" or row["variant"].startswith("outliers")
    starts = [start for _, fault, start, _ in json.loads(row["doubts"] or "[]") if counts(fault) and since - 0.5 <= start < row["tips_at"]]
    return max(0.0, min(starts) - since) if starts else None


def is_found(row):
    return bool(row["gross_inputs"]) or found_after(row) is not None


def family(variant):
    """The name without what differs from log to log: the times."""
    return "-".join(part for part in variant.split("-") if not part.startswith(("since=", "at=", "begin=", "seconds=")) or variant.startswith("attitude"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path, help="folder of the simulation laboratory")
    parser.add_argument("logs", type=Path, help="folder that manoeuvres.py wrote")
    parser.add_argument("table", type=Path, help="table to write, one row per log, variant and estimator")
    parser.add_argument("--program", default="tipwatch", help="the program to run")
    parser.add_argument("--set", help="only this set")
    parser.add_argument("--only", default="*", help="patterns of logs, with commas")
    parser.add_argument("--variants", default="*", help="patterns of variants, with commas")
    parser.add_argument("--kind", choices=("sound", "wrong"))
    parser.add_argument("--keep", help="folder to keep the logs of the variants in")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--markdown", type=Path, help="file for the summary")
    parser.add_argument("--print", action="store_true", help="only summarise the table")
    arguments = parser.parse_args()
    os.environ.setdefault("POLARS_MAX_THREADS", "1")
    sys.path.insert(0, str(arguments.lab))
    if not arguments.print:
        run(arguments)
    with open(arguments.table) as file:
        rows = [row for row in csv.DictReader(file) if (not arguments.set or row["set"] == arguments.set)
                and any(fnmatch.fnmatch(row["log"], pattern) for pattern in arguments.only.split(","))
                and any(fnmatch.fnmatch(row["variant"], pattern) for pattern in arguments.variants.split(","))
                and (not arguments.kind or (row["sound"] == "1") == (arguments.kind == "sound"))]
    for row in rows:
        row["tips_at"] = tips_at(arguments.logs / row["set"] / row["log"])
    broken = [row for row in rows if row["exit"] == "script"]
    for row in broken[:10]:
        print(f"{row['log']} {row['variant']}: {row['error']}", file=sys.stderr)
    text = summary([row for row in rows if row["exit"] != "script"])
    print(text)
    if broken:
        sys.exit(f"{len(broken)} rows are missing, because these scripts failed on them")
    if arguments.markdown:
        arguments.markdown.write_text(text)


if __name__ == "__main__":
    main()
