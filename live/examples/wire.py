"""The wire of tipwatch-live for Python: everything comes from live/include/tipwatch_live.h.

Structures, services and the numbers of enumerations are read from the header, so that there is one description of the wire.
Needs the package iceoryx2 0.10.
"""

import argparse
import ctypes
import pathlib
import re
import time
import zlib

import iceoryx2 as iox2

HEADER = pathlib.Path(__file__).parent.parent / "include" / "tipwatch_live.h"
C_TYPES = {
    "uint8_t": ctypes.c_uint8,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "int64_t": ctypes.c_int64,
    "double": ctypes.c_double,
}


class Header:
    """What the header declares: `numbers`, `texts`, `messages` (types) and `enums` (names by number or bit)."""

    def __init__(self, path=HEADER):
        text = re.sub(r"/\*.*?\*/", "", path.read_text(), flags=re.S)
        self.numbers = {n: int(v) for n, v in re.findall(r"#define TIPWATCH_(\w+) UINT64_C\((\d+)\)", text)}
        self.texts = dict(re.findall(r'#define TIPWATCH_(\w+) "([^"]*)"', text))
        self.messages, self.enums = {}, {}
        for name, body in re.findall(r"enum tipwatch_(\w+) \{(.*?)\};", text, flags=re.S):
            entries = re.findall(rf"TIPWATCH_{name.upper()}_(\w+) = (1 << )?(\d+),", body)
            values = {(1 << int(n)) if shift else int(n): entry.lower() for entry, shift, n in entries}
            self.enums[name] = values
        for name, body in re.findall(r"struct tipwatch_(\w+) \{(.*?)\};", text, flags=re.S):
            fields = []
            for c_type, field, dimensions in re.findall(r"(\w+) (\w+)((?:\[\d+\])*);", body):
                field_type = C_TYPES[c_type]
                for n in reversed(re.findall(r"\d+", dimensions)):
                    field_type = field_type * int(n)
                fields.append((field, field_type))
            type_name = staticmethod(lambda of=self.texts[f"{name.upper()}_TYPE"]: of)
            self.messages[name] = type(name, (ctypes.Structure,), {"_fields_": fields, "type_name": type_name})

    def number(self, enum, name):
        """The number, or the mask, of this name."""
        return next(number for number, known in self.enums[enum].items() if known == name)

    def names(self, enum, bits):
        """The names of a set; "bit N" for one that the header does not know."""
        known = self.enums[enum]
        return [known.get(1 << n, f"bit {n}") for n in range(32) if bits >> n & 1]

    def hash(self, parts):
        """FNV-1a over bytes, each followed by its length, and over numbers."""
        hashed, prime = self.numbers["HASH_START"], self.numbers["HASH_PRIME"]
        for part in parts:
            data = part.to_bytes(8, "little") if isinstance(part, int) else part + len(part).to_bytes(8, "little")
            for byte in data:
                hashed = (hashed ^ byte) * prime % 2**64
        return hashed

    def layout(self, kind):
        """The layout of a message, computed from the structure."""
        message = self.messages[kind]
        fields = ((name, getattr(message, name)) for name, _ in message._fields_)
        return self.hash(x for name, field in fields for x in (name.encode(), field.offset, field.size))

    def wrong_with(self, message):
        """What is wrong with a message: "magic", "checksum" or None."""
        if message.magic != self.numbers["MAGIC"]:
            return "magic"
        return None if message.checksum == checksum(message) else "checksum"


def checksum(message):
    """CRC-32 of all bytes before the checksum, which is the last field."""
    return zlib.crc32(bytes(message)[:-8])


