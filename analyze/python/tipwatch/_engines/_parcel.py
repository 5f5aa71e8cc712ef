"""What a worker needs to analyse a log: the machine files, by content, the options, and how logs are read."""

from __future__ import annotations

import atexit
import hashlib
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from tipwatch import _tipwatch


@dataclass(frozen=True)
class Parcel:
    """The analyses of a fleet, to be sent to workers."""

    records: str
    kind: str
    file: str
    files: Mapping[str, bytes]
    options: Mapping[str, Any]
    reading: Mapping[str, Any]
    id: str

    @classmethod
    def of(
        cls,
        records: str,
        machine: str | PathLike[str] | None,
        fleet: str | PathLike[str] | None,
        options: Mapping[str, Any],
    ) -> Parcel:
        task = _tipwatch.FleetTask(records, machine=machine, fleet=fleet, **options)
        kind, file = ("machine", machine) if fleet is None else ("fleet", fleet)
        files = {str(path): Path(path).read_bytes() for path in task.files()}
        reading = _tipwatch.stated_read_options()
        content = [records, kind, str(file), *sorted(files), *map(repr, sorted({**options, **reading}.items()))]
        digest = hashlib.sha256("\0".join(content).encode())
        for path in sorted(files):
            digest.update(hashlib.sha256(files[path]).digest())
        return cls(records, kind, str(Path(file).absolute()), files, options, reading, digest.hexdigest())

    def open(self) -> _tipwatch.FleetTask:
        """The analyses on this worker. Machine files that are not the same at their paths here are unpacked."""
        if self.id not in _OPENED:
            root = "" if all(map(self._is_here, self.files)) else self._unpacked()
            _OPENED[self.id] = _tipwatch.FleetTask(self.records, **{self.kind: root + self.file}, **self.options)
        return _OPENED[self.id]

    def _is_here(self, path: str) -> bool:
        try:
            return Path(path).read_bytes() == self.files[path]
        except OSError:
            return False

    def _unpacked(self) -> str:
        root = tempfile.mkdtemp(prefix="tipwatch-")
        atexit.register(shutil.rmtree, root, ignore_errors=True)
        for path, content in self.files.items():
            target = Path(root + path)
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
        return root


_OPENED: dict[str, _tipwatch.FleetTask] = {}


def analyse(parcel: Parcel, log: str) -> tuple[str, str] | None:
    """Analyses a log on a worker; it writes the log's record. Returns kind and reason of a failure."""
    # a worker may serve several drivers, one after the other
    if _tipwatch.stated_read_options() != parcel.reading:
        _tipwatch.set_read_options(**parcel.reading)
    return parcel.open().run(log)
