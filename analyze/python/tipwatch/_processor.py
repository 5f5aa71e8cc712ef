"""Whether the processor has the instructions that the library was compiled for.

Without them the first of these instructions would end the interpreter with SIGILL and no word, so this is checked before
the library is loaded. The file itself says what it was compiled for.
"""

from __future__ import annotations

import mmap
import platform
import re
from pathlib import Path

# as /proc/cpuinfo names them: "abm" has LZCNT
_V3 = frozenset("abm avx avx2 bmi1 bmi2 f16c fma movbe xsave".split())
_V4 = _V3 | frozenset("avx512f avx512bw avx512cd avx512dq avx512vl".split())
_LEVELS = {"x86-64-v3": _V3, "x86-64-v4": _V4}


def check(package: Path, cpuinfo: Path = Path("/proc/cpuinfo")) -> None:
    """Raises ImportError if this processor lacks what the library of the package needs."""
    if platform.machine() not in ("x86_64", "AMD64"):
        return
    try:
        flags = re.search(r"^flags\s*:(.*)$", cpuinfo.read_text(), re.MULTILINE)
    except OSError:
        flags = None
    # where the system does not tell what the processor has, nothing can be said
    has = frozenset(flags[1].split()) if flags else _V4
    if has >= _V4:
        return
    for library in sorted(package.glob("_tipwatch.*")):
        level = _built_for(library) if library.suffix in (".so", ".pyd") else None
        missing = sorted(_LEVELS.get(level, frozenset()) - has)
        if missing:
            raise ImportError(
                f"{library}: expected a processor of the level {level}, found one without {', '.join(missing)}; build the "
                "package for it: RUSTFLAGS='' pip install ./analyze/python",
                name="tipwatch._tipwatch",
                path=str(library),
            )


def _built_for(library: Path) -> str | None:
    with library.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        found = re.search(rb"tipwatch-is-built-for:([a-z0-9-]+);", content)
        return found[1].decode() if found else None
