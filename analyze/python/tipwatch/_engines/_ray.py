"""Ray Core: a task per log, placed by processors and memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import ray
from ray import exceptions

from tipwatch import _tipwatch
from tipwatch._engines._parcel import Parcel, analyse

# Tasks given to the cluster per processor: enough to keep it busy, few enough to leave no long queue when it ends.
_PER_PROCESSOR = 4
_LOST = (
    exceptions.WorkerCrashedError,
    exceptions.NodeDiedError,
    exceptions.LocalRayletDiedError,
    exceptions.RayActorError,
    exceptions.ObjectLostError,
)


def run(
    parcel: Parcel,
    logs: Sequence[tuple[str, int]],
    finished: Callable[[str, tuple[str, str] | None], None],
    *,
    in_flight: int | None,
    retries: int,
) -> None:
    """Runs each log as a task; ``finished`` hears of each, with the failure that its worker could not write."""
    is_own = not ray.is_initialized()
    if is_own:
        ray.init(log_to_driver=False, include_dashboard=False)
    try:
        _run(parcel, logs, finished, in_flight, retries)
    finally:
        if is_own:
            ray.shutdown()


def _run(parcel, logs, finished, in_flight, retries):
    processors, memory = _largest_node()
    if processors < 1:
        raise _tipwatch.TipwatchError("expected a Ray cluster with a node of at least one CPU, found none")
    remote = ray.remote(analyse)
    sent = ray.put(parcel)
    waiting = list(reversed(logs))
    running: dict[ray.ObjectRef, str] = {}
    try:
        while waiting or running:
            most = in_flight or max(8, _PER_PROCESSOR * int(ray.cluster_resources().get("CPU", 1)))
            while waiting and len(running) < most:
                log, bytes_needed = waiting.pop()
                # a log that needs more than any node has gets a node to itself
                task = remote.options(
                    name=f"tipwatch {log}", num_cpus=1, memory=min(bytes_needed, memory), max_retries=retries,
                    retry_exceptions=False,
                )
                running[task.remote(sent, log)] = str(log)
            ready, _ = ray.wait(list(running), num_returns=1, timeout=1.0)
            for task in ready:
                finished(running.pop(task), _failure(task))
    except BaseException:
        for task in running:
            ray.cancel(task, force=True)
        raise


def _failure(task: ray.ObjectRef) -> tuple[str, str] | None:
    """Kind and reason of the failure of a task that wrote no record."""
    try:
        ray.get(task)
    except exceptions.OutOfMemoryError as error:
        return "out_of_memory", _first_line(error)
    except _LOST as error:
        return "worker_lost", _first_line(error)
    except exceptions.RayError as error:
        return "engine", _first_line(error)
    return None


def _first_line(error: BaseException) -> str:
    cause = getattr(error, "cause", None) or error
    lines = str(cause).strip().splitlines()
    return f"{type(cause).__name__}: {lines[0] if lines else 'no message'}"


def _largest_node() -> tuple[float, int]:
    """Processors and memory (bytes) of the largest nodes."""
    nodes = [node["Resources"] for node in ray.nodes() if node["Alive"]]
    largest = lambda name: max((node.get(name, 0) for node in nodes), default=0)
    return largest("CPU"), int(largest("memory"))
