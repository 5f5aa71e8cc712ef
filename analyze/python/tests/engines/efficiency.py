"""Measures what Ray costs: two workers beside one, and the time per log beside threads.

    PYTHONPATH=... python efficiency.py LOGS MACHINE [ROUNDS]

The runs alternate, so that other work on the machine meets all of them. Each number is the median of the rounds.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import ray

import tipwatch as tw


def seconds(logs, machine, workers):
    """Time of a screening on this many Ray workers, or on one thread (0)."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "fleet"
        if workers == 0:
            begin = time.perf_counter()
            fleet = tw.screen(logs, machine=machine, out=out, jobs=1)
            return time.perf_counter() - begin, fleet.totals["logs"]
        ray.init(num_cpus=workers, log_to_driver=False, include_dashboard=False)
        try:
            # workers are started and have the package loaded, as on a cluster that runs
            warm = ray.remote(lambda: __import__("tipwatch") and time.sleep(0.5))
            ray.get([warm.remote() for _ in range(workers)])
            begin = time.perf_counter()
            fleet = tw.screen(logs, machine=machine, out=out, runner="ray")
            return time.perf_counter() - begin, fleet.totals["logs"]
        finally:
            ray.shutdown()


def main():
    logs, machine = sys.argv[1:3]
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    times = {workers: [] for workers in (0, 1, 2)}
    for _ in range(rounds):
        for workers, found in times.items():
            found.append(seconds(logs, machine, workers))
    count = times[0][0][1]
    threads, one, two = (statistics.median(time for time, _ in times[workers]) for workers in (0, 1, 2))
    print(f"{count} logs, {rounds} rounds: one thread {threads:.2f} s, one Ray worker {one:.2f} s, two {two:.2f} s")
    print(f"efficiency of two workers: {one / (2 * two):.2f}; Ray's overhead a log: {1000 * (one - threads) / count:.0f} ms")


if __name__ == "__main__":
    main()
