"""Sweeps over the workers of a Dask cluster: ``LocalCluster``, ``dask-jobqueue``'s ``SLURMCluster``, any scheduler.

>>> from distributed import Client, LocalCluster
>>> import motorfit.dask
>>> with LocalCluster() as cluster, Client(cluster) as client:   # doctest: +SKIP
...     summary = motorfit.dask.sweep(client, "study.toml")

Needs ``pip install motorfit[dask]`` here and the same motorfit on every worker. A scheduler needs Dask alone.
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
    from distributed import TimeoutError as Late
except ImportError as error:
    raise ImportError(f"motorfit.dask needs distributed: pip install motorfit[dask] ({error})") from error

from ._errors import DeviceError, MotorfitError, UsageError
from ._motorfit import Sweep, __version__
from ._shard import Done, Look, Task, contents, look, mark, parcel, run
from ._sweep import Limits, folder_of

__all__ = ["Progress", "sweep"]

# Shards for each that can be done at the same time: so many that a lost one costs little.
PER_SLOT = 4
# Shards that are with the cluster at the same time, at least: recordings must not pile up at the scheduler.
WINDOW = 16
# Recordings that are looked at to tell whether a worker sees the same folder.
LOOKED_AT = 16
SHARDS_MAX = 1_000_000


@dataclass(frozen=True)
class Progress:
    """How far a sweep over workers is: all that :class:`motorfit.SweepProgress` has, of all runs, and the shards."""

    #: Runs that are finished, those of earlier times included.
    done: int
    #: Runs of the sweep.
    total: int
    #: Runs that were finished before.
    before: int
    #: Runs without a result.
    failed: int
    #: Seconds since the call.
    seconds: float
    #: Shards that are finished, and all.
    shards_done: int
    shards: int

    @property
    def rate(self) -> float | None:
        """Runs a second, those of this call; ``None`` before there is any."""
        return (self.done - self.before) / self.seconds if self.done > self.before and self.seconds > 0 else None

    @property
    def remaining(self) -> float | None:
        """Seconds that are left at this rate."""
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
) -> dict[str, Any]:
    """Runs a study (TOML) on the workers of a cluster and merges its results here: one task a shard.

    The bytes of results.jsonl, and what is given, are those of :func:`motorfit.sweep` and of ``motorfit sweep`` on one
    machine, as long as all machines have the same class of instructions (a warning says where they have not).

    A worker that is killed costs its shard another try. Each shard is kept as soon as it is finished: after Ctrl-C or an
    exception of the callback the same call goes on where it was, on the same cluster or another one.

    Args:
        client: A client of any cluster.
        study: The study. Paths of its recordings start at its folder.
        out: A new folder on this machine, or one that the study was planned in; else STUDY.sweep beside the study.
        shards: Into how many tasks the runs go; by default four for each that the workers can do at the same time.
        shared: Whether workers see ``out`` and the recordings under the same paths, and write there. By default that is
            found out; where they do not, the manifest, the recordings of the shard and its finished runs travel with
            the task, and its results come back. Recordings with absolute paths do not travel.
        resources: What a task needs of a worker, as ``{"GPU": 1}``.
        retries: How often a shard is tried again after an error, or after as many dead workers as the cluster allows.
        threads: Threads of a shard, at most those of its worker; by default the worker's threads divided by the shards
            that it does at the same time.
        wait: Seconds to wait for a first worker that can take a shard; by default as long as it takes.
        progress: Called with a :class:`Progress` at the beginning and after each shard, unless nothing is left to do; its
            answer ``False`` ends the sweep, and what is finished is merged. What is written for :func:`motorfit.sweep`
            works here too: ``done``, ``total``, ``rate`` and ``remaining`` count runs.
        limits: Those that parameters of a motor must keep, in SI units, as ``{"R": (0.8, 1.0)}``.
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
        raise UsageError(f"shared is {shared!r}", "Give True or False; without it, it is found out.")
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
        message = f"the client is of the kind {type(client).__name__}"
        raise UsageError(message, "Give a Client of distributed; of a cluster it is Client(cluster).")
    if client.asynchronous:
        raise UsageError("the client is asynchronous", "Give a Client that was made without asynchronous=True.")
    if client.status in ("closing", "closed"):
        raise UsageError("the client is closed", "Give one that is open.")


def _is_number(value: object, kind: type) -> bool:
    return isinstance(value, kind) and not isinstance(value, bool)


