"""Types of the extension module."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
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
_Places: TypeAlias = str | PathLike[str] | Iterable[str | PathLike[str]]
_What: TypeAlias = Literal["loads", "indicators", "causes", "sigma", "parts", "gradient", "all"]

class TipwatchError(Exception):
    """What tipwatch expected, what it found and where. `kind` is "not_found", "exists", "permission", "storage", "value", "log" (not a log), "machine" (no valid machine, or none of this log), "query" (SQL that has no answer), "package" (one that is not installed) or "error". The first is also a FileNotFoundError, the second a FileExistsError, the third a PermissionError, "package" an ImportError; "value", "log", "machine" and "query" are also a ValueError."""
    kind: Literal[
        "not_found", "exists", "permission", "storage", "value", "log", "machine", "query", "package", "error"
    ]

@final
class Table:
    """A table: columns of equal length with names and units.

    ``table["load_fl"]`` is one column, ``table[["time_ns", "load_fl"]]`` a table of two, ``table[:100]`` one of its first
    rows; ``to_polars()``, ``to_arrow()`` and ``to_pandas()`` make the table of a library. polars, pyarrow and DuckDB take its
    numbers without copying, by the Arrow PyCapsule interface (``polars.DataFrame(table)``); pandas copies."""
    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
    @property
    def units(self) -> dict[str, str]:
        """Units of the columns that have one, by name."""
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: str, /) -> Column: ...
    @overload
    def __getitem__(self, key: list[str] | tuple[str, ...] | slice, /) -> Table: ...
    def __contains__(self, name: str, /) -> bool: ...
    def head(self, n: int = 5) -> Table:
        """The first ``n`` rows.

        Raises
        ------
        TipwatchError
            ``n`` is negative."""
    def to_polars(self) -> Any:
        """As ``polars.DataFrame``: numbers without a copy."""
    def to_arrow(self) -> Any:
        """As ``pyarrow.Table``: numbers without a copy."""
    def to_pandas(self) -> Any:
        """As ``pandas.DataFrame``, by pyarrow; pandas copies the values."""
    def _repr_html_(self) -> str: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...

@final
class Column:
    """One column of a table: ``numpy.asarray(table["load_fl"])``. ``column[0]`` is its first value, ``column[-1]`` its last one,
    ``column[10:20]`` a part of it; a loop goes over its values.

    NumPy gets an array in which NaN is what is missing: read-only and without a copy where the column has numbers of 64 or
    32 bits in one chunk and none is missing, else a copy. polars and pyarrow take it as a series or an array
    (``polars.Series(column)``), several chunks joined to one."""
    @property
    def name(self) -> str:
        """Its name."""
    @property
    def unit(self) -> str | None:
        """Its unit; None for what has none."""
    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, key: int, /) -> Any: ...
    @overload
    def __getitem__(self, key: slice, /) -> Column: ...
    def __iter__(self) -> Iterator[Any]: ...
    def to_list(self) -> list[Any]:
        """The values in a list; None is what is missing."""
    def _repr_html_(self) -> str: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray: ...
    def __arrow_c_array__(self, requested_schema: object | None = None) -> tuple[object, object]: ...

@final
class Evaluation:
    """Results of ``Machine.evaluate``: one array per quantity, rows first.

    ``load`` has the shape (rows, wheels), ``itom`` (rows, edges), ``cause`` (rows, causes, wheels), ``zmp_margin``
    (rows,). ``names`` lists them, ``describe(name)`` gives meaning and unit. What cannot be computed is NaN."""
    @property
    def names(self) -> list[str]:
        """Names of the arrays."""
    def describe(self, name: str) -> str:
        """Meaning, unit and shape of an array."""
    def columns(self, name: str) -> list[str]:
        """Names of the columns of ``samples.parquet`` that hold the same numbers, in the order of the array's last
        axes."""
    def __getattr__(self, name: str) -> _Floats: ...

@final
class Machine:
    """A machine, from its machine file and URDF.

    Parameters
    ----------
    file : path
        The machine file (TOML).
    urdf : path, optional
        The URDF, for a machine file that names none.
    accept_inertias : bool
        Inertias of the URDF that no body can have are replaced, with their uncertainty, instead of refused; as
        ``accept_inertias = true`` in the machine file.

    Raises
    ------
    TipwatchError
        The files do not describe a valid machine: what was expected, what was found and where."""
    def __new__(
        cls, file: str | PathLike[str], urdf: str | PathLike[str] | None = None, accept_inertias: bool = False
    ) -> Self: ...
    @property
    def name(self) -> str:
        """Name of the machine."""
    @property
    def gravity(self) -> float:
        """Gravitational acceleration (m/s^2)."""
    @property
    def mass(self) -> float:
        """Mass (kg), with the payloads that are always attached."""
    @property
    def joints(self) -> list[str]:
        """Names of the joints, in the order of every posture."""
    @property
    def joint_units(self) -> list[str]:
        """Units of the joints' positions: "rad" or "m"."""
    @property
    def wheels(self) -> list[str]:
        """Names of the wheels, in the order of every array by wheel."""
    @property
    def supports(self) -> list[str]:
        """Names of all wheels and supports, those off the ground included: ``wheels`` are the ones that it stands on."""
    @property
    def edges(self) -> list[str]:
        """Names of the edges of the support polygon, in the order of every array by edge."""
    def joint(self, name: str) -> int:
        """Place of a joint in a posture."""
    def wheel(self, name: str) -> int:
        """Place of a wheel in the arrays by wheel."""
    def edge(self, name: str) -> int:
        """Place of an edge in the arrays by edge."""
    @property
    def zero_posture(self) -> _Floats:
        """All joints at zero, or at the limit next to zero (rad or m): shape (joints,)."""
    @property
    def joint_limits(self) -> _Floats:
        """Smallest and largest position of each joint (rad or m); NaN where the URDF states none: shape (joints, 2)."""
    @property
    def static_load(self) -> _Floats:
        """Loads of the wheels (N) at rest on level ground in the reference posture, shape (wheels,); they define the
        utilisation.

        Raises
        ------
        TipwatchError
            A wheel carries nothing in that posture."""
    @property
    def notes(self) -> list[str]:
        """Peculiarities that are not errors, one sentence each."""
    @property
    def parameters(self) -> list[str]:
        """Names of the parameters that ``changed`` takes, as "boom.mass"."""
    @property
    def gradient_names(self) -> list[str]:
        """Names of everything that the loads depend on, signals first: the last axis of
        ``Evaluation.load_gradient``."""
    def changed(self, changes: Mapping[str, float]) -> Machine:
        """This machine with each parameter changed by an amount in its SI unit:
        ``machine.changed({"boom.mass": +50.0})``. It is for ``evaluate`` and ``draw``: analyses read machine files,
        and refuse it.

        Raises
        ------
        TipwatchError
            There is no such parameter, or an amount is not finite."""
    def standing_on(self, supports: Sequence[str]) -> Machine:
        """This machine on other supports: on its outriggers, or with a wheel in the air. Their parameters are those of the
        machine file. It is for ``evaluate`` and ``draw``: analyses find the supports in the log.

        Parameters
        ----------
        supports : sequence of str
            Names out of ``supports``; the order does not matter.

        Raises
        ------
        TipwatchError
            There is no such support, the machine cannot stand on these, or it was changed before: use ``changed`` on the
            result."""
    @property
    def urdf(self) -> str:
        """The text of the URDF.

        Raises
        ------
        TipwatchError
            Its file cannot be read any more."""
    def link_poses(self, posture: ArrayLike | None = None) -> dict[str, _Floats]:
        """Pose of every link's frame in the base frame, by the link's name: arrays of shape (4, 4), translation in m.

        Parameters
        ----------
        posture : array, shape (joints,), optional
            Joint positions (rad or m); ``zero_posture`` if not given.

        Raises
        ------
        TipwatchError
            The array has the wrong shape or is not finite, or a linkage cannot close."""
    def layout(self, posture: ArrayLike | None = None) -> dict[str, NDArray[Any]]:
        """Wheels, support polygon and centre of mass at rest on level ground, in the base frame (m).

        Parameters
        ----------
        posture : array, shape (joints,), optional
            Joint positions (rad or m); ``zero_posture`` if not given.

        Returns
        -------
        dict
            ``wheel_centres`` and ``contacts`` (wheels, 3), ``wheel_radii`` (wheels,), ``edges`` (edges, 2): the
            wheels at both ends of an edge of the support polygon; ``normal`` (3,): unit normal of the contact plane,
            up; ``centre_of_mass`` (3,), payloads without a time limit included; ``arm`` (2 segments, 3): start and
            end of each segment of the arm in turn.

        Raises
        ------
        TipwatchError
            As in ``link_poses``."""
    def draw(self, posture: ArrayLike | None = None, ax: Any = None) -> Any:
        """Draws the machine in a posture, from the right and from above: boxes, cylinders and spheres of the URDF,
        lines between links, wheels, support polygon and centre of mass. Meshes are not drawn. Needs matplotlib.

        Parameters
        ----------
        posture : array, shape (joints,), optional
            Joint positions (rad or m); ``zero_posture`` if not given.
        ax : pair of matplotlib axes, optional
            Axes for the view from the right and for that from above; a new figure if not given.

        Returns
        -------
        matplotlib.figure.Figure
            The figure; ``machine.draw().savefig("machine.png")`` saves it. Of given axes it is theirs.

        Raises
        ------
        ImportError
            matplotlib is not installed.
        TipwatchError
            As in ``link_poses``."""
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
        what: _What | Iterable[_What] | None = None,
        frame: Literal["base", "imu"] = "base",
    ) -> Evaluation:
        """Wheel loads and stability of many postures, on all cores, without the interpreter's lock.

        Every input has one row per posture, or one row for all of them. The equations are those of
        ``tipwatch analyze``, with the same bits.

        Parameters
        ----------
        positions : array, shape (rows, joints) or (joints,)
            Joint positions (rad or m), in the order of ``machine.joints``.
        rates, accelerations : arrays like positions, optional
            Their first and second derivatives; zero if not given.
        specific_force : array, shape (rows, 3) or (3,), optional
            Acceleration minus gravity (m/s^2): points up at rest. If not given, the machine is at rest on level
            ground.
        up : array, shape (rows, 3) or (3,), optional
            Unit vector against gravity, in base axes. The loads do not depend on it; "causes" need it to tell slope from
            acceleration.
        angular_velocity, angular_acceleration : arrays like specific_force, optional
            rad/s and rad/s^2; zero if not given.
        tool_force, tool_moment : arrays like specific_force, optional
            Of the surroundings on the tool, in the axes of the tool frame (N, N m); zero if not given.
        what : str, or sequence of str
            "loads" (always), "indicators", "causes", "sigma", "parts", "gradient"; "all" is the first four.
        frame : "base" or "imu"
            Where specific force and angular motion are given: in the origin and axes of the base frame, or as the
            machine's inertial measurement unit (IMU) measures them. The standard deviations of "sigma" count
            errors of the IMU only with "imu".

        Returns
        -------
        Evaluation
            One array per quantity, rows first; loads in N. NaN where a row cannot be computed.

        Raises
        ------
        TipwatchError
            An array has the wrong shape, or a name is unknown."""

