"""Faults of the input that must be found, and within which time."""

import math

from session import HEADER, KINDS


class Fault:
    """What is done to each sample from a moment on, and the longest time to a verdict that is neither Safe nor Notice for
    one of these reasons."""

    def __init__(self, name, limit_s, act, *reasons):
        self.name, self.limit_s, self.act, self.reasons = name, limit_s, act, set(reasons)

    def is_found(self, verdict):
        return not self.reasons.isdisjoint(reasons(verdict))

    def from_on(self, start_s):
        def change(session, sample, seconds):
            return None if seconds < start_s else self.act(session, sample, seconds - start_s)

        return change


def reasons(verdict):
    """Faults, cautions and reasons of a verdict, now and behind its level."""
    bits = verdict.faults | verdict.cautions | verdict.held_faults | verdict.held_cautions
    return HEADER.names("fault", bits) + HEADER.names("reason", verdict.reasons | verdict.held_reasons)


def value(kind, place, change):
    """Changes one value of one kind of sensor."""

    def act(session, sample, seconds):
        if sample.kind != KINDS[kind]:
            return None
        sample.values[place] = change(sample.values[place])
        return [session.sealed(sample)]

    return act


def silent(kind):
    """A sensor says nothing any more; the others are numbered as if it had never been meant to."""
    return lambda session, sample, seconds: [] if sample.kind == KINDS[kind] else None


def frozen():
    """The IMU repeats one sample."""
    kept = []

    def act(session, sample, seconds):
        if sample.kind != KINDS["imu"]:
            return None
        kept.append(list(sample.values))
        sample.values[:] = kept[0]
        return [session.sealed(sample)]

    return act


def damaged(session, sample, seconds):
    """A bit is wrong."""
    session.sealed(sample).values[0] += 1e-9
    return [sample]


def zeros(session, sample, seconds):
    session.writer.sequence += 1
    return [type(sample)()]


def lost(session, sample, seconds):
    """Every other sample."""
    session.sealed(sample)
    return [] if sample.sequence % 2 else [sample]


def repeated(session, sample, seconds):
    """Every sample has the number of the first."""
    session.sealed(sample)
    session.writer.sequence -= 1
    return [sample]


def of_another(field):
    """Session or machine."""

    def act(session, sample, seconds):
        sealed = session.sealed(sample)
        head = {"source": sealed.source, "machine_hash": sealed.machine_hash}
        head[field] ^= 1
        session.writer.sequence -= 1
        session.writer.seal(head["source"], head["machine_hash"], sealed.time_ns, sealed)
        return [sealed]

    return act


def stamped(change):
    """Stamps are changed: change(time_ns, seconds since the fault began)."""
    return lambda session, sample, seconds: [session.sealed(sample, change(sample.time_ns, seconds))]


# what the monitor promises (book/src/reference/live-programs.md), and 0.15 s for a busy computer
SLACK_S = 0.15
FAULTS = [
    Fault("no sample any more", 0.25, lambda *_: [], "stale", "joints_gap"),
    Fault("no IMU any more", 0.25, silent("imu"), "stale", "imu_gap"),
    Fault("no joint states any more", 0.25, silent("joints"), "stale", "joints_gap"),
    Fault("joint position NaN", 0.1, value("joints", 0, lambda _: math.nan), "not_finite"),
    Fault("specific force 1e6 m/s2", 0.1, value("imu", 2, lambda _: 1e6), "out_of_range"),
    Fault("attitude not of unit norm", 0.1, value("imu", 9, lambda w: 1.2 * w), "not_unit"),
    Fault("IMU frozen", 1.0, frozen(), "frozen"),
    Fault("a bit of each sample wrong", 0.1, damaged, "torn"),
    Fault("all zeros", 0.1, zeros, "torn"),
    Fault("every other sample lost", 0.3, lost, "lost"),
    Fault("samples repeated", 0.25, repeated, "disordered"),
    Fault("samples of another session", 0.25, of_another("source"), "wrong_source"),
    Fault("samples of another machine", 0.25, of_another("machine_hash"), "wrong_machine"),
    Fault("stamps 1 s ahead", 0.25, stamped(lambda ns, _: ns + 10**9), "clock_jump"),
    Fault("stamps 5 s behind", 0.25, stamped(lambda ns, _: ns - 5 * 10**9), "clock_jump", "stale", "disordered"),
    Fault("stamps at half speed", 2.0, stamped(lambda ns, s: ns - int(s * 5e8)), "clock_jump", "stale"),
]


def without_imu(session):
    session.has_imu = 0


def untimed(session):
    session.pace = 0.0


def with_an_unknown_joint(session):
    session.joint_names[0][0] = ord("?")


# announcements that the monitor must refuse, and its reason
SESSIONS = [
    ("without the IMU", without_imu, "sensor_missing"),
    ("whose clock is unrelated to real time", untimed, "untimed"),
    ("with a joint that the URDF has not", with_an_unknown_joint, "joints"),
]
# those that the short form runs
SHORT = {"no sample any more", "joint position NaN", "a bit of each sample wrong", "samples of another machine"}

__all__ = ["FAULTS", "SESSIONS", "SHORT", "SLACK_S", "reasons"]
