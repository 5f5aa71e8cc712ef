"""Dask: a task per log on the workers of ``distributed``."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from distributed import Client, KilledWorker, as_completed, get_client, wait

from tipwatch._engines._parcel import Parcel, analyse

_PER_PROCESSOR = 4


def run(
    parcel: Parcel,
    logs: Sequence[tuple[str, int]],
    finished: Callable[[str, tuple[str, str] | None], None],
    *,
    in_flight: int | None,
    retries: int,
) -> None:
    """Runs each log as a task; ``finished`` hears of each, with the failure that its worker could not write."""
    try:
        client, is_own = get_client(), False
    except ValueError:
        client, is_own = Client(processes=True, threads_per_worker=1, dashboard_address=None), True
    # how many workers a task may take with it is a setting of the scheduler, not of a task
    before = client.run_on_scheduler(_allow_failures, retries)
    try:
        _run(client, parcel, logs, finished, in_flight)
    finally:
        client.run_on_scheduler(_allow_failures, before)
        if is_own:
            client.close()


def _allow_failures(most: int, dask_scheduler=None) -> int:
    before, dask_scheduler.allowed_failures = dask_scheduler.allowed_failures, most
    return before


def _run(client, parcel, logs, finished, in_flight):
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    threads = sum(worker["nthreads"] for worker in workers)
    # workers that state their memory as a resource get as many logs as fit
    memory = max((worker.get("resources", {}).get("memory", 0) for worker in workers), default=0)
    most = in_flight or max(8, _PER_PROCESSOR * threads)
    waiting, running, suspects = list(reversed(logs)), {}, []

    def submit(log, bytes_needed):
        resources = {"memory": min(bytes_needed, memory)} if memory else None
        future = client.submit(analyse, parcel, log, pure=False, resources=resources)
        running[future] = log, bytes_needed
        return future

    done = as_completed([submit(*waiting.pop()) for _ in range(min(most, len(waiting)))])
    try:
        for future in done:
            log, bytes_needed = running.pop(future)
            failure = _failure(future)
            if failure is not None and failure[0] == "worker_lost":
                suspects.append((log, bytes_needed))
            else:
                finished(str(log), failure)
            if waiting:
                done.add(submit(*waiting.pop()))
        # the scheduler blames every task that a lost worker had, also those that only waited there: alone a log can
        # only be lost by itself
        for log, bytes_needed in suspects:
            future = submit(log, bytes_needed)
            wait(future)
            del running[future]
            finished(str(log), _failure(future))
    except BaseException:
        client.cancel(list(running), force=True)
        raise


def _failure(future) -> tuple[str, str] | None:
    """Kind and reason of the failure of a task that wrote no record."""
    if future.status == "finished":
        return None
    error = future.exception() if future.status == "error" else None
    text = f"{type(error).__name__}: {error}" if error else f"the task was {future.status}"
    return ("worker_lost" if isinstance(error, KilledWorker) else "engine"), text.splitlines()[0]
