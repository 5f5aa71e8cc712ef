"""Analyses of a fleet as tasks of an engine, one per log.

The driver hands out logs and hears how each ended. A worker writes the record of its log by itself, so a driver that
is killed loses nothing: the next one finds the records. A log whose worker is lost more often than allowed gets the
record of a typed failure from the driver. The data set is gathered at the end, and names every log without a record.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from os import PathLike
from pathlib import Path

from tipwatch import _tipwatch
from tipwatch._engines._parcel import Parcel
from tipwatch._errors import error

_ENGINES = {"ray": "ray", "dask": "dask[distributed]"}


def screen(
    runner: str,
    logs: Sequence[str | PathLike[str]],
    *,
    out: str | PathLike[str],
    machine: str | PathLike[str] | None,
    fleet: str | PathLike[str] | None,
    options: Mapping[str, object],
    resume: bool,
    jobs: int | None,
    judged: Mapping[str, object],
    retries: int,
    tell: Callable[[int, int], object] | None,
) -> _tipwatch.Fleet:
    """Analyses the logs on an engine; the arguments are those of ``tipwatch.screen``, ``options`` those of analyses,
    ``judged`` those of the data set."""
    if runner not in _ENGINES:
        raise error("value", f"expected runner 'threads', 'ray' or 'dask', found {runner!r}")
    try:
        engine = import_module(f"tipwatch._engines._{runner}")
    except ModuleNotFoundError as missing:
        package = _ENGINES[runner]
        text = f"expected the package {package} for runner {runner!r}, found none: pip install '{package}' ({missing})"
        raise error("package", text) from missing
    parcel = Parcel.of(_absolute(out), machine, fleet, options)
    task = parcel.open()
    known = task.records()
    if known and not resume:
        text = f"{out}: expected an empty folder, found {known} log{'s' * (known != 1)} of an earlier run; use resume=True to continue it"
        raise error("exists", text)
    all_logs = task.logs(logs)
    done = 0

    def finished(log: str, failure: tuple[str, str] | None) -> None:
        nonlocal done
        if failure is not None:
            task.fail(log, *failure)
        done += 1
        if tell is not None:
            tell(done, len(all_logs))

    if tell is not None:
        tell(0, len(all_logs))
    engine.run(parcel, all_logs, finished, in_flight=jobs, retries=retries)
    return task.gather(out, **judged)


def _absolute(out: str | PathLike[str]) -> str:
    """A URL as it is, a path from the root: workers have other working folders."""
    return str(out) if "://" in str(out) else str(Path(out).absolute())
