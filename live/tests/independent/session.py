"""A session of a log's samples, sent by a client that knows only the C header, and the verdicts on it."""

import pathlib
import secrets
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples"))
from wire import Header, Node, Reader, Writer  # noqa: E402

HEADER = Header()
LEVELS = HEADER.enums["level"]
KINDS = {name: number for number, name in HEADER.enums["kind"].items()}
# a test waits no longer than this for anything
LONGEST_S = 30.0


class World:
    """A monitor of its own, in shared memory of its own."""

    def __init__(self, program, machine, urdf):
        self.program, self.machine = str(program), str(machine)
        self.prefix = f"twi{secrets.token_hex(4)}_"
        self.state = tempfile.TemporaryDirectory()
        self.hash = HEADER.hash([machine.read_bytes(), urdf.read_bytes()])
        self.node = Node(HEADER, "independent", prefix=self.prefix)
        # every service, with the settings of the header: the monitor refuses others
        self.opened = [(self.node.messages(kind), self.node.events(kind)) for kind in HEADER.messages]
        self.monitor = None

    def start(self, *arguments):
        return subprocess.Popen(
            [self.program, *arguments, "--prefix", self.prefix],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        )

    def start_monitor(self):
        arguments = ["monitor", "--machine", self.machine, "--state", self.state.name, "--stay", "--quiet"]
        self.monitor = self.start(*arguments)

    def kill_monitor(self):
        if self.monitor:
            self.monitor.kill()
            self.monitor.communicate()
            self.monitor = None

    def close(self):
        self.kill_monitor()
        self.state.cleanup()
        for folder in ("/dev/shm", "/tmp/iceoryx2"):
            for path in pathlib.Path(folder).glob(f"{self.prefix}*"):
                path.unlink(missing_ok=True)


def read_log(world, log):
    """The session and all samples of a log, as the program's own replay sends them."""
    samples, sessions = Reader(world.node, "sample", listens=True), Reader(world.node, "session")
    replay = world.start("replay", str(log), "--machine", world.machine, "--speed", "4", "--readers", "1", "--wait", "20")
    session, read, end = None, [], time.monotonic() + LONGEST_S
    while not read or read[-1].kind != KINDS["end"]:
        if time.monotonic() > end or (replay.poll() not in (None, 0)):
            raise SystemExit(f"{log}: no samples from replay: {replay.communicate()[1]}")
        samples.wait(0.005)
        session = session or sessions.receive()
        while (sample := samples.receive()) is not None:
            if HEADER.wrong_with(sample) or sample.sequence != len(read):
                raise SystemExit(f"{log}: sample {sample.sequence} is damaged, or samples before it were lost")
            read.append(sample)
    replay.communicate()
    if session is None or HEADER.wrong_with(session):
        raise SystemExit(f"{log}: no session")
    if session.machine_hash != world.hash:
        raise SystemExit(f"{log}: the machine hash is not the one that the header describes")
    return session, read[:-1]


class Verdicts:
    """Checks every verdict: magic, checksum, machine, sequence, validity, publication."""

    def __init__(self, world):
        self.reader = Reader(world.node, "verdict", listens=True)
        self.hash = world.hash
        self.source = self.expected = None
        self.count, self.bad, self.rows, self.last = 0, [], [], None

    def take(self):
        """The verdicts that wait."""
        taken = []
        while (verdict := self.reader.receive()) is not None:
            self.check(verdict)
            self.last = verdict
            taken.append(verdict)
        return taken

    def check(self, verdict):
        self.count += 1
        wrong = HEADER.wrong_with(verdict)
        if verdict.source != self.source:
            self.source, self.expected = verdict.source, verdict.sequence
        valid_ns = verdict.valid_until_ns - verdict.published_ns
        for name, is_wrong in [
            (wrong, wrong is not None),
            ("machine", verdict.machine_hash != self.hash),
            ("sequence", verdict.sequence != self.expected),
            ("validity", not 0 < valid_ns <= HEADER.numbers["VALIDITY_NS"]),
            ("published in the future", verdict.published_ns > time.monotonic_ns()),
            ("level", verdict.level not in LEVELS or verdict.latched_level not in LEVELS),
            ("fault without a reason", self.is_unexplained(verdict)),
        ]:
            if is_wrong:
                self.bad.append(f"verdict {verdict.sequence}: {name}")
        self.expected = verdict.sequence + 1

    @staticmethod
    def is_unexplained(verdict):
        is_fault = LEVELS.get(verdict.level) == "fault"
        return is_fault and not (verdict.held_faults or verdict.held_reasons or verdict.faults or verdict.reasons)

    def wait_for(self, is_it, seconds, between=lambda: None):
        """The first verdict for which is_it holds; None if there is none in that time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            between()
            self.reader.wait(0.002)
            for verdict in self.take():
                if is_it(verdict):
                    return verdict
        return None


class Session:
    """One session of a log, with whatever is done to its samples."""

    def __init__(self, world, announced, samples, change=lambda session: None):
        self.world, self.samples = world, samples
        self.source = secrets.randbits(63)
        self.verdicts = Verdicts(world)
        self.sessions, self.writer = Writer(world.node, "session"), Writer(world.node, "sample")
        self.start_ns = time.monotonic_ns()
        message = self.sessions.message
        for name, _ in announced._fields_:
            setattr(message, name, getattr(announced, name))
        message.pace, message.wants_progress, message.total_samples = 1.0, 0, 0
        self.first_ns = samples[0].log_time_ns
        message.clock_stamp_ns, message.clock_host_ns = self.first_ns, self.start_ns
        change(message)
        self.sessions.send(self.source, world.hash, 0)

    def announce_on(self):
        """Late joiners receive the session."""
        self.sessions.publisher.update_connections()

    def wait_for_monitor(self):
        followed = self.verdicts.wait_for(lambda v: v.session == self.source, LONGEST_S, self.announce_on)
        if followed is None:
            raise SystemExit("the monitor does not follow the session")
        # the log begins now
        return followed

    def send(self, change=None, until_s=None, stops=lambda verdict: False):
        """Sends the samples at their pace; `change(sample, seconds)` returns the messages to send instead, already
        sealed, or None for the sample as it is. Ends with the verdict for which `stops`, or None."""
        rows = self.verdicts.rows
        for sample in self.samples:
            seconds = (sample.log_time_ns - self.first_ns) * 1e-9
            if until_s is not None and seconds > until_s:
                return None
            while (left_ns := self.start_ns + int(seconds * 1e9) - time.monotonic_ns()) > 0:
                self.verdicts.reader.wait(min(left_ns * 1e-9, 0.002))
                for verdict in self.verdicts.take():
                    rows.append(verdict)
                    if stops(verdict):
                        return verdict
            copy = type(sample).from_buffer_copy(sample)
            if change is None or (instead := change(self, copy, seconds)) is None:
                self.writer.send(self.source, self.world.hash, copy.time_ns, copy)
            else:
                for message in instead:
                    self.writer.send_raw(message)
        return None

    def sealed(self, sample, time_ns=None):
        """The sample with the next head."""
        self.writer.seal(self.source, self.world.hash, sample.time_ns if time_ns is None else time_ns, sample)
        return sample

    def close(self):
        """Gives the services back: there is one writer."""
        for writer in (self.writer, self.sessions):
            writer.publisher.delete()
        self.verdicts.reader.subscriber.delete()
