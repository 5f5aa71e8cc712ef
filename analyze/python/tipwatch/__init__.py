"""Wheel loads and tip-over findings of wheeled machines with an arm, from their logs.

    import numpy as np, polars as pl, tipwatch as tw

    machine = tw.Machine("machine.toml")
    result = tw.analyze("drive.mcap", machine)
    samples = pl.DataFrame(result.samples)

    postures = np.tile(machine.zero_posture, (1000, 1))
    postures[:, machine.joint("boom")] = np.linspace(-1, 1, 1000)
    loads = machine.evaluate(postures).load  # N, shape (1000, wheels)

Frames follow REP-103: x forward, y left, z up. All numbers are in SI units; what cannot be computed is NaN in
arrays and null in tables.
"""

from pathlib import Path

from tipwatch import _processor

_processor.check(Path(__file__).parent)

from tipwatch import _tipwatch  # noqa: E402
from tipwatch._tipwatch import (  # noqa: E402
    Analysis,
    Column,
    Evaluation,
    Fleet,
    Identification,
    Machine,
    Table,
    TipwatchError,
    WhatIf,
    __version__,
    analyze,
    compare,
    identify,
    read,
    screen,
    set_read_options,
    whatif,
)

# results name this file, and not the interpreter, as the program that made them
_tipwatch.set_program(_tipwatch.__file__)

__all__ = [
    "Analysis",
    "Column",
    "Evaluation",
    "Fleet",
    "Identification",
    "Machine",
    "Table",
    "TipwatchError",
    "WhatIf",
    "__version__",
    "analyze",
    "compare",
    "identify",
    "read",
    "screen",
    "set_read_options",
    "whatif",
]