class Node:
    """A process in the shared memory, and its ends of the services."""

    def __init__(self, header, role, service=None, prefix=None):
        iox2.set_log_level(iox2.LogLevel.Error)
        config = iox2.config.default()
        if prefix:
            config.global_cfg.prefix = iox2.FileName.new(prefix)
        self.header = header
        self.service = service or header.texts["DEFAULT_SERVICE"]
        builder = iox2.NodeBuilder.new().config(config).name(iox2.NodeName.new(role))
        self.node = builder.create(iox2.ServiceType.Ipc)

    def builder(self, kind):
        name = self.service + self.header.texts[f"{kind.upper()}_SERVICE"]
        return self.node.service_builder(iox2.ServiceName.new(name))

    def messages(self, kind):
        """The publish-subscribe service, with the settings that all ends state."""
        texts, numbers, upper = self.header.texts, self.header.numbers, kind.upper()
        attribute = iox2.AttributeVerifier.new().require(
            iox2.AttributeKey.new(texts["LAYOUT_ATTRIBUTE"]),
            iox2.AttributeValue.new(texts[f"{upper}_LAYOUT"]),
        )
        service = (
            self.builder(kind)
            .publish_subscribe(self.header.messages[kind])
            .enable_safe_overflow(bool(numbers["SAFE_OVERFLOW"]))
            .history_size(numbers[f"{upper}_HISTORY"])
            .subscriber_max_buffer_size(numbers[f"{upper}_BUFFER"])
            .subscriber_max_borrowed_samples(numbers["MAX_BORROWED"])
            .max_publishers(numbers[f"{upper}_WRITERS"])
            .max_subscribers(numbers["MAX_READERS"])
            .max_nodes(numbers["MAX_NODES"])
            .open_or_create_with_attributes(attribute)
        )
        self.leave_places(kind, "programs", len(service.nodes) - 1, numbers["MAX_NODES"])
        return service

    def leave_places(self, kind, what, taken, most):
        """The last places are kept for monitor, control, recorder and acknowledgement."""
        free = most - self.header.numbers["RESERVED_READERS"]
        if taken >= free:
            found = f"expected fewer than {free} {what}, found {taken}; the other places are kept"
            raise RuntimeError(f"{self.service} {kind}: {found}")

    def events(self, kind):
        """The event service of the same name; None if there is none."""
        numbers = self.header.numbers
        if not numbers[f"{kind.upper()}_EVENTS"]:
            return None
        events = self.builder(kind).event().max_listeners(numbers["EVENT_LISTENERS"])
        events = events.max_notifiers(numbers["EVENT_NOTIFIERS"]).max_nodes(numbers["EVENT_NODES"])
        return events.open_or_create()


class Writer:
    """Seals and sends messages of one kind, and wakes their readers. Never waits: queues overwrite."""

    def __init__(self, node, kind):
        self.header = node.header
        self.message = self.header.messages[kind]()
        self.service = node.messages(kind)
        writers = node.header.numbers[f"{kind.upper()}_WRITERS"]
        if writers > 1:
            node.leave_places(kind, "writers", self.service.dynamic_config.number_of_publishers, writers)
        self.publisher = self.service.publisher_builder().create()
        self.events = node.events(kind)
        self.notifier = self.events and self.events.notifier_builder().create()
        self.sequence = 0

    def seal(self, source, machine_hash, time_ns, message=None):
        """Gives the message its head and checksum."""
        message = self.message if message is None else message
        message.magic = self.header.numbers["MAGIC"]
        message.sequence = self.sequence
        message.source = source
        message.machine_hash = machine_hash
        message.time_ns = time_ns
        message.published_ns = time.monotonic_ns()
        message.checksum = checksum(message)
        self.sequence += 1

    def send_raw(self, message=None):
        """Sends a message as it is."""
        self.publisher.send_copy(self.message if message is None else message)
        if self.notifier:
            self.notifier.notify()

    def send(self, source, machine_hash, time_ns, message=None):
        """Seals and sends."""
        self.seal(source, machine_hash, time_ns, message)
        self.send_raw(message)


class Reader:
    """Reads messages of one kind, and waits for them."""

    def __init__(self, node, kind, listens=False):
        self.kind = node.header.messages[kind]
        self.service = node.messages(kind)
        readers = self.service.dynamic_config.number_of_subscribers
        node.leave_places(kind, "readers", readers, node.header.numbers["MAX_READERS"])
        size = node.header.numbers[f"{kind.upper()}_BUFFER"]
        self.subscriber = self.service.subscriber_builder().buffer_size(size).create()
        self.events = node.events(kind) if listens else None
        self.listener = self.events and self.events.listener_builder().create()

    def receive(self):
        """A copy of the next message; None if none waits."""
        sample = self.subscriber.receive()
        if sample is None:
            return None
        message = self.kind.from_buffer_copy(sample.payload().contents)
        sample.delete()
        return message

    def wait(self, seconds):
        """Waits for a notification, but no longer than this."""
        if self.listener:
            self.listener.timed_wait(iox2.Duration.from_nanos(int(seconds * 1e9)))
        else:
            time.sleep(min(seconds, 0.001))


def example_arguments(documentation, **numbers):
    """The command line of an example: the machine, its service, how long the example runs, and other numbers with their defaults."""
    arguments = argparse.ArgumentParser(description=documentation.splitlines()[0])
    arguments.add_argument("machine", type=pathlib.Path)
    arguments.add_argument("urdf", type=pathlib.Path)
    arguments.add_argument("--service", default=None)
    arguments.add_argument("--prefix", default=None)
    for name, default in {"seconds": 10.0, **numbers}.items():
        arguments.add_argument(f"--{name}", type=float, default=default)
    return arguments.parse_args()
