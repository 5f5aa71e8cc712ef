"""Types of the extension module."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Self, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Analysis",
    "Column",
    "Evaluation",
    "Fleet",
    "FleetTask",
    "Identification",
    "Machine",
    "Table",
    "TipwatchError",
    "WhatIf",
    "__processor__",
    "__version__",
    "analyze",
    "compare",
    "identify",
    "main",
    "read",
    "screen",
    "set_program",
    "set_read_options",
    "stated_read_options",
    "whatif",
]

__processor__: str
__version__: str

_Floats: TypeAlias = NDArray[np.float64]
_What: TypeAlias = Literal["loads", "indicators", "causes", "sigma", "parts", "gradient", "all"]

class TipwatchError(Exception):
    kind: Literal["not_found", "permission", "storage", "value", "log", "query", "error"]

@final
class Table:
    @property
    def columns(self) -> list[str]: ...
    @property
    def units(self) -> dict[str, str]: ...
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: str, /) -> Column: ...
    @overload
    def __getitem__(self, key: list[str] | tuple[str, ...] | slice, /) -> Table: ...
    def __contains__(self, name: str, /) -> bool: ...
    def head(self, n: int = 5) -> Table: ...
    def to_polars(self) -> Any: ...
    def to_arrow(self) -> Any: ...
    def to_pandas(self) -> Any: ...
    def _repr_html_(self) -> str: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

@final
class Column:
    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str | None: ...
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: int, /) -> Any: ...
    @overload
    def __getitem__(self, key: slice, /) -> Column: ...
    def __iter__(self) -> Iterator[Any]: ...
    def to_list(self) -> list[Any]: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

@final
class Evaluation:
    @property
    def names(self) -> list[str]: ...
    def describe(self, name: str) -> str: ...
    def columns(self, name: str) -> list[str]: ...
    def __getattr__(self, name: str) -> _Floats: ...

@final
class Machine:
    def __new__(
        cls, file: str | PathLike[str], urdf: str | PathLike[str] | None = None, accept_inertias: bool = False
    ) -> Self: ...
    @property
    def name(self) -> str: ...
    @property
    def gravity(self) -> float: ...
    @property
    def mass(self) -> float: ...
    @property
    def joints(self) -> list[str]: ...
    @property
    def joint_units(self) -> list[str]: ...
    @property
    def wheels(self) -> list[str]: ...
    @property
    def supports(self) -> list[str]: ...
    @property
    def edges(self) -> list[str]: ...
    def joint(self, name: str) -> int: ...
    def wheel(self, name: str) -> int: ...
    def edge(self, name: str) -> int: ...
    @property
    def zero_posture(self) -> _Floats: ...
    @property
    def joint_limits(self) -> _Floats: ...
    @property
    def static_load(self) -> _Floats: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def parameters(self) -> list[str]: ...
    @property
    def gradient_names(self) -> list[str]: ...
    def changed(self, changes: Mapping[str, float]) -> Machine: ...
    def standing_on(self, supports: Sequence[str]) -> Machine: ...
    @property
    def urdf(self) -> str: ...
    def link_poses(self, posture: ArrayLike | None = None) -> dict[str, _Floats]: ...
    def layout(self, posture: ArrayLike | None = None) -> dict[str, NDArray[Any]]: ...
    def draw(self, posture: ArrayLike | None = None, ax: Any = None) -> Any: ...
    def evaluate(
        self,
        positions: ArrayLike,
        rates: ArrayLike | None = None,
        accelerations: ArrayLike | None = None,
        *,
        specific_force: ArrayLike | None = None,
        up: ArrayLike | None = None,
        angular_velocity: ArrayLike | None = None,
        angular_acceleration: ArrayLike | None = None,
        tool_force: ArrayLike | None = None,
        tool_moment: ArrayLike | None = None,
        what: _What | Sequence[_What] | None = None,
        frame: Literal["base", "imu"] = "base",
    ) -> Evaluation: ...

@final
class Analysis:
    @property
    def samples(self) -> Table: ...
    @property
    def events(self) -> Table: ...
    @property
    def sensitivity(self) -> Table | None: ...
    @property
    def summary(self) -> dict[str, Any]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def valid_share(self) -> float | None: ...
    @property
    def files(self) -> list[Path]: ...
    def plot(self, start: float | None = None, end: float | None = None, ax: Any = None) -> Any: ...
    def _repr_html_(self) -> str: ...

def analyze(
    log: str | PathLike[str],
    machine: Machine | str | PathLike[str],
    *,
    out: str | PathLike[str] | None = None,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
    model: Literal["whole-body", "variable-inertia", "closed-form"] | None = None,
    closed_form_input: Literal["velocity", "accelerometer"] | None = None,
    apply_clock_offsets: Literal["stated", "estimated"] | None = None,
    quasi_static: Literal["auto", "always", "never"] | None = None,
    monte_carlo: int | None = None,
    parts: bool = False,
    terms: bool = False,
    precision: Literal[32, 64] = 64,
    columns: list[str] | None = None,
    progress: bool | Callable[[int], object] | None = None,
) -> Analysis: ...

@final
class Identification:
    @property
    def document(self) -> dict[str, Any]: ...
    @property
    def text(self) -> str: ...
    @property
    def holds(self) -> bool | None: ...
    @property
    def file(self) -> Path | None: ...

def identify(
    machine: Machine | str | PathLike[str],
    logs: Sequence[str | PathLike[str]] = (),
    *,
    level: float | None = None,
    widen_sigmas: float | None = None,
    out: str | PathLike[str] | None = None,
) -> Identification: ...

@final
class Fleet:
    @property
    def logs_uri(self) -> str: ...
    @property
    def events_uri(self) -> str: ...
    @property
    def logs(self) -> Table: ...
    @property
    def events(self) -> Table: ...
    def query(self, sql: str) -> Table: ...
    @property
    def totals(self) -> dict[str, Any]: ...
    @property
    def undecided(self) -> list[tuple[str, str]]: ...
    @property
    def page(self) -> Path | str | None: ...

@final
class WhatIf:
    @property
    def samples(self) -> Table: ...
    @property
    def summary(self) -> dict[str, Any]: ...
    @property
    def findings(self) -> list[str]: ...

def read(
    log: str | PathLike[str],
    machine: Machine | str | PathLike[str],
    *,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
) -> Table: ...

@final
class FleetTask:
    def __new__(
        cls,
        records: str | PathLike[str],
        *,
        machine: str | PathLike[str] | None = None,
        fleet: str | PathLike[str] | None = None,
        rate: float | None = None,
        estimator: Literal["smoother", "causal"] | None = None,
        model: Literal["whole-body", "variable-inertia", "closed-form"] | None = None,
        closed_form_input: Literal["velocity", "accelerometer"] | None = None,
        apply_clock_offsets: Literal["stated", "estimated"] | None = None,
        quasi_static: Literal["auto", "always", "never"] | None = None,
        accept_inertias: bool = False,
        reports: Literal["none", "events", "all"] | None = None,
    ) -> Self: ...
    def files(self) -> list[Path]: ...
    def logs(self, logs: Sequence[str | PathLike[str]]) -> list[tuple[str, int]]: ...
    def records(self) -> int: ...
    def run(self, log: str | PathLike[str]) -> tuple[str, str] | None: ...
    def fail(self, log: str | PathLike[str], kind: str, reason: str) -> None: ...
    def gather(
        self,
        out: str | PathLike[str],
        logs: Sequence[str | PathLike[str]],
        min_valid: float | None,
        policy: str | PathLike[str] | None,
        fail_on: str | Sequence[str] | None,
        prune: bool,
    ) -> Fleet: ...

def screen(
    logs: str | PathLike[str] | Sequence[str | PathLike[str]] = (),
    *,
    out: str | PathLike[str] | None = None,
    machine: Machine | str | PathLike[str] | None = None,
    fleet: str | PathLike[str] | None = None,
    accept_inertias: bool = False,
    resume: bool = False,
    jobs: int | None = None,
    rate: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
    model: Literal["whole-body", "variable-inertia", "closed-form"] | None = None,
    closed_form_input: Literal["velocity", "accelerometer"] | None = None,
    apply_clock_offsets: Literal["stated", "estimated"] | None = None,
    quasi_static: Literal["auto", "always", "never"] | None = None,
    min_valid: float | None = None,
    policy: str | PathLike[str] | None = None,
    fail_on: str | Sequence[str] | None = None,
    prune: bool = False,
    reports: Literal["none", "events", "all"] | None = None,
    memory: float | None = None,
    shard: str | None = None,
    records: str | PathLike[str] | None = None,
    attempts: int | None = None,
    gather: bool | str | PathLike[str] = False,
    progress: bool | Callable[[int, int], object] | None = None,
    runner: Literal["threads", "ray", "dask"] = "threads",
    retries: int = 2,
) -> Fleet: ...

def compare(
    a: str | PathLike[str],
    b: str | PathLike[str],
    *,
    machine: Machine | str | PathLike[str] | None = None,
    machine_b: Machine | str | PathLike[str] | None = None,
    rate: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
    model: Literal["whole-body", "variable-inertia", "closed-form"] | None = None,
) -> dict[str, Any]: ...

def whatif(
    log: str | PathLike[str],
    machine: Machine | str | PathLike[str],
    *,
    suspension: Literal["look-ahead", "literal", "locked", "recorded"] | None = None,
    step: float | None = None,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
    out: str | PathLike[str] | None = None,
) -> WhatIf: ...

def set_read_options(
    *,
    time_column: str | None = None,
    time_unit: Literal["s", "ms", "us", "ns", "days"] | None = None,
    date_order: Literal["dmy", "mdy", "ymd"] | None = None,
    header: bool = True,
    definitions: Sequence[str | PathLike[str]] = (),
    fetch_whole: bool = False,
) -> None: ...
def stated_read_options() -> dict[str, Any]: ...
def set_program(file: str | PathLike[str]) -> None: ...
def main(arguments: Sequence[str]) -> int: ...
