#!/usr/bin/env python3
"""Prints what a fleet will need on a cluster: time, memory, requests and cost, computed from measured figures.

    packaging/deploy/plan.py --measure logs --fleet fleet.toml --logs 100000 --processors 200
    packaging/deploy/plan.py --cpu-s 3.1 --log-bytes 15.5e6 --memory-bytes 120e6 --logs 100000 --processors 200

With --measure the program analyses the logs of a folder once and gathers their records, copied to two numbers. Processor time
and memory are what the operating system counts; the requests follow from the contract of the records. Logs, records and data
set are in buckets, each in a place of its own; with --request-s 0 they are in a shared folder, without requests. Every
price is an input; the defaults are examples, not offers. Nothing here is a measurement of a cluster: the plan is
arithmetic, and its lines say from what.
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
DAY_NS = 86_400_000_000_000
# Names in the answer to one request for a list
NAMES = 1000
# Requests of a gathering at a time
PARALLEL = 128
# Memory of the connections to a bucket of a part, and of a gathering with what it copies at a time (bytes)
CONNECTIONS, GATHER_CONNECTIONS = 16 * 2**20, 48 * 2**20
# Processor time of a request, of one after the other and of many at a time (s)
REQUEST_CPU_S, PARALLEL_REQUEST_CPU_S = 4e-4, 1.3e-4
# Records that are gathered to measure what one takes, beside what every gathering takes
FEW, MANY = 2000, 16000


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
    machine = parser.add_mutually_exclusive_group()
    machine.add_argument("--machine", type=Path, help="their machine file")
    machine.add_argument("--fleet", type=Path, help="their fleet file")
    add("--program", default="tipwatch", help="the program (default: tipwatch)")
    add("--logs", type=int, default=100_000, help="logs of the fleet")
    add("--processors", type=int, default=200, help="processors at a time")
    add("--parts", type=int, default=1000, help="parts (tasks) of the fleet")
    add("--cpu-s", type=float, help="processor time of a log (s)")
    add("--log-bytes", type=float, help="size of a log (bytes)")
    add("--memory-bytes", type=float, help="memory of an analysis (bytes)")
    add("--record-bytes", type=float, default=8e3, help="size of a record (bytes)")
    add("--findings-share", type=float, default=0.05, help="share of logs with a report")
    add("--gather-cpu-s", type=float, default=6e-5, help="processor time of gathering a log (s)")
    add("--gather-memory-bytes", type=float, default=4.5e3, help="memory of gathering a log (bytes)")
    add("--gather-base-bytes", type=float, default=60e6, help="memory of gathering nothing (bytes)")
    add("--read-share", type=float, default=1.0, help="share of a log's bytes that is transferred")
    add("--read-requests", type=float, default=4.0, help="requests to read a log")
    add("--request-s", type=float, default=0.03, help="time until a bucket answers (s); 0 for a shared folder")
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
    machine = [f"--{key}={getattr(options, key)}" for key in ("machine", "fleet") if getattr(options, key)]
    if not machine:
        sys.exit("--measure: expected --machine or --fleet as well, found neither")
    with tempfile.TemporaryDirectory() as folder:
        place = f"{folder}/records"
        screen = [options.program, "screen", str(options.measure), *machine]
        used = run([*screen, "--records", place, "--jobs", "1", "--quiet"], {0})
        records = list(Path(place).glob("state/*.json"))
        contents = [json.loads(path.read_text()) for path in records]
        analysed = [record for record in contents if record["result"]["status"] == "analysed"]
        if not analysed:
            sys.exit("--measure: no log could be analysed")
        options.cpu_s = used.cpu_s / len(records)
        options.log_bytes = sum(record["bytes"] or 0 for record in contents) / len(records)
        options.memory_bytes = used.memory_bytes
        options.record_bytes = sum(path.stat().st_size for path in records) / len(records)
        options.findings_share = sum(r["result"]["has_report"] for r in analysed) / len(records)
        few, many = (gathered(options.program, f"{folder}/{count}", analysed, count) for count in (FEW, MANY))
        options.gather_cpu_s = (many.cpu_s - few.cpu_s) / (MANY - FEW)
        options.gather_memory_bytes = (many.memory_bytes - few.memory_bytes) / (MANY - FEW)
        options.gather_base_bytes = few.memory_bytes - FEW * options.gather_memory_bytes
    print(f"measured: {len(records)} logs of {options.measure}, one at a time; gathering {FEW} and {MANY} copies of their records\n")


def gathered(program, place, analysed, count):
    """What gathering so many records uses: copies under other paths, on the days of a year."""
    state = Path(place, "state")
    state.mkdir(parents=True)
    for number in range(count):
        record = analysed[number % len(analysed)]
        facts = {**record["result"]["facts"], "start_ns": (20_454 + number // len(analysed) % 365) * DAY_NS}
        result = {**record["result"], "facts": facts, "has_report": False}
        copy = {**record, "path": f"{record['path']}.{number}", "log_id": f"{number:064x}", "result": result}
        Path(state, f"{number:016x}-{number:016x}-0.json").write_text(json.dumps(copy))
    used = run([program, "screen", "--gather", place, "--quiet", "--out", f"{place}-fleet"], None)
    shutil.rmtree(place)
    return used


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
    n, parts, share = o.logs, min(o.parts, o.logs), o.findings_share
    is_bucket = o.request_s > 0
    # Of a log: it is read, and whether it has a record; the mark of the attempt, the record and three files of a report; the
    # mark and an earlier failure are removed. Each waits for the one before.
    of_log = [o.read_requests + 1, 2 + 3 * share, 2]
    # of a part: the names of all logs, and of marks
    lists_of_part = math.ceil(n / NAMES) + 1
    cpu_s = o.cpu_s + is_bucket * REQUEST_CPU_S * sum(of_log)
    per_log_s = cpu_s / o.efficiency + o.task_overhead_s + o.request_s * sum(of_log)
    per_part_s = o.task_start_s + o.request_s * lists_of_part
    busy_s = n * per_log_s + parts * per_part_s
    wall_s = max(busy_s / o.processors, math.ceil(n / parts) * per_log_s + per_part_s)
    # The gathering: the names of records, logs and reports, one after the other; records and reports, many at a time.
    lists_of_gather = 2 * math.ceil(n / NAMES) + math.ceil(3 * share * n / NAMES) + 3
    gathered = n * (1 + 6 * share)
    requests_cpu_s = is_bucket * gathered * PARALLEL_REQUEST_CPU_S
    gather_cpu_s = n * o.gather_cpu_s + requests_cpu_s
    gather_s = n * o.gather_cpu_s + o.request_s * lists_of_gather + max(o.request_s * gathered / PARALLEL, requests_cpu_s)
    memory, gather_memory = o.memory_bytes, o.gather_base_bytes + n * o.gather_memory_bytes
    of_parts = [n * of_log[0], n * of_log[1] + parts * lists_of_part, n * of_log[2]]
    of_gather = [n * (1 + 3 * share), 3 * share * n + lists_of_gather, 0]
    if is_bucket:
        memory, gather_memory = memory + CONNECTIONS, gather_memory + GATHER_CONNECTIONS
    else:
        of_parts = of_gather = [0, 0, 0]
    reads, writes, _ = (a + b for a, b in zip(of_parts, of_gather))
    transferred = n * o.log_bytes * o.read_share + n * o.record_bytes
    cost = (
        (busy_s + gather_s) / 3600 * o.price_processor_hour
        + reads / 1000 * o.price_1000_reads
        + writes / 1000 * o.price_1000_writes
        + transferred / 1e9 * o.price_gb
    )
    rows = [
        ("input", "processor time of a log", f"{o.cpu_s:.3f} s"),
        ("input", "engine's time per log; start of a task", f"{o.task_overhead_s:.2f} s; {o.task_start_s:.0f} s"),
        ("input", "time of a request; requests to read a log", f"{o.request_s:.3f} s; {o.read_requests:.1f}"),
        ("input", "efficiency of the processors", f"{o.efficiency:.0%}"),
        ("input", "size of a log, share read", f"{o.log_bytes / 1e6:.1f} MB, {o.read_share:.0%}"),
        ("input", "memory of an analysis", f"{o.memory_bytes / 2**20:.0f} MiB"),
        ("input", "size of a record", f"{o.record_bytes / 1e3:.1f} kB"),
        ("input", "logs with a report", f"{o.findings_share:.0%}"),
        ("input", "gathering a log", f"{1e3 * o.gather_cpu_s:.3f} ms, {o.gather_memory_bytes / 1e3:.1f} kB"),
        ("input", "prices: processor hour, 1000 reads, 1000 writes, GB",
         f"{o.price_processor_hour}, {o.price_1000_reads}, {o.price_1000_writes}, {o.price_gb}"),
        ("plan", "logs, parts, processors", f"{n}, {parts}, {o.processors}"),
        ("plan", "processor hours", f"{busy_s / 3600:.1f}"),
        ("plan", "time of the parts", f"{wall_s / 60:.2f} min"),
        ("plan", "processor time of gathering; until it ends", f"{gather_cpu_s:.1f} s; {gather_s:.0f} s on one processor"),
        ("plan", "memory of a part (one log at a time)", f"{memory / 2**20:.0f} MiB"),
        ("plan", "memory of gathering", f"{gather_memory / 2**20:.0f} MiB"),
        ("plan", "requests of the parts: reads, writes and lists, deletes", ", ".join(f"{r:.0f}" for r in of_parts)),
        ("plan", "requests of gathering: reads, writes and lists", ", ".join(f"{r:.0f}" for r in of_gather[:2])),
        ("plan", "transferred", f"{transferred / 1e12:.2f} TB"),
        ("plan", "cost", f"{cost:.2f}, {1000 * cost / n:.4f} per thousand logs"),
    ]
    width = max(len(name) for _, name, _ in rows)
    for kind, name, value in rows:
        print(f"{kind:5}  {name:{width}}  {value}")


if __name__ == "__main__":
    main()
