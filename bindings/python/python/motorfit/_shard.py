"""Shards on Dask workers: the task that is sent, its execution on the worker, and the result that is returned."""

from __future__ import annotations

import os
import pathlib
import pickle
import tempfile
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from distributed import get_worker

from ._errors import UsageError
from ._motorfit import Sweep, __version__

# Sent instead of the bytes of a recording that the client cannot read, so that the run fails on the worker in the same way.
MISSING, DENIED, FOLDER = "missing", "denied", "folder"
# Longest wait for an abandoned run of the same shard to end, and interval between checks [s].
PATIENCE, CHECK_INTERVAL = 30.0, 0.5

Fingerprint = tuple[int, int, int] | None


@dataclass(frozen=True)
class Task:
    """A shard with its settings and, without a shared folder, its files."""

    shard: tuple[int, int]
    version: str
    threads: int | None
    resources: Mapping[str, float]
    #: Folder of the sweep and folder of the study if the worker sees them; the fields below are then empty.
    folders: tuple[str, str] | None = None
    manifest: bytes = b""
    recordings: Mapping[str, bytes | str] = field(default_factory=dict)
    #: Results files by name, with the finished runs of the shard.
    results: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Done:
    """Result of a shard."""

    shard: tuple[int, int]
    #: Contents of the results file; None if it was written into the folder of the sweep.
    results: bytes | None
    #: Numbers of runs, as `motorfit sweep run --json` prints them.
    tally: dict[str, Any]


@dataclass(frozen=True)
class WorkerInfo:
    """Properties of a worker."""

    version: str
    #: Number of shards that it runs at the same time.
    slots: int
    #: Fingerprints of the files that it was asked for.
    fingerprints: list[Fingerprint]


class Call:
    """Function call that is executed by unpickling."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        self.function, self.arguments = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self.function, self.arguments


def pack_call(function: Callable[..., Any], *arguments: Any) -> bytes:
    """Returns a call as bytes for ``pickle.loads`` on a worker, so that the scheduler does not need motorfit."""
    return pickle.dumps(Call(function, arguments))


def fingerprint(path: str | os.PathLike[str]) -> Fingerprint:
    """Returns the inode, size and modification time of a file, which distinguish it from a copy; None if it does not exist."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


def inspect_worker(paths: Sequence[str], resources: Mapping[str, float], dask_worker: Any = None) -> WorkerInfo:
    """Returns the properties of the worker that executes it."""
    worker = dask_worker if dask_worker is not None else get_worker()
    return WorkerInfo(__version__, slots(worker, resources), [fingerprint(path) for path in paths])


def slots(worker: Any, resources: Mapping[str, float]) -> int:
    """Returns the number of shards with these resources that a worker runs at the same time."""
    available = worker.state.total_resources
    fit = [int(available.get(name, 0) // need) for name, need in resources.items() if need > 0]
    return int(min([worker.state.nthreads, *fit]))


def read_recording(path: str | os.PathLike[str]) -> bytes | str:
    """Returns the bytes of a recording, or the reason why it cannot be read."""
    try:
        return pathlib.Path(path).read_bytes()
    except PermissionError:
        return DENIED
    except IsADirectoryError:
        return FOLDER
    except OSError:
        return MISSING


def write_recordings(recordings: Mapping[str, bytes | str], root: pathlib.Path) -> pathlib.Path:
    """Writes recordings below ``root`` and returns the folder of relative paths, deep enough that ``..`` stays inside."""
    folder = root.joinpath("recordings", *["up"] * max([levels_up(path) for path in recordings], default=0))
    folder.mkdir(parents=True)
    for path, content in recordings.items():
        if content == MISSING:
            continue
        target = folder
        *folders, name = pathlib.PurePath(path).parts
        for part in folders:
            target = target / part
            if part != "..":
                target.mkdir(exist_ok=True)
        target = target / name
        if os.path.commonpath([root, os.path.normpath(target)]) != str(root):
            raise UsageError(f"the recording {path} would be written outside of the worker's folder", "Give a relative path.")
        if content == FOLDER:
            target.mkdir(exist_ok=True)
        else:
            target.write_bytes(content if isinstance(content, bytes) else b"")
            if content == DENIED:
                target.chmod(0)
    return folder


def levels_up(path: str) -> int:
    """Returns the number of levels that a path goes above its start."""
    level = lowest = 0
    for part in pathlib.PurePath(path).parts:
        level += -1 if part == ".." else 1
        lowest = min(lowest, level)
    return -lowest


def run(task: Task) -> Done:
    """Runs a shard on the worker that executes this."""
    worker = get_worker()
    key = worker.get_current_task()
    if task.version != __version__:
        message = f"the worker {worker.address} has motorfit {__version__}, the client {task.version}"
        raise UsageError(message, "Install the same version everywhere.")
    most = max(worker.state.nthreads, 1)
    threads = min(task.threads, most) if task.threads else most // max(slots(worker, task.resources), 1)

    def progress(_: object) -> bool:
        """Returns False if the client has cancelled the shard."""
        return getattr(worker.state.tasks.get(key), "state", None) != "cancelled"

    def work(sweep: Sweep, recordings: str | os.PathLike[str]) -> dict[str, Any]:
        return sweep.run(shard=task.shard, threads=threads, progress=progress, recordings=recordings)

    if task.folders is not None:
        folder, origin = task.folders
        sweep = Sweep.open(folder)
        wait_for_lock(sweep, task.shard)
        return Done(task.shard, None, work(sweep, origin))
    with tempfile.TemporaryDirectory(prefix="motorfit-", dir=worker.local_directory) as place:
        root = pathlib.Path(place).resolve()
        planned = root / "sweep"
        planned.mkdir()
        for name, content in {"manifest.json": task.manifest, **task.results}.items():
            (planned / name).write_bytes(content)
        tally = work(Sweep.open(planned), write_recordings(task.recordings, root))
        index, count = task.shard
        return Done(task.shard, (planned / f"results-{index}-of-{count}.jsonl").read_bytes(), tally)


def wait_for_lock(sweep: Sweep, shard: tuple[int, int]) -> None:
    """Waits for an abandoned run of the same shard to end and release its lock."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and is_running(sweep.status()["shards"], shard):
        time.sleep(CHECK_INTERVAL)


def is_running(shards: Iterable[Mapping[str, Any]], shard: tuple[int, int]) -> bool:
    """Returns True if a process is running the shard."""
    return any(one["running"] and (one["index"], one["count"]) == shard for one in shards)
