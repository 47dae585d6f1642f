"""Sweeps over the workers of a Dask cluster: ``LocalCluster``, ``dask-jobqueue``'s ``SLURMCluster``, any scheduler.

>>> from distributed import Client, LocalCluster
>>> import motorfit.dask
>>> with LocalCluster() as cluster, Client(cluster) as client:   # doctest: +SKIP
...     summary = motorfit.dask.sweep(client, "study.toml")

Requires ``pip install motorfit[dask]`` on the client and the same version of motorfit on every worker. A scheduler needs
only Dask.
"""

from __future__ import annotations

import json
import math
import numbers
import os
import pathlib
import pickle
import time
import uuid
import warnings
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

try:
    from distributed import Client, Future, KilledWorker, as_completed
    from distributed import TimeoutError as DaskTimeout
except ImportError as error:
    raise ImportError(f"motorfit.dask needs distributed: pip install motorfit[dask] ({error})") from error

from ._errors import DeviceError, MotorfitError, UsageError
from ._motorfit import Sweep, __version__
from ._shard import Done, Task, WorkerInfo, fingerprint, inspect_worker, pack_call, read_recording, run
from ._summary import SweepSummary
from ._sweep import Limits, folder_of

__all__ = ["Progress", "sweep"]

# Shards per slot of the workers: a lost shard then costs little.
PER_SLOT = 4
# Smallest number of shards submitted at the same time; it is bounded so that recordings do not pile up at the scheduler.
WINDOW = 16
# Recordings that are compared to detect whether a worker sees the same folder.
COMPARED = 16
SHARDS_MAX = 1_000_000


@dataclass(frozen=True)
class Progress:
    """Progress of a sweep over workers: the attributes of :class:`motorfit.SweepProgress` for all runs, and the shards."""

    #: Finished runs, including those of earlier calls.
    done: int
    #: Number of runs of the sweep.
    total: int
    #: Runs that earlier calls had finished.
    before: int
    #: Finished runs without a result.
    failed: int
    #: Time since the start of the call [s].
    seconds: float
    #: Finished shards.
    shards_done: int
    #: Number of shards.
    shards: int

    @property
    def rate(self) -> float | None:
        """Runs per second of this call; ``None`` until one is finished."""
        return (self.done - self.before) / self.seconds if self.done > self.before and self.seconds > 0 else None

    @property
    def remaining(self) -> float | None:
        """Estimated remaining time at this rate [s]; ``None`` without a rate."""
        return (self.total - self.done) / self.rate if self.rate else None


@dataclass(frozen=True)
class _Options:
    resources: dict[str, float]
    retries: int
    threads: int | None
    wait: float | None
    progress: Callable[[Progress], object] | None


