"""Makes MF4 files with the layouts of several loggers, and lists what asammdf reads in them (requirements.txt).

    python make_mf4.py FOLDER

`layout_*.mf4` are written block by block, because asammdf writes sorted files with few types of channels only.
`layouts.txt` is what asammdf reads: file, time in nanoseconds, bus, kind, identifier, 29 bits, CAN FD, data.
"""

import pathlib
import struct
import sys
import zlib

import asammdf
import numpy as np

START = 1_700_000_000_000_000_000
FIXED, VARIABLE, MASTER, VIRTUAL_MASTER, MOST_LENGTH, VIRTUAL = 0, 1, 2, 3, 5, 6
UNSIGNED, UNSIGNED_BIG_ENDIAN, FLOAT, BYTES = 0, 1, 4, 10
KINDS = {"data": "CAN_DataFrame", "remote": "CAN_RemoteFrame", "error": "CAN_ErrorFrame"}


class Block:
    """A block whose links are other blocks, `None`, or functions that return one."""

    def __init__(self, kind, links=(), data=b""):
        self.kind, self.links, self.data, self.at = kind, list(links), data, None

    def size(self):
        return 24 + 8 * len(self.links) + len(self.data)


def text(string):
    raw = string.encode() + b"\0"
    return Block("TX", data=raw + b"\0" * (-len(raw) % 8))


def conversion(kind, values, texts=()):
    data = struct.pack("<BBHHHdd", kind, 0, 0, len(texts), len(values), 0, 0)
    data += struct.pack(f"<{len(values)}d", *values)
    return Block("CC", [None] * 4 + [text(t) for t in texts], data)


def constant(value):
    return conversion(1, [value, 0.0])


def source(name):
    return Block("SI", [text(name), text(name), None], struct.pack("<BBB5x", 2, 2, 0))


def channel(name, kind, data_type, byte, bits, sync=0, link=None, conv=None, parts=(), acquired=None):
    first = chain(parts)
    links = [None, first, text(name), acquired, conv, link, None, None]
    data = struct.pack("<BBBBIIIIBBH6d", kind, sync, data_type, 0, byte, bits, 0, 0, 0, 0, 0, *[0.0] * 6)
    return Block("CN", links, data)


def chain(blocks):
    for block, following in zip(blocks, blocks[1:]):
        block.links[0] = following
    return blocks[0] if blocks else None


def group(channels, record_id, cycles, size, flags=0, acquired=None):
    data = struct.pack("<QQHH4xII", record_id, cycles, flags, ord("."), *size)
    return Block("CG", [None, chain(channels), None, acquired, None, None], data)


def data_group(groups, data, id_bytes=0):
    return Block("DG", [None, chain(groups), data, None], struct.pack("<B7x", id_bytes))


def write(path, data_groups):
    header = Block("HD", [chain(data_groups)] + [None] * 5, struct.pack("<QhhBBB1xdd", START, 0, 0, 0, 0, 0, 0, 0))
    order, at = [], 64

    def place(block):
        nonlocal at
        while block is not None and block.at is None:
            block.at = at
            order.append(block)
            at += block.size() + -block.size() % 8
            for link in block.links[1:]:
                place(link)
            block = block.links[0] if block.links else None

    place(header)
    out = bytearray(struct.pack("<8s8s8s4xH30xHH", b"MDF     ", b"4.11    ", b"made    ", 411, 0, 0))
    for block in order:
        assert len(out) == block.at
        out += b"##" + block.kind.encode() + struct.pack("<4xQQ", block.size(), len(block.links))
        out += b"".join(struct.pack("<Q", link.at if link else 0) for link in block.links)
        out += block.data + b"\0" * (-block.size() % 8)
    path.write_bytes(out)


def deflated(kind, raw, width=0):
    if width:
        rows = len(raw) // width
        whole = np.frombuffer(raw[: rows * width], "u1").reshape(rows, width).T.tobytes()
        raw = whole + raw[rows * width :]
    packed = zlib.compress(raw)
    head = struct.pack("<2sBBIQQ", kind.encode(), 1 if width else 0, 0, width, len(raw), len(packed))
    return Block("DZ", data=head + packed)


def listed(blocks, sizes):
    offsets = [sum(sizes[:index]) for index in range(len(sizes))]
    data = struct.pack(f"<B3xI{len(sizes)}Q", 0, len(sizes), *offsets)
    lists = Block("DL", [None] + blocks, data)
    return Block("HL", [lists], struct.pack("<HB5x", 0, 0))


