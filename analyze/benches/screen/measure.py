"""Times `tipwatch screen` on one and on two workers, and the Python baseline on some of the same logs, in one run:
`python measure.py TIPWATCH LAB FLEET [LOGS_OF_THE_BASELINE]`, with FLEET as `make_logs.py` made it.

Workers take turns, three times each; the best time of each counts, as others may use the machine. The peer
computes wheel loads alone; a screen computes loads with their uncertainty, every indicator, causes, sensitivities and
events, both models, and writes reports.
"""
import os
import pickle
import shutil
import sys
import tempfile
import time
from pathlib import Path

tipwatch, lab, fleet = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
baseline_logs = int(sys.argv[4]) if len(sys.argv) > 4 else 6


def screen(jobs):
    """Seconds, processor seconds and peak resident memory (MB) of one screen."""
    out = tempfile.mkdtemp(prefix="screen_")
    args = [tipwatch, "screen", str(fleet / "logs"), "--fleet", str(fleet / "fleet.toml"), "--out", out, "--jobs", str(jobs), "-q"]
    start = time.perf_counter()
    child = os.posix_spawn(tipwatch, args, os.environ)
    _, status, usage = os.wait4(child, 0)
    took = time.perf_counter() - start
    shutil.rmtree(out)
    assert os.waitstatus_to_exitcode(status) == 0, status
    return took, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def baseline(logs):
    """Seconds a log of the Python baseline."""
    sys.path.insert(0, str(lab))
    import baseline as peer
    machine = pickle.loads((fleet / "machine.pickle").read_bytes())
    start = time.perf_counter()
    for log in logs:
        peer.analyze(log, machine)
    return (time.perf_counter() - start) / len(logs)


logs = sorted((fleet / "logs").glob("*/*.mcap"), key=lambda log: log.name)
megabytes = sum(log.stat().st_size for log in logs) / 1e6
print(f"{len(logs)} logs, {megabytes:.0f} MB; load of the machine {os.getloadavg()[0]:.1f}")
found = {1: [], 2: []}
for _ in range(3):
    for jobs in found:
        found[jobs].append(screen(jobs))
        took, processor, memory = found[jobs][-1]
        print(f"  {jobs} workers: {took:.1f} s, {processor:.1f} processor seconds, {memory:.0f} MB at most", flush=True)
best = {jobs: min(times)[0] for jobs, times in found.items()}
memory = {jobs: max(times, key=lambda t: t[2])[2] for jobs, times in found.items()}
print(f"two workers are {best[1] / best[2]:.2f} times as fast as one; {memory[1]:.0f} and {memory[2]:.0f} MB")
peer = baseline(logs[:: max(1, len(logs) // baseline_logs)][:baseline_logs])
for jobs in best:
    print(f"a log: {1000 * best[jobs] / len(logs):.0f} ms on {jobs} workers; the Python baseline takes {1000 * peer:.0f} ms, {peer * len(logs) / best[jobs]:.1f} times as long")
