#!/usr/bin/env python3
"""A consumer of verdicts that is not written in Rust: prints the level to act on whenever it changes.

    pip install iceoryx2==0.10.0
    python live/examples/subscriber.py tests/data/tiny.toml tests/data/tiny.urdf

A verdict counts only if it is undamaged, of this machine and still valid. Everything else is a fault: a verdict that is
missing is not a safe machine. Prints how old verdicts were when they arrived.
"""

import time

from wire import Header, Node, Reader, example_arguments

LONGEST_WAIT_S = 0.02


def main():
    arguments = example_arguments(__doc__)
    header = Header()
    node = Node(header, "subscriber", arguments.service, arguments.prefix)
    verdicts = Reader(node, "verdict", listens=True)
    machine_hash = header.hash([arguments.machine.read_bytes(), arguments.urdf.read_bytes()])
    levels = header.enums["level"]
    shown, verdict, source, expected, lost, ages = None, None, None, 0, 0, []
    end = time.monotonic() + arguments.seconds
    while time.monotonic() < end:
        verdicts.wait(LONGEST_WAIT_S)
        while (received := verdicts.receive()) is not None:
            if header.wrong_with(received) or received.machine_hash != machine_hash:
                verdict = None
                continue
            # each run of the monitor numbers its verdicts from zero
            if received.source == source:
                lost += max(0, received.sequence - expected)
            source, expected = received.source, received.sequence + 1
            ages.append(time.monotonic_ns() - received.published_ns)
            verdict = received
        is_valid = verdict is not None and time.monotonic_ns() <= verdict.valid_until_ns
        # a number that the header does not know is a fault
        level = levels.get(verdict.latched_level, "fault") if is_valid else "fault"
        faults = header.names("fault", verdict.held_faults) if is_valid else ["no valid verdict"]
        if (level, faults) != shown:
            shown = (level, faults)
            print(level, *faults, flush=True)
    median_ms = sorted(ages)[len(ages) // 2] / 1e6 if ages else float("nan")
    print(f"{len(ages)} verdicts, {lost} lost, received {median_ms:.2f} ms after publication (median)")


if __name__ == "__main__":
    main()