@final
class Analysis:
    """The analysis of one log: tables, findings, summary."""
    @property
    def samples(self) -> Table:
        """One row per time: loads, margins, indicators, causes, standard deviations (``samples.parquet``)."""
    @property
    def events(self) -> Table:
        """One row per event (``events.parquet``)."""
    @property
    def sensitivity(self) -> Table | None:
        """What the loads depend on most (``sensitivity.parquet``); None for models without derivatives."""
    @property
    def summary(self) -> dict[str, Any]:
        """The summary as a dictionary (``summary.json``)."""
    @property
    def notes(self) -> list[str]:
        """Assumptions, missing signals, anomalies: one sentence each."""
    @property
    def valid_share(self) -> float | None:
        """Share of the log's time that could be computed, 0 to 1; None for a log without duration."""
    @property
    def files(self) -> list[Path]:
        """The files that were written into ``out``."""
    def plot(self, start: float | None = None, end: float | None = None, ax: Any = None) -> Any:
        """Draws the log with matplotlib: the load of each wheel with its band of two standard deviations, margins of zero
        moment point and utilisation, and the events as shaded times. Samples need the columns ``time_ns``, ``valid``, and
        ``load_WHEEL`` and ``load_WHEEL_sigma`` of the wheels to draw; ``utilisation`` and ``zmp_margin`` are drawn if they
        are there.

        Parameters
        ----------
        start, end : float, optional
            Time range (seconds after the first row).
        ax : pair of matplotlib axes, optional
            Where to draw loads and margins; a new figure if not given.

        Returns
        -------
        matplotlib.figure.Figure
            The figure; its ``axes`` are those of loads and margins. Of given axes it is theirs.

        Raises
        ------
        TipwatchError
            Samples lack a column (``columns`` of ``analyze``), or there is no row between ``start`` and ``end``.
        ImportError
            matplotlib is not installed."""
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
    precision: Literal[32, 64] = 32,
    columns: str | Iterable[str] | None = None,
    lang: Literal["en", "de"] | None = None,
    progress: bool | Callable[[int], object] | None = None,
) -> Analysis:
    """Analyses one log: loads, margins, events and their causes, as ``tipwatch analyze`` does.

    Parameters
    ----------
    log : path or URL
        The log; also in a bucket or on a web server (``"s3://logs/shift.mcap"``, ``gs://``, ``az://``, ``https://``).
        Credentials come from the environment.
    machine : Machine or path
        The machine, or its machine file.
    out : path or URL, optional
        A folder for the files of ``tipwatch analyze``: tables, summary, report, derived log.
    rate : float, optional
        Rows per second; if not given, rows follow the fastest joint stream.
    start, end : float, optional
        Time range (seconds after the first sample).
    estimator : "smoother" or "causal"
        The smoother uses future samples and is the most accurate; "causal" gives the bits of live operation.
    model : "whole-body", "variable-inertia" or "closed-form"
        The model of the ground wrench.
    closed_form_input : "velocity" or "accelerometer"
        Where the closed forms take the platform's acceleration from; if not given, from odometry where the log has it.
    apply_clock_offsets : "stated" or "estimated"
        Which offsets between the clocks of topics are corrected; if not given, those that the machine file states.
    quasi_static : "auto", "always" or "never"
        Whether rows of a sparse log are static; if not given, as the machine file says, else "auto".
    monte_carlo : int, optional
        Number of machines (1 to 10000) with lengths, angles, masses and inertias varied by up to 10 %, for the bands of
        their loads in the summary.
    parts : bool
        Whether samples have the contribution of every link.
    terms : bool
        Whether samples have the terms of the closed forms, and speed and direction of wheels and axles.
    precision : 32 or 64
        Bits of the computed numbers in samples and files: 32 are about seven digits.
    columns : str, or iterable of str, optional
        The columns that samples keep, in this order; all if not given. An hour with all of them takes
        200 MB, almost twice as much with 64 bits. Files in ``out`` have all.
    lang : {"en", "de"}, optional
        The language of report and findings; default: English. Keys and columns are English in any. Calls in another
        language are awaited: a process speaks one at a time.
        Notes of a :class:`Machine` that is read meanwhile are in that language, too.
    progress : bool or callable
        True shows a bar on standard error (with tqdm or rich, if one of them is installed). A function is called some
        times a second with the number of bytes read so far.

    Returns
    -------
    Analysis

    Raises
    ------
    TipwatchError
        The log cannot be read, the machine does not fit it, no row remains, or samples have no such column.
    KeyboardInterrupt
        Ctrl+C. Files in ``out`` may be incomplete."""