def sweep(
    client: Client,
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    shards: int | None = None,
    shared: bool | None = None,
    resources: Mapping[str, float] | None = None,
    retries: int = 3,
    threads: int | None = None,
    wait: float | None = None,
    progress: Callable[[Progress], object] | None = None,
    limits: Limits | None = None,
) -> SweepSummary:
    """Runs a study on the workers of a cluster, one task per shard, and merges the results on the client.

    The file results.jsonl and the return value are those of :func:`motorfit.sweep` on one machine, if all machines have
    the same class of instruction set; a warning is given if they do not.

    The shard of a killed worker is run again. Each shard is stored as soon as it is finished: after Ctrl-C or an
    exception in the callback, the same call resumes the sweep, on the same cluster or another one.

    Parameters
    ----------
    client : distributed.Client
        Client of any cluster.
    study : str or PathLike
        Study file (TOML); the paths of its recordings are relative to its folder.
    out : str or PathLike, optional
        New folder on this machine, or the folder of the same study; by default STUDY.sweep beside the study.
    shards : int, optional
        Number of tasks; by default four for each that the workers can run at the same time.
    shared : bool, optional
        True if the workers see ``out`` and the recordings under the same paths; they then write there. If False, the
        manifest, the recordings of the shard and its finished runs are sent with the task and its results are returned;
        recordings must then have relative paths. Detected by default.
    resources : mapping, optional
        Resources of a worker that a task needs, ``{"GPU": 1}``.
    retries : int, default 3
        Number of times that a shard is run again after an error, or after as many killed workers as the cluster allows.
    threads : int, optional
        Threads of a shard, at most those of its worker; by default the worker's threads divided by the number of shards
        that it runs at the same time.
    wait : float, optional
        Time to wait for a first worker that can run a shard [s]; unlimited by default.
    progress : callable, optional
        Called with a :class:`Progress` at the start and after each shard, unless no run is left. If it returns ``False``
        the sweep ends, and the finished runs are merged. Callbacks for :func:`motorfit.sweep` can be used, because
        ``done``, ``total``, ``rate`` and ``remaining`` count runs.
    limits : str, sequence or mapping, optional
        Tolerance limits of the parameters in SI units, ``{"R": (0.8, 1.0)}``, by default those of the study;
        motors outside of them are listed.

    Returns
    -------
    SweepSummary
        Summary, as that of :func:`motorfit.sweep`.

    Raises
    ------
    UsageError
        If an argument or the study is wrong, or a worker has another version of motorfit or none.
    DataError
        If a file cannot be read or written.
    DeviceError
        If no worker with the resources is available within ``wait``.
    """
    _check_client(client)
    count = None if shards is None else _integer("shards", shards, 1, SHARDS_MAX)
    options = _Options(
        resources=_needs(resources),
        retries=_integer("retries", retries, 0),
        threads=None if threads is None else _integer("threads", threads, 1),
        wait=None if wait is None else _seconds("wait", wait),
        progress=progress,
    )
    if not (shared is None or isinstance(shared, (bool, np.bool_))):
        raise UsageError(f"shared is {shared!r}", "Give True or False, or leave it out to detect it.")
    if not (progress is None or callable(progress)):
        raise UsageError(f"progress is {progress!r}", "Give a function of one argument.")
    Sweep._check_limits(limits)
    plan = Sweep.plan(study, folder_of(study, out).absolute())
    _Sweeping(client, plan, options).run(count, None if shared is None else bool(shared))
    _check_instructions(plan.folder)
    return plan.merge(limits=limits)


def _check_client(client: object) -> None:
    if isinstance(client, str):
        raise UsageError(f"the client is an address, {client!r}", f"Give a client of it: Client({client!r}).")
    if not isinstance(client, Client):
        message = f"the client is a {type(client).__name__}"
        raise UsageError(message, "Give a distributed.Client; that of a cluster is Client(cluster).")
    if client.asynchronous:
        raise UsageError("the client is asynchronous", "Give a Client that was made without asynchronous=True.")
    if client.status in ("closing", "closed"):
        raise UsageError("the client is closed", "Give one that is open.")


def _is_number(value: object, kind: type) -> bool:
    return isinstance(value, kind) and not isinstance(value, bool)


def _integer(name: str, value: Any, least: int, most: int | None = None) -> int:
    if _is_number(value, numbers.Integral) and value >= least and (most is None or value <= most):
        return int(value)
    bounds = f"of at least {least}" if most is None else f"from {least} to {most}"
    raise UsageError(f"{name} is {value!r}", f"Give an integer {bounds}.")


def _seconds(name: str, value: Any) -> float:
    if _is_number(value, numbers.Real) and 0 <= value < math.inf:
        return float(value)
    raise UsageError(f"{name} is {value!r}", "Give a non-negative number of seconds, or leave it out to wait without limit.")


def _needs(resources: Any) -> dict[str, float]:
    remedy = "Give the resources that a task needs, as in {'GPU': 1}."
    if resources is None:
        return {}
    if not isinstance(resources, Mapping):
        raise UsageError(f"resources is {resources!r}", remedy)
    for name, need in resources.items():
        if not (isinstance(name, str) and _is_number(need, numbers.Real) and 0 < need < math.inf):
            raise UsageError(f"resources has {name!r}: {need!r}", remedy)
    return {name: float(need) for name, need in resources.items()}


