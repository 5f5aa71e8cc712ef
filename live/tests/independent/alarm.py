"""An alarm goes by an acknowledgement of it, and by nothing else."""

import time

from session import HEADER, LEVELS, LONGEST_S, Session, Verdicts
from wire import Writer, checksum

# how long a wrong acknowledgement gets to do harm, and an alarm to be on the disk
MOMENT_S = 0.3


def has_alarm(verdict):
    return verdict.alarm != 0


def check(bench):
    """Raises an alarm, tries every acknowledgement that must not count, kills the monitor, and acknowledges."""
    print("\n| acknowledgement | alarm |\n|---|---|")
    report, world = bench.report, bench.world()
    try:
        world.start_monitor()
        session = Session(world, bench.session, bench.samples)
        session.wait_for_monitor()
        raised = session.send(stops=has_alarm)
        report.expect(raised is not None, "the log raises no alarm")
        if raised is None:
            return
        writer = Writer(world.node, "acknowledge")
        for name, change in wrong_ones():
            seen = session.verdicts.last
            send(writer, seen, change)
            tell(report, name, session.verdicts.wait_for(lambda v: not has_alarm(v) or v.alarm_acknowledged, MOMENT_S))
        old = session.verdicts.last
        world.kill_monitor()
        world.start_monitor()
        restarted = session.verdicts.wait_for(lambda v: v.source != old.source, LONGEST_S, session.announce_on)
        report.expect(restarted is not None and has_alarm(restarted), "a restart of the monitor clears the alarm")
        print(f"| none, monitor killed and started anew | {restarted and LEVELS[restarted.alarm]} |")
        send(writer, old, lambda message, seen: None)
        tell(report, "of the monitor before",
             session.verdicts.wait_for(lambda v: not has_alarm(v) or v.alarm_acknowledged, MOMENT_S))
        send(writer, session.verdicts.last, lambda message, seen: None)
        counted = session.verdicts.wait_for(lambda v: not has_alarm(v) or v.alarm_acknowledged, LONGEST_S / 10)
        report.expect(counted is not None, "the right acknowledgement does not count")
        print(f"| the right one | {'acknowledged' if counted else 'not acknowledged'} |")
        report.took("alarm", session.verdicts)
    finally:
        world.close()


def tell(report, name, cleared):
    print(f"| {name} | {'cleared' if cleared else 'stays'} |", flush=True)
    report.expect(cleared is None, f"acknowledgement counts: {name}")


def wrong_ones():
    """Acknowledgements that must not count: each changes a right one."""

    def resealed(field, value):
        def change(message, seen):
            setattr(message, field, value(message, seen))
            message.checksum = checksum(message)

        return change

    def zeros(message, seen):
        for name, _ in message._fields_:
            setattr(message, name, 0)

    def damaged(message, seen):
        message.checksum ^= 1

    return [
        ("all zeros", zeros),
        ("bad checksum", damaged),
        ("of another version", resealed("magic", lambda m, _: m.magic ^ 1)),
        ("of another machine", resealed("machine_hash", lambda m, _: m.machine_hash ^ 1)),
        ("of another monitor", resealed("verdict_source", lambda m, _: m.verdict_source ^ 1)),
        ("of a verdict before the alarm", resealed("verdict_sequence", lambda _, seen: seen.alarm_sequence - 1)),
        ("of a verdict that is not published yet", resealed("verdict_sequence", lambda _, seen: seen.sequence + 10**6)),
    ]


def send(writer, seen, change):
    message = writer.message
    message.verdict_source, message.verdict_sequence = seen.source, seen.sequence
    writer.seal(1, seen.machine_hash, 0)
    change(message, seen)
    writer.send_raw()
    time.sleep(0.01)


__all__ = ["HEADER", "Verdicts", "check"]
