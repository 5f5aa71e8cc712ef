"""Errors of tipwatch that are also errors of Python: who catches FileNotFoundError catches them, too."""

from __future__ import annotations

from tipwatch._tipwatch import TipwatchError


class TipwatchNotFoundError(TipwatchError, FileNotFoundError):
    """A file, folder or object is not there."""


class TipwatchExistsError(TipwatchError, FileExistsError):
    """A folder has something already."""


class TipwatchPermissionError(TipwatchError, PermissionError):
    """A file, folder or object may not be read or written."""


class TipwatchValueError(TipwatchError, ValueError):
    """An argument has a value that it cannot have."""


class TipwatchLogError(TipwatchError, ValueError):
    """A file or folder is not a log, or one that cannot be read."""


class TipwatchMachineError(TipwatchError, ValueError):
    """A machine file is not valid, or does not fit the log."""


class TipwatchQueryError(TipwatchError, ValueError):
    """A query is not valid, or names what the data set does not have."""


class TipwatchPackageError(TipwatchError, ImportError):
    """A package is not installed."""


_CLASSES = {
    "not_found": TipwatchNotFoundError,
    "exists": TipwatchExistsError,
    "permission": TipwatchPermissionError,
    "value": TipwatchValueError,
    "log": TipwatchLogError,
    "machine": TipwatchMachineError,
    "query": TipwatchQueryError,
    "package": TipwatchPackageError,
}


def error(kind: str, text: str) -> TipwatchError:
    """The error of a kind; its ``kind`` tells programs what the text tells people."""
    made = _CLASSES.get(kind, TipwatchError)(text)
    made.kind = kind
    return made
