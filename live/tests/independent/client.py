#!/usr/bin/env python3
"""An independent test of tipwatch-live: a client that knows only the C header.

    pip install iceoryx2==0.10.0 polars
    cargo build --release --bins
    python live/tests/independent/client.py target/release/tipwatch-live tests/data/swing_lift.mcap tests/data/tiny_lift.mcap

Beside each log lie its machine file, URDF and true wheel loads (NAME.toml, NAME.urdf, NAME.truth.parquet). The client sends the
samples of a log to a monitor as a machine would, with faults and with wrong but plausible sensors, and prints

- how long each fault takes until the verdict is neither Safe nor Notice,
- in how many rows with a wrong sensor the verdict is Safe or Notice while a wheel carries nothing, by the true loads,
- which sessions are refused,
- what becomes of acknowledgements that must not count, and of the alarm over a kill of the monitor.

It checks magic, layout, checksum, machine, sequence and validity of every verdict. Exit code 1 if anything is not as the
reference says. With --most-percent, wrong sensors count too, but for those that --not-excited names: no sensor can be
found by a motion that does not depend on it.
"""

import argparse
import bisect
import pathlib
import sys
import time

import alarm
from faults import FAULTS, SESSIONS, SHORT, SLACK_S, reasons
from session import HEADER, LEVELS, LONGEST_S, Session, World, read_log
from wrong_sensors import SHORT_SENSORS, resealing, wrong_sensors

GOOD = {"safe", "notice"}
BASES = HEADER.enums["basis"]
CALM = GOOD | {"assumed"}
# a wheel that carries less carries nothing (N)
NOTHING_N = 1.0
# findings that a busy computer or the start brings about
ALONE = {"stale", "lost", "verdict_late", "alarm_unsaved", "never_received"}
# how many times a fault is tried on a busy computer until the verdict was Safe before it
TRIES = 3


def true_loads(path):
    """Times (ns) and the least true load of a wheel (N)."""
    import polars

    truth = polars.read_parquet(path)
    loads = truth.select(polars.min_horizontal(polars.exclude("t_ns")))
    return truth["t_ns"].to_list(), loads.to_series().to_list()


def least_load(truth, time_ns):
    """The least true load at a time: of the nearest row, or the larger of two neighbours; NaN outside."""
    times, loads = truth
    place = bisect.bisect_left(times, time_ns)
    if place == 0 or place == len(times):
        return float("nan")
    return max(loads[place - 1], loads[place])


def findings(verdict):
    """What the verdict says about the values of sensors, beside what it says about when they came."""
    faults = HEADER.names("fault", verdict.faults | verdict.cautions | verdict.held_faults | verdict.held_cautions)
    of_rows = HEADER.names("reason", verdict.reasons | verdict.held_reasons)
    return set(faults) | {name for name in of_rows if name.endswith("_fault")}


class Report:
    """What was wrong."""

    def __init__(self):
        self.failures, self.verdicts = [], 0

    def expect(self, is_right, text):
        if not is_right:
            self.failures.append(text)
            print(f"    FAILED: {text}")

    def took(self, name, verdicts):
        self.verdicts += verdicts.count
        self.expect(not verdicts.bad, f"{name}: {len(verdicts.bad)} bad verdicts: {verdicts.bad[:3]}")