@final
class Identification:
    """What an identification found."""
    @property
    def document(self) -> dict[str, Any]:
        """The document that ``tipwatch identify --json`` prints: parameters with their change and standard deviation
        (SI units), what the data tell and what they do not, errors before and after."""
    @property
    def text(self) -> str:
        """The result as ``tipwatch identify`` prints it."""
    @property
    def holds(self) -> bool | None:
        """Whether the result predicts data that were held back no worse than before; None if none were held back."""
    @property
    def file(self) -> Path | None:
        """The machine file that was written; None without ``out``, or if the result does not hold."""

def identify(
    machine: Machine | str | PathLike[str],
    logs: _Places = (),
    *,
    level: float | None = None,
    widen_sigmas: float | None = None,
    out: str | PathLike[str] | None = None,
) -> Identification:
    """Identifies parameters of a machine: masses, centres of mass, positions, tyre stiffness, errors of sensors.

    The standard deviations of the machine file are the prior; its weighings count, too.

    Parameters
    ----------
    machine : Machine or path
        The machine, or its machine file.
    logs : path, or iterable of paths
        Logs with measured loads or cylinder forces; may be empty if the machine file has weighings.
    level : float, optional
        The ground of the logs is level, with this standard deviation of its slope (rad).
    widen_sigmas : float, optional
        Widen the stated standard deviations of all scales and sensors by this factor.
    out : path, optional
        A machine file with what was identified is written there, unless the result contradicts what was stated or does not
        hold on held-back data: see ``refused`` in the document.

    Returns
    -------
    Identification

    Raises
    ------
    TipwatchError
        A log cannot be read or does not fit the machine, or there is nothing to identify from."""

