"""A shard on a worker of Dask: what travels there, how it is run, what comes back. Used by motorfit.dask."""

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

# What stands for the bytes of a recording that the client cannot read, so that the worker cannot either.
MISSING, DENIED, FOLDER = "missing", "denied", "folder"
# How long a run of the same shard that was given up may take to end, in s, and how often it is looked for.
PATIENCE, LOOK = 30.0, 0.5

Mark = tuple[int, int, int] | None


@dataclass(frozen=True)
class Task:
    """A shard with all that it needs."""

    shard: tuple[int, int]
    version: str
    threads: int | None
    resources: Mapping[str, float]
    #: The folder of the sweep and that of the study, where the worker sees them; all that follows is then empty.
    folders: tuple[str, str] | None = None
    manifest: bytes = b""
    recordings: Mapping[str, bytes | str] = field(default_factory=dict)
    #: Results files by name: what is finished.
    results: Mapping[str, bytes] = field(default_factory=dict)


@dataclass(frozen=True)
class Done:
    """What a shard made."""

    shard: tuple[int, int]
    #: Its results file, where it was not written into the folder of the sweep.
    results: bytes | None
    #: What `motorfit sweep run --json` prints.
    tally: dict[str, Any]


@dataclass(frozen=True)
class Look:
    """What a worker is."""

    version: str
    #: Shards that it does at the same time.
    slots: int
    marks: list[Mark]


class Call:
    """A call that is made where it is unpickled."""

    def __init__(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        self.function, self.arguments = function, arguments

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return self.function, self.arguments


def parcel(function: Callable[..., Any], *arguments: Any) -> bytes:
    """A call for ``pickle.loads`` on a worker: a scheduler, which passes bytes on, needs no motorfit for it."""
    return pickle.dumps(Call(function, arguments))


def mark(path: str | os.PathLike[str]) -> Mark:
    """What tells a file from its copy on another file system; `None` where there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_ino, found.st_size, found.st_mtime_ns


def look(paths: Sequence[str], resources: Mapping[str, float], dask_worker: Any = None) -> Look:
    """Looks at the worker that it is called on."""
    worker = dask_worker if dask_worker is not None else get_worker()
    return Look(__version__, slots(worker, resources), [mark(path) for path in paths])


def slots(worker: Any, resources: Mapping[str, float]) -> int:
    """How many shards that need some resources a worker does at the same time."""
    there = worker.state.total_resources
    fit = [int(there.get(name, 0) // need) for name, need in resources.items() if need > 0]
    return int(min([worker.state.nthreads, *fit]))


def contents(path: str | os.PathLike[str]) -> bytes | str:
    """The bytes of a recording, or why there are none."""
    try:
        return pathlib.Path(path).read_bytes()
    except PermissionError:
        return DENIED
    except IsADirectoryError:
        return FOLDER
    except OSError:
        return MISSING


def lay(recordings: Mapping[str, bytes | str], root: pathlib.Path) -> pathlib.Path:
    """Lays recordings below `root`; gives the folder that their paths start at, so deep that ``..`` stays below."""
    folder = root.joinpath("recordings", *["up"] * max([climb(path) for path in recordings], default=0))
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
            raise UsageError(f"the recording {path} would lie outside of the worker's folder", "Give a relative path.")
        if content == FOLDER:
            target.mkdir(exist_ok=True)
        else:
            target.write_bytes(content if isinstance(content, bytes) else b"")
            if content == DENIED:
                target.chmod(0)
    return folder


def climb(path: str) -> int:
    """How far above its start a path goes."""
    level = lowest = 0
    for part in pathlib.PurePath(path).parts:
        level += -1 if part == ".." else 1
        lowest = min(lowest, level)
    return -lowest


def run(task: Task) -> Done:
    """Runs a shard on the worker that this is called on."""
    worker = get_worker()
    key = worker.get_current_task()
    if task.version != __version__:
        message = f"the worker {worker.address} has motorfit {__version__}, the client {task.version}"
        raise UsageError(message, "Install the same version everywhere.")
    most = max(worker.state.nthreads, 1)
    threads = min(task.threads, most) if task.threads else most // max(slots(worker, task.resources), 1)

    def progress(_: object) -> bool:
        """Whether the client still wants the shard."""
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
        tally = work(Sweep.open(planned), lay(task.recordings, root))
        index, count = task.shard
        return Done(task.shard, (planned / f"results-{index}-of-{count}.jsonl").read_bytes(), tally)


def wait_for_lock(sweep: Sweep, shard: tuple[int, int]) -> None:
    """Waits for a run of the same shard that was given up and is about to end."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until and is_running(sweep.status()["shards"], shard):
        time.sleep(LOOK)


def is_running(shards: Iterable[Mapping[str, Any]], shard: tuple[int, int]) -> bool:
    """Whether a shard is being run."""
    return any(one["running"] and (one["index"], one["count"]) == shard for one in shards)