class Bench:
    def __init__(self, arguments, log, report):
        self.arguments, self.report, self.log = arguments, report, log
        self.machine, self.urdf = log.with_suffix(".toml"), log.with_suffix(".urdf")
        world = self.world()
        self.session, self.samples = read_log(world, log)
        world.close()

    def world(self):
        return World(self.arguments.program, self.machine, self.urdf)

    def run(self, name, change=None, until_s=None, stops=lambda verdict: False):
        """A session with a monitor of its own: the verdict that ended it, and all of them."""
        world = self.world()
        try:
            world.start_monitor()
            session = Session(world, self.session, self.samples)
            session.wait_for_monitor()
            ended = session.send(change, until_s, stops)
            self.report.took(name, session.verdicts)
            return ended, session
        finally:
            world.close()

    def faults(self):
        """Each fault begins where the log's first second of Safe is over."""
        print("\n| fault | found after (ms) | level | why |\n|---|---|---|---|")
        for fault in FAULTS:
            if self.arguments.short and fault.name not in SHORT:
                continue
            start_s = self.arguments.start
            for _ in range(TRIES):
                begun_ns = None

                def found(verdict):
                    is_on = begun_ns is not None and verdict.published_ns > begun_ns
                    return is_on and LEVELS[verdict.level] not in CALM | {"unknown"} and fault.is_found(verdict)

                def change(session, sample, seconds, act=fault.from_on(start_s)):
                    nonlocal begun_ns
                    if seconds >= start_s and begun_ns is None:
                        begun_ns = time.monotonic_ns()
                    return act(session, sample, seconds)

                ended, session = self.run(fault.name, change, start_s + fault.limit_s + 1.0, found)
                before = [v for v in session.verdicts.rows if begun_ns and v.published_ns < begun_ns]
                if before and LEVELS[before[-1].level] in CALM:
                    break
            else:
                found = [LEVELS[before[-1].level], *sorted(findings(before[-1]))] if before else ["none"]
                self.report.expect(False, f"{fault.name}: expected a verdict without danger before it, found {' '.join(found)}")
                continue
            if ended is None:
                self.report.expect(False, f"{fault.name}: not found in {fault.limit_s + 1.0} s")
                continue
            took_s = (ended.published_ns - begun_ns) * 1e-9
            why = ", ".join(reasons(ended))
            print(f"| {fault.name} | {took_s * 1e3:.1f} | {LEVELS[ended.level]} | {why} |", flush=True)
            limit_s = fault.limit_s + SLACK_S
            self.report.expect(took_s <= limit_s, f"{fault.name}: found after {took_s:.3f} s, limit {limit_s:.3f} s")

    def sessions(self):
        """Announcements that must be refused."""
        print("\n| session | refused after (ms) | why |\n|---|---|---|")
        for name, change, expected in SESSIONS:
            world = self.world()
            try:
                world.start_monitor()
                session = Session(world, self.session, self.samples, change)
                refused = session.verdicts.wait_for(
                    lambda v: v.refused_session == session.source, LONGEST_S, session.announce_on
                )
                self.report.took(name, session.verdicts)
                why = HEADER.enums["refusal_reason"].get(refused.refusal) if refused else None
                level = LEVELS[refused.level] if refused else None
                took_ms = (refused.published_ns - session.start_ns) * 1e-6 if refused else float("nan")
                print(f"| {name} | {took_ms:.0f} | {why} |", flush=True)
                self.report.expect((why, level) == (expected, "fault"), f"session {name}: {why}, {level}")
            finally:
                world.close()

    def is_unexcited(self, sensor):
        """Whether the motion of the log is said not to depend on the sensor."""
        return bool({self.log.stem, f"{self.log.stem}: {sensor}"} & set(self.arguments.not_excited))

    def sensors(self):
        """The log as it is, and with each wrong sensor."""
        truth = true_loads(self.log.with_suffix(".truth.parquet"))
        print(f"\n{self.log.stem}")
        print("\n| sensor | rows with a wheel at 0 N | of them Safe or Notice, as proven | found at (s) | level | why |\n|---|---|---|---|---|---|")
        sensors = wrong_sensors(self.session, self.samples)
        missing = SHORT_SENSORS - set(sensors)
        self.report.expect(not missing, f"no such wrong sensor: {missing}")
        everything = {"as it is": None, **sensors}
        for name, wrong in everything.items():
            if self.arguments.short and wrong and name not in SHORT_SENSORS:
                continue
            _, session = self.run(name, wrong and resealing(wrong))
            rows = [v for v in session.verdicts.rows if HEADER.enums["event"].get(v.event) == "row"]
            lifted = [v for v in rows if least_load(truth, v.time_ns) <= NOTHING_N]
            fooled = sum(LEVELS[v.level] in GOOD and BASES[v.basis] == "proven" for v in lifted)
            # what a busy computer brings about by itself does not find a sensor
            found = [(v, why) for v in rows if (why := findings(v) - ALONE)]
            first, level, why = "none", "", []
            if found:
                verdict, why = found[0]
                first, level = f"{(verdict.time_ns - session.first_ns) * 1e-9:.2f}", LEVELS[verdict.level]
            why = ", ".join(sorted(why))
            print(f"| {name} | {len(lifted)} | {fooled} | {first} | {level} | {why} |", flush=True)
            if wrong is None:
                self.report.expect(len(lifted) > 0, f"{name}: no row with a wheel at 0 N")
                self.report.expect(fooled == 0, f"{name}: {fooled} rows Safe or Notice with a wheel at 0 N")
            elif self.arguments.most_percent is not None and not self.is_unexcited(name):
                most = len(lifted) * self.arguments.most_percent / 100
                self.report.expect(fooled <= most, f"{name}: {fooled} of {len(lifted)} rows Safe or Notice")


def main():
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("program", type=pathlib.Path, help="tipwatch-live")
    arguments.add_argument("logs", type=pathlib.Path, nargs="+", metavar="LOG", help="faults are tried on the first")
    arguments.add_argument("--short", action="store_true", help="four faults and four wrong sensors")
    arguments.add_argument("--sensors-only", action="store_true", help="wrong sensors only")
    arguments.add_argument("--start", type=float, default=1.5, metavar="S", help="when faults begin, in the log")
    arguments.add_argument("--most-percent", type=float, metavar="P", help="limit of rows Safe or Notice per wrong sensor")
    arguments.add_argument(
        "--not-excited", action="append", default=[], metavar="LOG[: SENSOR]", help="a log, or one wrong sensor of it, without limit"
    )
    arguments = arguments.parse_args()
    report = Report()
    for kind in HEADER.messages:
        stated = int(HEADER.texts[f"{kind.upper()}_LAYOUT"], 16)
        report.expect(HEADER.layout(kind) == stated, f"layout of {kind}")
    report.expect(HEADER.hash([b"tip", b"watch"]) == HEADER.numbers["HASH_EXAMPLE"], "hash of the example")
    benches = [Bench(arguments, log, report) for log in arguments.logs]
    for bench in benches:
        bench.sensors()
    if not arguments.sensors_only:
        benches[0].faults()
        benches[0].sessions()
        alarm.check(benches[0])
    print(f"\n{report.verdicts} verdicts checked, {len(report.failures)} failures")
    for failure in report.failures:
        print(f"- {failure}")
    sys.exit(1 if report.failures else 0)


if __name__ == "__main__":
    main()