@final
class Fleet:
    """A fleet that was screened: the data set in its folder, and what was counted.

    Parameters
    ----------
    out : path or URL
        The folder or bucket of an earlier ``screen``, complete with its page.

    Raises
    ------
    TipwatchError
        There is no data set, or it is not complete."""
    def __new__(cls, out: str | PathLike[str]) -> Self: ...
    @property
    def out(self) -> Path | str:
        """The folder of the data set, or its URL in a bucket."""
    @property
    def logs_uri(self) -> str:
        """Pattern of the files with one row per log: ``polars.scan_parquet(fleet.logs_uri)``."""
    @property
    def events_uri(self) -> str:
        """Pattern of the files with one row per event."""
    @property
    def logs(self) -> Table:
        """The rows of all logs."""
    @property
    def events(self) -> Table:
        """The rows of all events."""
    @property
    def comparisons(self) -> Table:
        """How the machines compare with their own history and with their type."""
    def query(self, sql: str) -> Table:
        """The answer to a question in SQL over the tables ``logs``, ``events`` and ``comparisons``, as of ``tipwatch query``."""
    @property
    def totals(self) -> dict[str, Any]:
        """Counts over the whole data set (``screen.json``)."""
    @property
    def undecided(self) -> list[tuple[str, str]]:
        """The logs that decide nothing, each with the reason: by the rules of the run, or of an opened fleet, of the run that wrote
        it."""
    @property
    def notes(self) -> list[str]:
        """What the run told beside its counts: logs that were left out, that no longer exist, or that contradict each other. One
        sentence each."""
    @property
    def page(self) -> Path | str | None:
        """The page (``fleet.html``): a path, or the URL in a bucket; None for one part of a fleet."""
    def _repr_html_(self) -> str: ...

