#!/usr/bin/env python3
"""Prints what a fleet will need on a cluster: time, memory, requests and cost, computed from measured figures.

    packaging/deploy/plan.py --measure logs --machine machine.toml --logs 100000 --processors 200
    packaging/deploy/plan.py --cpu-s 3.1 --log-bytes 15.5e6 --memory-bytes 120e6 --logs 100000 --processors 200

With --measure the program analyses the logs of a folder once and gathers them. It measures processor time and memory by
the operating system, and requests by the contract of the records. Every price is an input; the defaults are examples, not
offers. Nothing here is a measurement of a cluster: the plan is arithmetic, and its lines say from what.
"""

import argparse
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

GIB = 2**30


def main():
    options = arguments()
    if options.measure:
        measure(options)
    missing = [name for name in ("cpu_s", "log_bytes", "memory_bytes") if getattr(options, name) is None]
    if missing:
        sys.exit(f"expected --measure, or {', '.join('--' + name.replace('_', '-') for name in missing)}")
    print_plan(options)


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("--measure", type=Path, metavar="FOLDER", help="logs to measure with")
    add("--machine", type=Path, help="their machine file")
    add("--program", default="tipwatch", help="the program (default: tipwatch)")
    add("--logs", type=int, default=100_000, help="logs of the fleet")
    add("--processors", type=int, default=200, help="processors at a time")
    add("--parts", type=int, default=1000, help="parts (tasks) of the fleet")
    add("--cpu-s", type=float, help="processor time of a log (s)")
    add("--log-bytes", type=float, help="size of a log (bytes)")
    add("--memory-bytes", type=float, help="memory of an analysis (bytes)")
    add("--record-bytes", type=float, default=8e3, help="size of a record (bytes)")
    add("--findings-share", type=float, default=0.05, help="share of logs with a report")
    add("--gather-cpu-s", type=float, default=5e-4, help="processor time of gathering a log (s)")
    add("--gather-memory-bytes", type=float, default=20e3, help="memory of gathering a log (bytes)")
    add("--read-share", type=float, default=1.0, help="share of a log's bytes that is transferred")
    add("--read-requests", type=float, default=3.0, help="requests to read a log")
    add("--task-start-s", type=float, default=10.0, help="time to start a task (s)")
    add("--task-overhead-s", type=float, default=0.05, help="time of the engine per log (s)")
    add("--efficiency", type=float, default=0.9, help="share of the processors' time that analyses get")
    add("--price-processor-hour", type=float, default=0.04, help="price of a processor for an hour")
    add("--price-1000-reads", type=float, default=0.0004, help="price of 1000 GET requests")
    add("--price-1000-writes", type=float, default=0.005, help="price of 1000 PUT or LIST requests")
    add("--price-gb", type=float, default=0.0, help="price of a GB transferred out of the bucket")
    return parser.parse_args()


