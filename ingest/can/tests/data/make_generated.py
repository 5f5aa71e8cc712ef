"""Makes DBC files at random with cantools, frames for them, and their values by cantools (requirements.txt).

    python make_generated.py FOLDER SEED...

`generated_SEED.dbc` has nested multiplexers, long names and units in code page 1252, as cantools writes them;
`generated_SEED.log` is a candump of its messages with random contents; `generated_SEED.csv` has the values by cantools:
frame, message, signal, value in the DBC file's unit.
"""

import pathlib
import random
import sys

from cantools.database import conversion
from cantools.database.can import Database, Message, Signal

UNITS = ["", "deg", "°", "°/s", "µm", "m/s²", "bar", "%", "kN"]
WORDS = ["Boom", "Angle", "Cylinder", "Pressure", "Chassis", "Inclination", "Hydraulic", "Temperature", "Left", "Right"]


def name(rng, taken, words):
    while True:
        found = "".join(rng.choice(WORDS) for _ in range(words))
        words = max(words, 2)
        if found not in taken:
            taken.add(found)
            return found


def signal(rng, taken, start, length, **multiplexing):
    converted = conversion.BaseConversion.factory(scale=rng.choice([1, 0.5, 0.01, 2]), offset=rng.choice([0, -40, 3]))
    if multiplexing.get("is_multiplexer"):
        converted = conversion.IdentityConversion(is_float=False)
    return Signal(
        name(rng, taken, rng.choice([1, 2, 2, 5])),
        start,
        length,
        byte_order="little_endian",
        is_signed=not multiplexing.get("is_multiplexer") and rng.random() < 0.5,
        conversion=converted,
        unit=rng.choice(UNITS),
        **multiplexing,
    )


def tree(rng, taken, start, parent, depth):
    """A multiplexer of four bits, and signals or further multiplexers for some of its values."""
    of = {} if parent is None else dict(multiplexer_signal=parent[0], multiplexer_ids=parent[1])
    root = signal(rng, taken, start, 4, is_multiplexer=True, **of)
    signals = [root]
    values = rng.sample(range(16), 9)
    for _ in range(3):
        ids, values = sorted(values[:3]), values[3:]
        if depth > 0 and rng.random() < 0.5:
            signals += tree(rng, taken, start + 4, (root.name, ids), depth - 1)
        else:
            signals.append(signal(rng, taken, 16, rng.choice([8, 12, 16, 32]), multiplexer_signal=root.name,
                                  multiplexer_ids=ids))
    return signals


def message(rng, number, taken):
    own = set()
    if rng.random() < 0.7:
        signals = tree(rng, own, 0, None, 2)
    else:
        signals = [signal(rng, own, at, 16) for at in (0, 16, 32)]
    signals.append(signal(rng, own, 48, 16))
    is_extended = rng.random() < 0.3
    frame_id = (0x10000000 if is_extended else 0x100) + number
    return Message(frame_id, name(rng, taken, rng.choice([2, 5])), 8, signals, is_extended_frame=is_extended)


def make(folder, seed):
    rng = random.Random(seed)
    taken = set()
    written = Database([message(rng, number, taken) for number in range(4)])
    # what cantools reads back lacks signals whose multiplexer has a long name
    (folder / f"generated_{seed}.dbc").write_bytes(written.as_dbc_string(sort_signals=None).encode("cp1252"))
    log = open(folder / f"generated_{seed}.log", "w")
    values = open(folder / f"generated_{seed}.csv", "w")
    with log, values:
        for index in range(40):
            of = written.messages[index % len(written.messages)]
            data = rng.randbytes(8)
            digits = f"{of.frame_id:08X}" if of.is_extended_frame else f"{of.frame_id:03X}"
            log.write(f"({1_700_000_000 + index / 64:.6f}) can0 {digits}#{data.hex().upper()}\n")
            for signal, value in selected(of.signal_tree, of, data).items():
                values.write(f"{index},{of.name},{signal},{float(value)!r}\n")


def selected(nodes, of, data):
    """The values of the signals that the multiplexers select, also where a multiplexer selects none."""
    found = {}
    for node in nodes:
        name = node if isinstance(node, str) else next(iter(node))
        signal = of.get_signal_by_name(name)
        raw = int.from_bytes(data, "little") >> signal.start & (1 << signal.length) - 1
        if signal.is_signed and raw >> signal.length - 1:
            raw -= 1 << signal.length
        found[name] = signal.conversion.raw_to_scaled(raw)
        if not isinstance(node, str):
            found.update(selected(node[name].get(raw, []), of, data))
    return found


if __name__ == "__main__":
    target = pathlib.Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for seed in sys.argv[2:]:
        make(target, int(seed))