@final
class WhatIf:
    """A replay of a log with another motion of its suspension."""
    @property
    def samples(self) -> Table:
        """One row per time (``whatif.parquet``)."""
    @property
    def summary(self) -> dict[str, Any]:
        """The summary as a dictionary (``summary.json``)."""
    @property
    def findings(self) -> list[str]:
        """What the replay shows, one sentence each."""

def read(
    log: str | PathLike[str],
    machine: Machine | str | PathLike[str],
    *,
    rate: float | None = None,
    start: float | None = None,
    end: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
) -> Table:
    """Reads the sensors of a log, filtered and on one clock: joint positions, rates and accelerations, specific force and
    angular motion of the IMU, attitude and velocity of the base. No loads are computed.

    Parameters
    ----------
    log : path or URL
        The log; also in a bucket or on a web server.
    machine : Machine or path
        The machine, which binds topics to sensors.
    rate : float, optional
        Rows per second; if not given, rows follow the fastest joint stream.
    start, end : float, optional
        Time range (seconds after the first sample).
    estimator : "smoother" or "causal"
        As in ``analyze``.

    Returns
    -------
    Table
        One row per time; null where a signal is unknown, with the reasons in a column. Positions in rad or m,
        specific force in m/s^2, angular velocity in rad/s; ``Table.units`` has the unit of every column.

    Raises
    ------
    TipwatchError
        The log cannot be read, or the machine does not fit it."""

