"""Progress bars on standard error: tqdm if installed, else rich, else none."""

from __future__ import annotations

import os
from pathlib import Path


class _Bar:
    """A bar of ``total`` units; ``total`` may become known later."""

    def __init__(self, label: str, unit: str, total: int | None) -> None:
        self._label, self._unit, self._total, self._done = label, unit, total, 0
        self._tqdm = self._rich = None
        try:
            from tqdm.auto import tqdm
        except ImportError:
            self._open_rich()
        else:
            of_bytes = {"unit_scale": True, "unit_divisor": 1024} if unit == "B" else {}
            self._tqdm = tqdm(total=total, desc=label, unit=unit, **of_bytes)

    def _open_rich(self) -> None:
        try:
            from rich.console import Console
            from rich.progress import Progress
        except ImportError:
            return
        self._rich = Progress(console=Console(stderr=True))
        self._task = self._rich.add_task(self._label, total=self._total)
        self._rich.start()

    def _show(self, done: int, total: int | None = None) -> None:
        if total is not None:
            self._total = total
        done = done if self._total is None else min(done, self._total)
        if self._tqdm is not None:
            self._tqdm.total = self._total
            self._tqdm.update(done - self._done)
        if self._rich is not None:
            self._rich.update(self._task, completed=done, total=self._total)
        self._done = done

    def end(self, is_done: bool) -> None:
        """Closes the bar, full if the call is done."""
        if is_done and self._total is not None:
            self._show(self._total)
        if self._tqdm is not None:
            self._tqdm.close()
        if self._rich is not None:
            self._rich.stop()


class Log(_Bar):
    """Bytes read of a log: a file, or a folder of files."""

    def __init__(self, log: str | os.PathLike[str]) -> None:
        super().__init__(f"analyze {Path(log).name}", "B", _bytes(Path(log)))

    def __call__(self, read: int) -> None:
        self._show(read)


class Logs(_Bar):
    """Finished logs of many."""

    def __init__(self) -> None:
        super().__init__("screen", "log", None)

    def __call__(self, done: int, logs: int) -> None:
        # the number of logs is known once all folders are listed
        self._show(done, logs or None)


def _bytes(log: Path) -> int | None:
    """Bytes of a file or of the files of a folder; None if there is no such log, which the call itself reports."""
    try:
        if log.is_dir():
            return sum(file.stat().st_size for file in log.iterdir() if file.is_file())
        return log.stat().st_size
    except OSError:
        return None