def _integer(name: str, value: Any, least: int, most: int | None = None) -> int:
    if _is_number(value, numbers.Integral) and value >= least and (most is None or value <= most):
        return int(value)
    bounds = f"of {least} or more" if most is None else f"from {least} to {most}"
    raise UsageError(f"{name} is {value!r}", f"Give an integer {bounds}.")


def _seconds(name: str, value: Any) -> float:
    if _is_number(value, numbers.Real) and 0 <= value < math.inf:
        return float(value)
    raise UsageError(f"{name} is {value!r}", "Give a number of seconds; without it there is no end.")


def _needs(resources: Any) -> dict[str, float]:
    remedy = "Give what a task needs of a worker, as {'GPU': 1}."
    if resources is None:
        return {}
    if not isinstance(resources, Mapping):
        raise UsageError(f"resources is {resources!r}", remedy)
    for name, need in resources.items():
        if not (isinstance(name, str) and _is_number(need, numbers.Real) and 0 < need < math.inf):
            raise UsageError(f"resources has {name!r}: {need!r}", remedy)
    return {name: float(need) for name, need in resources.items()}


class _Sweeping:
    """A sweep on its way."""

    def __init__(self, client: Client, plan: Sweep, options: _Options) -> None:
        self.client, self.plan, self.options = client, plan, options
        self.begun = time.monotonic()
        self.token = uuid.uuid4().hex
        self.manifest = (plan.folder / "manifest.json").read_bytes()
        self.count, self.slots, self.is_shared = 1, 1, False
        # Runs that each shard has left; what was finished before, and failed now and before.
        self.left: list[int] = []
        self.before = self.failed = self.failed_before = self.shards_done = 0
        # Runs without a result of each shard that was submitted: those that `failed` has already.
        self.failed_of: dict[int, int] = {}
        # Shards that wait, each with the number of its try, and futures by their keys.
        self.waiting: deque[tuple[int, int]] = deque()
        self.pending: dict[str, tuple[Future[Any], int, int]] = {}
        self.faults: list[Exception] = []

    def run(self, shards: int | None, shared: bool | None) -> None:
        """Runs all that is left."""
        if not any(self.plan.left(1)):
            return
        self._look_at_workers(shared)
        self.count = shards if shards is not None else self._count()
        self.left = self.plan.left(self.count)
        self.before = self.plan.runs - sum(self.left)
        status = self.plan.status()
        # What has a line and is left all the same has failed and is tried again.
        self.failed = self.failed_before = max(0, status["failed"] - (status["done"] - self.before))
        self.waiting.extend((index, 1) for index, runs in enumerate(self.left, 1) if runs)
        self.shards_done = self.count - len(self.waiting)
        if not self.is_shared:
            self._check_paths()
        ended = as_completed(loop=self.client.loop)
        try:
            if self._tell():
                self._fill(ended)
                for future in ended:
                    if not self._end(future):
                        break
                    self._fill(ended)
        finally:
            self._give_up()
        if self.faults:
            raise self.faults[0]

    def _look_at_workers(self, shared: bool | None) -> None:
        """Waits for a worker; finds out what workers can do at the same time, and whether they see our folders."""
        seen = self.plan.folder / f".seen-{self.token}"
        recordings = self.plan.recordings((1, 1))
        sample = [self.plan.origin / path for path in recordings[:: max(1, len(recordings) // LOOKED_AT)]]
        paths = [str(path) for path in [seen, *sample]]
        try:
            seen.touch()
            first = self._first_look(paths)
            rest = self.client.run(look, paths, self.options.resources, on_error="ignore")
            marks = [mark(path) for path in paths]
        finally:
            seen.unlink(missing_ok=True)
        looks = [first, *(one for one in (rest or {}).values() if isinstance(one, Look) and one.slots > 0)]
        for one in looks:
            if one.version != __version__:
                message = f"a worker has motorfit {one.version}, the client {__version__}"
                raise UsageError(message, "Install the same version everywhere.")
        self.slots = max(1, sum(one.slots for one in looks[1:]))
        self.is_shared = shared if shared is not None else all(one.marks == marks for one in looks)

    def _first_look(self, paths: list[str]) -> Look:
        options = self.options
        key = f"motorfit-look-{self.token}"
        call = parcel(look, paths, options.resources)
        needed = options.resources or None
        future = self.client.submit(pickle.loads, call, key=key, pure=False, resources=needed, retries=2)
        try:
            found: Look = future.result(timeout=options.wait)
            return found
        except Late:
            needs = f" with {options.resources}" if options.resources else ""
            message = f"no worker{needs} took a task within {options.wait} s"
            remedy = "Start workers that have them, as in dask worker --resources GPU=1, or give a longer wait."
            raise DeviceError(message, remedy) from None
        except ImportError as error:
            raise _missing(error) from error
        finally:
            with suppress(Exception):
                self.client.cancel([future])

    def _count(self) -> int:
        """Into how many shards: enough for all workers, whole motors where that is possible."""
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
                remedy = "Name recordings from the study's folder on; or give shared=True if workers do see them."
                raise UsageError(message, remedy)

    def _task(self, index: int) -> Task:
        shard, options = (index, self.count), self.options
        common = (shard, __version__, options.threads, options.resources)
        results = {} if self.is_shared and not self.failed_before else self.plan.finished(shard)
        self.failed_of.setdefault(index, _failed(results) if self.failed_before else 0)
        if self.is_shared:
            return Task(*common, folders=(str(self.plan.folder), str(self.plan.origin)))
        recordings = {path: contents(self.plan.origin / path) for path in self.plan.recordings(shard)}
        return Task(*common, manifest=self.manifest, recordings=recordings, results=results)

    def _fill(self, ended: as_completed) -> None:
        """Submits as many shards as keep the workers busy."""
        if not self.waiting:
            return
        room = max(WINDOW, 2 * self.slots, 2 * sum(self.client.nthreads().values()))
        while self.waiting and len(self.pending) < room:
            index, attempt = self.waiting.popleft()
            key = f"motorfit-sweep-{self.plan.digest[:16]}-{self.token}-{index}-of-{self.count}-{attempt}"
            with warnings.catch_warnings():
                # What travels is needed once, and by one worker: to scatter it would lose it with that worker.
                warnings.filterwarnings("ignore", message="(?s).*large", category=UserWarning)
                future = self.client.submit(
                    pickle.loads,
                    parcel(run, self._task(index)),
                    key=key,
                    pure=False,
                    retries=self.options.retries,
                    resources=self.options.resources or None,
                )
            self.pending[key] = (future, index, attempt)
            ended.add(future)

    def _end(self, future: Future[Any]) -> bool:
        """Takes what came of a shard; tells whether to go on."""
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
        # Only now: what is interrupted until here is taken by `_give_up`.
        del self.pending[str(future.key)]
        # A worker was killed too often, or gave the shard up though we did not.
        is_left = isinstance(fault, KilledWorker) or (done is not None and done.tally["stop"] != "done")
        if is_left and attempt <= self.options.retries:
            self.waiting.appendleft((index, attempt + 1))
        elif is_left:
            message = f"shard {index}/{self.count} was ended with its worker again and again ({attempt} times)"
            remedy = "See the workers' logs: most often memory is short. Give them more, or more shards."
            self.faults.append(MotorfitError(message, remedy))
        elif fault is not None:
            self.faults.append(_missing(fault) if isinstance(fault, ImportError) else fault)
        return self._tell()

    def _take(self, done: Done) -> None:
        if done.results is not None:
            self.plan.take(done.shard, done.results)
        index, tally = done.shard[0], done.tally
        self.shards_done += tally["stop"] == "done"
        self.left[index - 1] = tally["runs"] - tally["before"] - tally["finished"]
        self.failed += tally["failed"] - self.failed_of[index]
        self.failed_of[index] = tally["failed"]

    def _tell(self) -> bool:
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
        """Keeps what is finished and not yet taken, and ends the rest."""
        for future, _, _ in self.pending.values():
            if future.status == "finished":
                with suppress(Exception):
                    self._take(future.result(timeout=30))
        if self.pending:
            with suppress(Exception):
                self.client.cancel([future for future, _, _ in self.pending.values()])


def _missing(error: ImportError) -> UsageError:
    """What a worker without motorfit comes to."""
    return UsageError(f"a worker cannot import motorfit: {error}", f"Install motorfit {__version__} on every worker.")


def _failed(results: Mapping[str, bytes]) -> int:
    """How many runs of results files have no result."""
    lines = (line for content in results.values() for line in content.splitlines() if b'"stop":"failed"' in line)
    return len({json.loads(line)["id"] for line in lines})


def _check_instructions(folder: pathlib.Path) -> None:
    """Warns where results come from machines that may round otherwise."""
    found = set()
    for path in folder.glob("results-*-of-*.jsonl"):
        with open(path, "rb") as file:
            with suppress(ValueError):
                found.add(json.loads(file.readline()).get("instructions"))
    if len(found) > 1:
        names = ", ".join(sorted(map(str, found)))
        warnings.warn(f"the results were made with {names} instructions: their last digits may differ", stacklevel=3)