@final
class FleetTask:
    """The analyses of a fleet with one record per log, for engines that run each log as a task."""
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
        lang: Literal["en", "de"] | None = None,
    ) -> Self: ...
    def files(self) -> list[Path]:
        """Absolute paths of the files that a worker needs besides the logs."""
    def logs(self, logs: Sequence[str | PathLike[str]]) -> list[tuple[str, int]]:
        """The logs, each with the estimated memory of its analysis (bytes), the largest first. Of a place that the storage does not
        list the failure is recorded."""
    def records(self) -> int:
        """Number of logs that have a record."""
    def run(self, log: str | PathLike[str]) -> tuple[str, str] | None:
        """Analyses a log and writes its record; returns kind and reason of its failure, if it failed."""
    def fail(self, log: str | PathLike[str], kind: str, reason: str) -> None:
        """Writes the failure of a log whose worker could not write one."""
    def gather(
        self,
        out: str | PathLike[str],
        min_valid: float | None,
        policy: str | PathLike[str] | None,
        fail_on: str | Iterable[str] | None,
        prune: bool,
    ) -> Fleet:
        """Builds data set and page; of the logs that were searched for, those without a record are in it as failed."""

def screen(
    logs: _Places = (),
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
    fail_on: str | Iterable[str] | None = None,
    prune: bool = False,
    reports: Literal["none", "events", "all"] | None = None,
    memory: float | None = None,
    shard: str | None = None,
    records: str | PathLike[str] | None = None,
    attempts: int | None = None,
    gather: bool | str | PathLike[str] = False,
    lang: Literal["en", "de"] | None = None,
    progress: bool | Callable[[int, int], object] | None = None,
    runner: Literal["threads", "ray", "dask"] = "threads",
    retries: int = 2,
) -> Fleet:
    """Analyses many logs on all cores or on a cluster, and builds a data set and a page from them.

    Parameters
    ----------
    logs : path, or iterable of paths
        Folders, patterns, manifests and logs. None are needed with ``gather``.
    out : path
        Output folder for data set, page and reports; not with ``records``.
    machine : Machine or path
        The machine of all logs; or
    fleet : path
        the fleet file: rules that assign machine files to logs.
    accept_inertias : bool
        Inertias of the URDF that no body can have are replaced, with their uncertainty, instead of refused; as
        ``accept_inertias = true`` in the machine files.
    resume : bool
        Resume the run in the folder: logs already analysed with the same content, machine, options and program are
        skipped.
    jobs : int, optional
        Number of logs analysed in parallel, 1 to 1024; default: number of processors. With an engine: number of tasks it is given
        at a time; default: four for each of its processors.
    rate, estimator, model, closed_form_input, apply_clock_offsets, quasi_static
        Those of ``analyze``.
    min_valid : float, optional
        Least share of a log's time that must be computable for it to decide anything; default: that of the policy, else
        0.5.
    policy : path, optional
        The rules by which the logs are judged (``policy.json``).
    fail_on : str, or iterable of str, optional
        Kinds of events that no log may have, as "wheel_lift": a policy of these rules. ``Fleet.totals`` counts the logs that
        break it.
    prune : bool
        Remove logs that no longer exist from the data set. With ``gather`` the logs must be named.
    reports : {"events", "all", "none"}, optional
        Which logs get a report of their own: those with events of wheels or edges (default), all, or none.
    memory : float, optional
        Limit of the estimated memory of all analyses (GiB); default: three quarters of what is free; with threads.
    shard : str, optional
        The part of the logs to analyse, as "2/8": the second of eight; ``gather`` combines the parts. "auto/8" takes the
        index from the variables of Kubernetes, AWS Batch, Slurm, Google Batch or Cloud Run, "auto" the number of parts, too;
        with threads.
    records : path, optional
        Write records and reports alone, into a folder that many processes share, instead of ``out``. Logs that have a
        record are skipped; ``gather`` makes the data set. With threads.
    attempts : int, optional
        With ``records``: number of processes that may be lost while they analyse a log, before it counts as failed;
        default: 3.
    gather : bool or path
        Analyse nothing: build data set and page in ``out`` from the records in this place, or with True from those in
        ``out``. Of logs that are named, those without a record are in the data set as failed. With threads.
    lang : {"en", "de"}, optional
        The language of page, reports and findings; default: English. Keys and columns are English in any. Calls in
        another language are awaited: a process speaks one at a time.
        Notes of a :class:`Machine` that is read meanwhile are in that language, too.
    progress : bool or callable
        True shows a bar on standard error (with tqdm or rich, if one of them is installed). A function is called some
        times a second with the number of finished logs and that of all logs.
    runner : {"threads", "ray", "dask"}
        Who runs the analyses: threads of this process, or an engine, with one task per log. Ray is the cluster of
        ``ray.init`` or ``RAY_ADDRESS``, else one on this machine; Dask that of the current ``distributed.Client``, else
        one on this machine. Workers need this package and the paths of logs and ``out``; machine files are sent to them.
    retries : int
        With an engine: further workers that a log may lose before it is a failure.

    Returns
    -------
    Fleet
        Its ``notes`` are also Python warnings (``UserWarning``).

    Raises
    ------
    TipwatchError
        There is no log, the folder cannot be used, or a keyword has a value that it cannot have or excludes another. A log
        that cannot be analysed is not an error: the data set has it with the reason and its kind; so is a log whose worker
        is lost.
    KeyboardInterrupt
        Ctrl+C, once the logs in work are finished (standard error says so): the data set stays whole, and
        ``resume=True`` continues."""