def measure(options):
    """Replaces the figures of a log by those of the logs in a folder."""
    logs = [path for path in options.measure.rglob("*") if path.suffix in (".mcap", ".bag", ".db3")]
    if not logs or not options.machine:
        sys.exit(f"--measure: expected logs in {options.measure} and --machine, found {len(logs)} logs")
    with tempfile.TemporaryDirectory() as folder:
        place, out = f"{folder}/records", f"{folder}/fleet"
        screen = [options.program, "screen", str(options.measure), "--machine", str(options.machine)]
        used = run([*screen, "--records", place, "--jobs", "1", "--quiet"], {0})
        records = list(Path(place).glob("state/*.json"))
        contents = [json.loads(path.read_text()) for path in records]
        analysed = [record for record in contents if record["result"]["status"] == "analysed"]
        if not analysed:
            sys.exit("--measure: no log could be analysed")
        options.cpu_s = used.cpu_s / len(records)
        options.log_bytes = sum(path.stat().st_size for path in logs) / len(logs)
        options.memory_bytes = used.memory_bytes
        options.record_bytes = sum(path.stat().st_size for path in records) / len(records)
        options.findings_share = sum(r["result"]["has_report"] for r in analysed) / len(records)
        # the same records under many names, enough to see what one costs
        copies = max(1, 4000 // len(analysed))
        for number in range(copies):
            for record in analysed:
                copy = {**record, "path": f"{record['path']}.{number}", "log_id": f"{number:016x}{record['log_id'][16:]}"}
                copy["result"] = {**record["result"], "has_report": False}
                Path(place, "state", f"{number}-{record['log_id'][:16]}-0.json").write_text(json.dumps(copy))
        gather = [options.program, "screen", "--gather", place, "--quiet", "--out"]
        many = run([*gather, out], None)
        for path in Path(place, "state").glob("*-0.json"):
            path.unlink()
        few = run([*gather, f"{out}-few"], None)
        added = copies * len(analysed)
        options.gather_cpu_s = max(many.cpu_s - few.cpu_s, 0.0) / added
        options.gather_memory_bytes = max(many.memory_bytes - few.memory_bytes, 0.0) / added
        shutil.rmtree(place)
    print(f"measured: {len(records)} logs of {options.measure}, one at a time; gathering by {added} records more\n")


class Used:
    """What a child process used."""

    def __init__(self, usage: resource.struct_rusage) -> None:
        self.cpu_s = usage.ru_utime + usage.ru_stime
        self.memory_bytes = 1024.0 * usage.ru_maxrss


def run(command, codes):
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    code = os.waitstatus_to_exitcode(status)
    # gathering tells its verdict by the code: 1, 3, 4 and 8 are no errors of the run
    if code < 0 or code == 2 or (codes is not None and code not in codes):
        sys.exit(f"{' '.join(command)}: exit code {code}")
    return Used(usage)


def print_plan(o):
    n, parts = o.logs, min(o.parts, o.logs)
    per_log_s = o.cpu_s + o.task_overhead_s
    busy_s = n * per_log_s / o.efficiency + parts * o.task_start_s
    wall_s = max(busy_s / o.processors, (math.ceil(n / parts) * per_log_s) / o.efficiency + o.task_start_s)
    # the log itself, whether it has a record, and the record when it is gathered
    reads = n * (o.read_requests + 2)
    # the record, the mark of the attempt and three files of a report; a list per part, and one per 1000 names gathered
    writes = n * (2 + 3 * o.findings_share) + parts + math.ceil(n / 1000)
    # the mark, and an earlier failure
    deletes = 2 * n
    gather_s = n * o.gather_cpu_s
    transferred = n * o.log_bytes * o.read_share + n * o.record_bytes
    cost = (
        (busy_s + gather_s) / 3600 * o.price_processor_hour
        + reads / 1000 * o.price_1000_reads
        + writes / 1000 * o.price_1000_writes
        + transferred / 1e9 * o.price_gb
    )
    rows = [
        ("input", "processor time of a log", f"{o.cpu_s:.2f} s"),
        ("input", "engine's time per log; start of a task", f"{o.task_overhead_s:.2f} s; {o.task_start_s:.0f} s"),
        ("input", "efficiency of the processors", f"{o.efficiency:.0%}"),
        ("input", "size of a log, share read", f"{o.log_bytes / 1e6:.1f} MB, {o.read_share:.0%}"),
        ("input", "memory of an analysis", f"{o.memory_bytes / 2**20:.0f} MiB"),
        ("input", "size of a record", f"{o.record_bytes / 1e3:.1f} kB"),
        ("input", "logs with a report", f"{o.findings_share:.0%}"),
        ("input", "gathering a log", f"{1e3 * o.gather_cpu_s:.2f} ms, {o.gather_memory_bytes / 1e3:.1f} kB"),
        ("input", "prices: processor hour, 1000 reads, 1000 writes, GB",
         f"{o.price_processor_hour}, {o.price_1000_reads}, {o.price_1000_writes}, {o.price_gb}"),
        ("plan", "logs, parts, processors", f"{n}, {parts}, {o.processors}"),
        ("plan", "processor hours", f"{busy_s / 3600:.1f}"),
        ("plan", "time of the parts", f"{wall_s / 60:.1f} min"),
        ("plan", "time of gathering", f"{gather_s / 60:.1f} min on one processor"),
        ("plan", "memory of a part (one log at a time)", f"{o.memory_bytes / GIB:.2f} GiB"),
        ("plan", "memory of gathering", f"{n * o.gather_memory_bytes / GIB:.2f} GiB"),
        ("plan", "requests: reads, writes and lists, deletes", f"{reads:.0f}, {writes:.0f}, {deletes:.0f}"),
        ("plan", "transferred", f"{transferred / 1e12:.2f} TB"),
        ("plan", "cost", f"{cost:.2f}, {1000 * cost / n:.4f} per thousand logs"),
    ]
    width = max(len(name) for _, name, _ in rows)
    for kind, name, value in rows:
        print(f"{kind:5}  {name:{width}}  {value}")


if __name__ == "__main__":
    main()