def frames(kind="data", count=12, bus=1, most=8, first=0):
    """Times, buses, identifiers and data that differ from frame to frame."""
    for i in range(first, first + count):
        length = {"data": [8, 3, 0, most][i % 4], "remote": 0, "error": 0}[kind]
        is_extended = i % 3 == 0
        identifier = 0x0CF02A21 + i if is_extended else 0x100 + i
        data = bytes((7 * i + j) & 255 for j in range(length))
        yield (i * 0.01 + bus * 0.001, bus, identifier, is_extended, length > 8, data)


def length_code(length):
    return length if length <= 8 else 9 + [12, 16, 20, 24, 32, 48, 64].index(length)


def parts(name, at, special=()):
    """Usual parts of a frame from byte `at` on, but for those in `special`: by name, a channel or `None`."""
    usual = {"BusChannel": 1, "ID": 4, "IDE": 1, "DLC": 1, "DataLength": 1, "EDL": 1}
    found, position = [], at
    for part, width in usual.items():
        of = special[part] if part in special else channel(f"{name}.{part}", FIXED, UNSIGNED, position, 8 * width)
        if of is not None:
            found.append(of)
        position += width
    return found, position


def record(frame):
    time, bus, identifier, is_extended, is_fd, data = frame
    fixed = struct.pack("<dBIBBBB", time, bus, identifier, is_extended, length_code(len(data)), len(data), is_fd)
    return fixed, data


def time_channel():
    return channel("Timestamp", MASTER, FLOAT, 0, 64, sync=1)


def simple(kind, special, record_id=0, size=0, flags=0, data=True, times=None, acquired=None, cycles=12, most=8):
    """A group whose frames have their data in the record."""
    name = KINDS[kind]
    inner, position = parts(name, 8, special)
    if data:
        of = special.get("DataBytes") or channel(f"{name}.DataBytes", FIXED, BYTES, position, 8 * most)
        inner.append(of)
        position += most
    whole = channel(name, FIXED, BYTES, 8, 8 * (position - 8), parts=inner)
    return group([times or time_channel(), whole], record_id, cycles, (position, 0), flags, acquired)


def fixed_records(of, most=8):
    return b"".join(head + data.ljust(most, b"\0") for head, data in map(record, of))


def virtual_bus(path):
    """A group for each bus, whose number is no part of the records but the result of a conversion."""
    conversions = [
        constant(1),
        conversion(1, [2.0, 0.0]),
        conversion(2, [0.0, 0.0, 3.0, 0.0, 0.0, 1.0]),
        conversion(4, [0.0, 4.0, 1.0, 4.0]),
    ]
    groups = []
    for bus, conv in enumerate(conversions, 1):
        special = {"BusChannel": channel("CAN_DataFrame.BusChannel", VIRTUAL, UNSIGNED, 0, 0, conv=conv)}
        if bus == 1:
            special["EDL"] = channel("CAN_DataFrame.EDL", VIRTUAL, UNSIGNED, 0, 0, conv=constant(0))
        raw = fixed_records(frames(bus=bus))
        groups.append(data_group([simple("data", special)], Block("DT", data=raw)))
    write(path, groups)


def virtual_time(path):
    """Times that follow from the index of the record, and numbers with the highest byte first."""
    time = channel("Timestamp", VIRTUAL_MASTER, FLOAT, 0, 0, sync=1, conv=conversion(1, [0.5, 0.01]))
    special = {"ID": channel("CAN_DataFrame.ID", FIXED, UNSIGNED_BIG_ENDIAN, 9, 32)}
    raw = b""
    for frame in frames(bus=2):
        head, data = record(frame)
        raw += head[:9] + head[9:13][::-1] + head[13:] + data.ljust(8, b"\0")
    write(path, [data_group([simple("data", special, times=time)], Block("DT", data=raw))])


def most_length(path):
    """Data of a most length, whose length another channel states; packed in two blocks that part a record."""
    length = channel("CAN_DataFrame.DataLength", FIXED, UNSIGNED, 15, 8)
    special = {
        "DataLength": length,
        "DataBytes": channel("CAN_DataFrame.DataBytes", MOST_LENGTH, BYTES, 17, 512, link=length),
    }
    raw = fixed_records(frames(most=64, count=16), 64)
    half = len(raw) // 2 + 5
    blocks = [deflated("DT", raw[:half], 81), deflated("DT", raw[half:])]
    data = listed(blocks, [half, len(raw) - half])
    write(path, [data_group([simple("data", special, cycles=16, most=64)], data)])