def compare(
    a: str | PathLike[str],
    b: str | PathLike[str],
    *,
    machine: Machine | str | PathLike[str] | None = None,
    machine_b: Machine | str | PathLike[str] | None = None,
    rate: float | None = None,
    estimator: Literal["smoother", "causal"] | None = None,
    model: Literal["whole-body", "variable-inertia", "closed-form"] | None = None,
    lang: Literal["en", "de"] | None = None,
) -> dict[str, Any]:
    """Compares two logs or output folders of ``analyze``: events, figures, rows.

    Parameters
    ----------
    a, b : path
        A log, or an output folder.
    machine : Machine or path, optional
        The machine of the logs.
    machine_b : Machine or path, optional
        Another machine for ``b``.
    rate, estimator, model, lang
        Those of ``analyze``.

    Returns
    -------
    dict
        The document that ``tipwatch compare --json`` prints; SI units.

    Raises
    ------
    TipwatchError
        A log or folder cannot be read, or a log has no machine."""

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
    lang: Literal["en", "de"] | None = None,
) -> WhatIf:
    """Replays a log with another motion of its active suspension.

    Parameters
    ----------
    log : path
        The log.
    machine : Machine or path
        The machine; its machine file describes the suspension.
    suspension : "look-ahead", "literal", "locked" or "recorded"
        How the suspension moves.
    step : float, optional
        Control period (s); if not given, that of the machine file.
    rate, start, end, estimator, lang
        Those of ``analyze``.
    out : path, optional
        A folder for the files of ``tipwatch whatif``.

    Returns
    -------
    WhatIf

    Raises
    ------
    TipwatchError
        The log cannot be read, the machine does not fit it, or the machine file describes no suspension."""

def set_read_options(
    *,
    time_column: str | None = None,
    time_unit: Literal["s", "ms", "us", "ns", "days"] | None = None,
    date_order: Literal["dmy", "mdy", "ymd"] | None = None,
    header: bool = True,
    definitions: _Places = (),
    fetch_whole: bool = False,
) -> None:
    """States what logs do not state themselves, for all calls of this process from now on; each call replaces what was
    stated before. With ``screen`` it goes to the workers of an engine; they need the folders of ``definitions`` at the same
    paths.

    Parameters
    ----------
    time_column : str, optional
        The column of time of a table (CSV, Parquet); two, joined by a comma, for a date and a time of day, or for seconds
        and nanoseconds.
    time_unit : {"s", "ms", "us", "ns", "days"}, optional
        The unit of the times of a table.
    date_order : {"dmy", "mdy", "ymd"}, optional
        The order of day, month and year in the dates of a table.
    header : bool
        Whether the first line of a table names its columns; without it they are c1, c2 and so on.
    definitions : path, or iterable of paths
        Folders with definitions of message types, ``PACKAGE/msg/NAME.msg``, for logs that lack them.
    fetch_whole : bool
        Whether logs of buckets and web servers are transferred as a whole where their format has no index of its parts.

    Returns
    -------
    None

    Raises
    ------
    TipwatchError
        A unit or an order is unknown."""
def stated_read_options() -> dict[str, Any]:
    """What was stated with ``set_read_options``, as its keywords, for the workers of an engine."""
def set_program(file: str | PathLike[str]) -> None:
    """States the file of this library: results name it, and not the interpreter, as the program that made them."""
def main(arguments: Sequence[str]) -> int:
    """Runs the program `tipwatch` with these arguments, the first of which is its name.

    Returns
    -------
    int
        The exit code."""