class _Sweeping:
    """State of a running sweep."""

    def __init__(self, client: Client, plan: Sweep, options: _Options) -> None:
        self.client, self.plan, self.options = client, plan, options
        self.begun = time.monotonic()
        self.token = uuid.uuid4().hex
        self.manifest = (plan.folder / "manifest.json").read_bytes()
        self.count, self.slots, self.is_shared = 1, 1, False
        # Unfinished runs of each shard.
        self.left: list[int] = []
        # Runs finished before this call; failed runs, in all and before this call; finished shards.
        self.before = self.failed = self.failed_before = self.shards_done = 0
        # Failed runs of each submitted shard that `failed` includes.
        self.failed_of: dict[int, int] = {}
        # Shards to submit with the number of the attempt, and submitted futures by their keys.
        self.waiting: deque[tuple[int, int]] = deque()
        self.pending: dict[str, tuple[Future[Any], int, int]] = {}
        self.faults: list[Exception] = []

    def run(self, shards: int | None, shared: bool | None) -> None:
        """Runs all unfinished runs."""
        if not any(self.plan.left(1)):
            return
        self._inspect_workers(shared)
        self.count = shards if shards is not None else self._count()
        self.left = self.plan.left(self.count)
        self.before = self.plan.runs - sum(self.left)
        status = self.plan.status()
        # A run that has a results line but is left has failed and is repeated.
        self.failed = self.failed_before = max(0, status["failed"] - (status["done"] - self.before))
        self.waiting.extend((index, 1) for index, runs in enumerate(self.left, 1) if runs)
        self.shards_done = self.count - len(self.waiting)
        if not self.is_shared:
            self._check_paths()
        ended = as_completed(loop=self.client.loop)
        try:
            if self._report():
                self._fill(ended)
                for future in ended:
                    if not self._end(future):
                        break
                    self._fill(ended)
        finally:
            self._give_up()
        if self.faults:
            raise self.faults[0]

    def _inspect_workers(self, shared: bool | None) -> None:
        """Waits for a worker; determines the slots of all workers, and whether they see the folders of the client."""
        seen = self.plan.folder / f".seen-{self.token}"
        recordings = self.plan.recordings((1, 1))
        sample = [self.plan.origin / path for path in recordings[:: max(1, len(recordings) // COMPARED)]]
        paths = [str(path) for path in [seen, *sample]]
        try:
            seen.touch()
            first = self._first_worker(paths)
            rest = self.client.run(inspect_worker, paths, self.options.resources, on_error="ignore")
            fingerprints = [fingerprint(path) for path in paths]
        finally:
            seen.unlink(missing_ok=True)
        infos = [first, *(one for one in (rest or {}).values() if isinstance(one, WorkerInfo) and one.slots > 0)]
        for one in infos:
            if one.version != __version__:
                message = f"a worker has motorfit {one.version}, the client {__version__}"
                raise UsageError(message, "Install the same version everywhere.")
        self.slots = max(1, sum(one.slots for one in infos[1:]))
        self.is_shared = shared if shared is not None else all(one.fingerprints == fingerprints for one in infos)

    def _first_worker(self, paths: list[str]) -> WorkerInfo:
        options = self.options
        key = f"motorfit-look-{self.token}"
        call = pack_call(inspect_worker, paths, options.resources)
        needed = options.resources or None
        future = self.client.submit(pickle.loads, call, key=key, pure=False, resources=needed, retries=2)
        try:
            found: WorkerInfo = future.result(timeout=options.wait)
            return found
        except DaskTimeout:
            needs = f" with {options.resources}" if options.resources else ""
            message = f"no worker{needs} accepted a task within {options.wait} s"
            remedy = "Start workers with these resources, as in dask worker --resources GPU=1, or give a longer wait."
            raise DeviceError(message, remedy) from None
        except ImportError as error:
            raise _missing(error) from error
        finally:
            with suppress(Exception):
                self.client.cancel([future])

    def _count(self) -> int:
        """Returns the number of shards: enough for all workers, and complete motors per shard if possible."""
        count = max(PER_SLOT * self.slots, WINDOW)
        whole = len(self.plan.motors) // 8
        if self.slots <= whole:
            count = min(count, whole)
        known = max((shard["count"] for shard in self.plan.status()["shards"]), default=1)
        return min(max(count, known), self.plan.runs, SHARDS_MAX)

    def _check_paths(self) -> None:
        for path in self.plan.recordings((1, 1)):
            if os.path.isabs(path):
                message = f"the recording {path} has an absolute path, and workers do not see the folders of the client"
                remedy = "Give paths relative to the study's folder, or shared=True if workers see the same files."
                raise UsageError(message, remedy)

    def _task(self, index: int) -> Task:
        shard, options = (index, self.count), self.options
        common = (shard, __version__, options.threads, options.resources)
        results = {} if self.is_shared and not self.failed_before else self.plan.finished(shard)
        self.failed_of.setdefault(index, _failed(results) if self.failed_before else 0)
        if self.is_shared:
            return Task(*common, folders=(str(self.plan.folder), str(self.plan.origin)))
        recordings = {path: read_recording(self.plan.origin / path) for path in self.plan.recordings(shard)}
        return Task(*common, manifest=self.manifest, recordings=recordings, results=results)

    def _fill(self, ended: as_completed) -> None:
        """Submits enough shards to keep the workers busy."""
        if not self.waiting:
            return
        room = max(WINDOW, 2 * self.slots, 2 * sum(self.client.nthreads().values()))
        while self.waiting and len(self.pending) < room:
            index, attempt = self.waiting.popleft()
            key = f"motorfit-sweep-{self.plan.digest[:16]}-{self.token}-{index}-of-{self.count}-{attempt}"
            with warnings.catch_warnings():
                # Dask advises to scatter large arguments, but each is used once, and would be lost with its worker.
                warnings.filterwarnings("ignore", message="(?s).*large", category=UserWarning)
                future = self.client.submit(
                    pickle.loads,
                    pack_call(run, self._task(index)),
                    key=key,
                    pure=False,
                    retries=self.options.retries,
                    resources=self.options.resources or None,
                )
            self.pending[key] = (future, index, attempt)
            ended.add(future)

    def _end(self, future: Future[Any]) -> bool:
        """Handles the end of a shard; returns False if the sweep is to end."""
        _, index, attempt = self.pending[str(future.key)]
        done: Done | None = None
        fault: Exception | None = None
        try:
            done = future.result()
        except Exception as error:
            if future.status == "cancelled":
                raise
            fault = error
        if done is not None:
            self._take(done)
        # Removed only now, so that `_give_up` takes its result after an interruption above.
        del self.pending[str(future.key)]
        # Too many workers were killed, or the worker ended the shard without a request of the client.
        is_left = isinstance(fault, KilledWorker) or (done is not None and done.tally["stop"] != "done")
        if is_left and attempt <= self.options.retries:
            self.waiting.appendleft((index, attempt + 1))
        elif is_left:
            message = f"shard {index}/{self.count} was lost with its worker {attempt} times"
            remedy = "See the logs of the workers; most often memory is short. Give them more memory, or use more shards."
            self.faults.append(MotorfitError(message, remedy))
        elif fault is not None:
            self.faults.append(_missing(fault) if isinstance(fault, ImportError) else fault)
        return self._report()

    def _take(self, done: Done) -> None:
        """Stores the results of a shard and updates the counts."""
        if done.results is not None:
            self.plan.take(done.shard, done.results)
        index, tally = done.shard[0], done.tally
        self.shards_done += tally["stop"] == "done"
        self.left[index - 1] = tally["runs"] - tally["before"] - tally["finished"]
        self.failed += tally["failed"] - self.failed_of[index]
        self.failed_of[index] = tally["failed"]

    def _report(self) -> bool:
        """Calls the callback; returns False if it ends the sweep."""
        if self.options.progress is None:
            return True
        state = Progress(
            done=self.plan.runs - sum(self.left),
            total=self.plan.runs,
            before=self.before,
            failed=self.failed,
            seconds=time.monotonic() - self.begun,
            shards_done=self.shards_done,
            shards=self.count,
        )
        answer = self.options.progress(state)
        return not isinstance(answer, (bool, np.bool_)) or bool(answer)

    def _give_up(self) -> None:
        """Stores the results of finished shards and cancels the others."""
        for future, _, _ in self.pending.values():
            if future.status == "finished":
                with suppress(Exception):
                    self._take(future.result(timeout=30))
        if self.pending:
            with suppress(Exception):
                self.client.cancel([future for future, _, _ in self.pending.values()])


def _missing(error: ImportError) -> UsageError:
    """Returns the error for a worker without motorfit."""
    return UsageError(f"a worker cannot import motorfit: {error}", f"Install motorfit {__version__} on every worker.")


def _failed(results: Mapping[str, bytes]) -> int:
    """Returns the number of failed runs in results files."""
    lines = (line for content in results.values() for line in content.splitlines() if b'"stop":"failed"' in line)
    return len({json.loads(line)["id"] for line in lines})


def _check_instructions(folder: pathlib.Path) -> None:
    """Warns if results come from machines with different instruction sets, whose rounding may differ."""
    found = set()
    for path in folder.glob("results-*-of-*.jsonl"):
        with open(path, "rb") as file:
            with suppress(ValueError):
                found.add(json.loads(file.readline()).get("instructions"))
    if len(found) > 1:
        names = ", ".join(sorted(map(str, found)))
        warnings.warn(f"the results come from different instruction sets ({names}): their last digits may differ", stacklevel=3)