def variable_sorted(path):
    """Data of variable length in a block of their own, which is packed."""
    raw, values = b"", b""
    for frame in frames(most=24):
        head, data = record(frame)
        raw += head + struct.pack("<Q", len(values))
        values += struct.pack("<I", len(data)) + data
    link = deflated("SD", values)
    special = {"DataBytes": channel("CAN_DataFrame.DataBytes", VARIABLE, BYTES, 17, 64, link=link)}
    write(path, [data_group([simple("data", special)], Block("DT", data=raw))])


def variable_mixed(path):
    """Data frames with data of variable length, remote and error frames, mixed in one group as a logger writes them."""
    values = group([], 9, 12, (0, 0), flags=1)
    special = {"DataBytes": channel("CAN_DataFrame.DataBytes", VARIABLE, BYTES, 17, 64, link=values)}
    groups = [
        simple("data", special, record_id=1),
        simple("remote", {}, record_id=2, data=False, cycles=4),
        simple("error", {}, record_id=3, data=False, cycles=4),
        values,
    ]
    raw, position = b"", 0
    remote, error = list(frames("remote", 4, 2)), list(frames("error", 4, 3))
    for index, frame in enumerate(frames(most=64)):
        head, data = record(frame)
        raw += bytes([1]) + head + struct.pack("<Q", position)
        raw += bytes([9]) + struct.pack("<I", len(data)) + data
        position += 4 + len(data)
        if index % 3 == 0:
            raw += bytes([2]) + record(remote[index // 3])[0]
            raw += bytes([3]) + record(error[index // 3])[0]
    # the size of the values is stated in place of the size of their records
    values.data = struct.pack("<QQHH4xII", 9, 12, 1, ord("."), position, 0)
    write(path, [data_group(groups, Block("DT", data=raw), id_bytes=1)])


def sources(path):
    """Buses that only the sources of the groups or texts name, and CAN FD that only the length of the data shows."""
    groups = []
    for bus, special in [
        (1, channel("CAN_DataFrame.BusChannel", VIRTUAL, UNSIGNED, 0, 0, acquired=source("CAN1"))),
        (2, channel("CAN_DataFrame.BusChannel", VIRTUAL, UNSIGNED, 0, 0, conv=conversion(7, [], ["CAN2"]))),
    ]:
        raw = fixed_records(frames(bus=bus, most=12), 12)
        of = simple("data", {"BusChannel": special, "EDL": None}, most=12)
        groups.append(data_group([of], Block("DT", data=raw)))
    write(path, groups)


LAYOUTS = [virtual_bus, virtual_time, most_length, variable_sorted, variable_mixed, sources]


def read(path):
    """What asammdf reads, in the order of time. It reads the index of a record where a bus is named by its source."""
    found = []
    with asammdf.MDF(path) as mdf:
        for index, of in enumerate(mdf.groups):
            names = {c.name for c in of.channels}
            for kind, name in KINDS.items():
                if name not in names:
                    continue
                get = lambda part: mdf.get(f"{name}.{part}", group=index)
                times = get("ID").timestamps
                lengths = get("DataLength").samples
                is_fd = get("EDL").samples if f"{name}.EDL" in names else lengths > 8
                rows = zip(times, get("BusChannel").samples, get("ID").samples, get("IDE").samples, is_fd, lengths)
                data = get("DataBytes").samples if f"{name}.DataBytes" in names else None
                for row, (time, bus, identifier, is_extended, is_fd, length) in enumerate(rows):
                    raw = b"" if data is None else bytes(data[row])[: int(length)]
                    if path.stem == "layout_sources":
                        bus = int(bus.decode()[-1]) if isinstance(bus, bytes) else 1
                    if kind == "error":
                        identifier, is_extended = 0, 0
                    found.append((round(float(time) * 1e9), int(bus), kind, int(identifier), int(is_extended),
                                  int(is_fd), raw.hex()))
    return sorted(found)


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "layouts.txt", "w") as out:
        for layout in LAYOUTS:
            path = folder / f"layout_{layout.__name__}.mf4"
            layout(path)
            for time, bus, kind, identifier, is_extended, is_fd, data in read(path):
                out.write(f"{path.name} {time} {bus} {kind} {identifier:x} {is_extended} {is_fd} {data}\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
