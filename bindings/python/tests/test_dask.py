"""Sweeps on Dask workers: the results file equals that of the command line program byte for byte, also after failures."""

import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from _thread import interrupt_main

import numpy as np
import pytest

import motorfit
from conftest import M2, step
from test_sweep import ids, write_study

distributed = pytest.importorskip("distributed")
config = pytest.importorskip("dask").config
dask = pytest.importorskip("motorfit.dask")
wait_for_lock = pytest.importorskip("motorfit._shard").wait_for_lock

# One recording lies outside of the study's folder, one is not a valid recording.
STUDY = """
recordings = ["line/*.csv", "../aside/one.csv", "lost.csv"]
methods = ["gwo"]
population = [60]
generations = [100]
seeds = "1..{seeds}"
"""


@contextlib.contextmanager
def cluster(**options):
    settings = {"threads_per_worker": 1, "processes": True, "dashboard_address": ":0", "n_workers": 2, **options}
    with distributed.LocalCluster(**settings) as local, distributed.Client(local) as client:
        client.wait_for_workers(settings["n_workers"])
        yield client


@pytest.fixture(scope="module")
def client():
    with cluster() as client:
        yield client


def until(is_so, seconds=60):
    deadline = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < deadline, "it took too long"
        time.sleep(0.05)


def is_idle(client):
    """Returns True if no worker executes a task, including cancelled ones."""
    return not any(client.run(lambda dask_worker: len(dask_worker.state.executing)).values())


def write(folder, seeds):
    (folder / "aside").mkdir()
    (folder / "aside" / "one.csv").write_text(step(seed=9).to_csv())
    return write_study(folder / "study", STUDY.format(seeds=seeds), motors=2)


def by_program(program, study, out):
    program("sweep", study, "--out", out, "--no-progress")
    return (out / "results.jsonl").read_bytes()


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return write(tmp_path_factory.mktemp("study"), 60)


@pytest.fixture(scope="module")
def expected(program, study, tmp_path_factory):
    return by_program(program, study, tmp_path_factory.mktemp("expected") / "out")


@pytest.fixture(scope="module")
def long_study(tmp_path_factory):
    """Returns a study of some seconds on two cores, most of it after the first of six shards."""
    return write(tmp_path_factory.mktemp("long"), LONG)


@pytest.fixture(scope="module")
def long_expected(program, long_study, tmp_path_factory):
    return by_program(program, long_study, tmp_path_factory.mktemp("long-expected") / "out")


RUNS, GOOD = 240, 180
# Seeds of the long study, and of one that takes minutes and is never completed.
LONG, ENDLESS = 480, 100_000


def check(found, expected):
    """Asserts that the results are equal to the expected bytes, and that no run is missing or repeated."""
    assert found["results"].read_bytes() == expected
    merged = [json.loads(line) for line in expected.splitlines()]
    assert [row["id"] for row in merged] == list(range(found["runs"]))
    good = [row["id"] for row in merged if row["stop"] != "failed"]
    assert len(good) == found["runs"] * 3 // 4
    assert (found["missing"], found["failed"]) == (0, found["runs"] - len(good))
    assert ids(found["results"].parent) == good


@pytest.mark.parametrize("shared", [None, False])
def test_the_bytes_are_those_of_one_machine(client, study, expected, tmp_path, shared):
    seen = []
    found = dask.sweep(client, study, tmp_path / "out", shards=5, shared=shared, progress=seen.append)
    check(found, expected)
    assert [state.shards_done for state in seen] == list(range(6)) and {state.shards for state in seen} == {5}
    assert [state.done for state in seen] == list(range(0, RUNS + 1, RUNS // 5)) and seen[-1].failed == RUNS - GOOD
    # Only failed runs are repeated.
    last = []
    again = dask.sweep(client, study, tmp_path / "out", shared=shared, progress=last.append)
    assert again["results"].read_bytes() == expected and ids(tmp_path / "out") == list(range(GOOD))
    assert (last[0].before, last[0].done, last[0].failed) == (GOOD, GOOD, 0)
    assert (last[-1].done, last[-1].failed) == (RUNS, RUNS - GOOD)


FIELDS = ("done", "total", "before", "failed", "seconds", "rate", "remaining")


@pytest.mark.parametrize("shared", [None, False])
def test_progress_is_that_of_one_machine(client, tmp_path, shared):
    """A motor with an unreadable file is tried again, one that cannot be identified is not."""
    folder = tmp_path / "study"
    study = write_study(folder, 'recordings = ["line/*.csv", "lost.csv"]\nmethods = ["sm"]\nseeds = "1..20"', motors=3)
    rest = motorfit.simulate(M2, np.arange(0, 1, 0.001), np.zeros(1000))
    (folder / "line" / "1.csv").write_text(rest.to_csv())
    for name in ("here", "there"):
        motorfit.Sweep.plan(study, tmp_path / name).run(shard=(1, 2))
    here, there = [], []
    motorfit.sweep(study, tmp_path / "here", progress=here.append)
    dask.sweep(client, study, tmp_path / "there", shards=5, shared=shared, progress=there.append)
    assert set(FIELDS) == {name for name in dir(here[-1]) if not name.startswith("_")}
    same = ("done", "total", "before", "failed")
    ends = [tuple(getattr(one[-1], name) for name in same) for one in (here, there)]
    assert ends[0] == ends[1] == (80, 80, 30, 40)
    first, second = there[:2]
    assert (first.done, first.failed, first.rate, first.remaining) == (30, 10, None, None)
    assert second.rate == (second.done - 30) / second.seconds > 0
    assert second.remaining == (80 - second.done) / second.rate > 0 and there[-1].remaining == 0
    assert [state.shards_done for state in there] == list(range(6)) and {state.shards for state in there} == {5}


@pytest.mark.parametrize("answer", [False, np.False_, np.bool_(0)])
def test_a_callback_that_returns_false_ends_the_sweep(client, study, tmp_path, answer):
    found = dask.sweep(client, study, tmp_path / "out", progress=lambda _: answer)
    assert found["missing"] == RUNS


@pytest.mark.parametrize("answer", [None, True, np.True_, 0, "", [], np.array([])])
def test_other_return_values_do_not_end_it(client, tmp_path, answer):
    study = write_study(tmp_path / "study", 'recordings = "line/*.csv"\nmethods = "sm"', motors=1)
    assert dask.sweep(client, study, tmp_path / "out", progress=lambda _: answer)["missing"] == 0


@pytest.mark.parametrize(("shared", "allowed"), [(False, 3), (True, 3), (False, 0)])
def test_a_killed_worker_costs_a_retry_and_nothing_else(long_study, long_expected, tmp_path, shared, allowed):
    """Holds also if Dask gives up a task after one killed worker."""
    killed, seen = [], []

    def kill(state):
        seen.append(state)
        at_work = [address for address, keys in client.processing().items() if keys]
        if state.shards_done and at_work and not killed:
            os.kill(client.run(os.getpid)[at_work[0]], signal.SIGKILL)
            killed.append(at_work[0])

    with config.set({"distributed.scheduler.allowed-failures": allowed}), cluster() as client:
        before = set(client.run(os.getpid).values())
        found = dask.sweep(client, long_study, tmp_path / "out", shards=6, shared=shared, progress=kill)
        until(lambda: len(set(client.run(os.getpid, on_error="ignore").values()) - before) == 1)
        after = set(client.run(os.getpid).values())
    assert len(killed) == 1, "no worker was killed at work"
    assert len(before & after) == 1
    check(found, long_expected)
    # Each run is counted once.
    assert (seen[-1].shards_done, seen[-1].done, seen[-1].failed) == (6, found["runs"], found["failed"])
    assert all(state.done <= state.total for state in seen)


def test_an_interrupted_sweep_is_resumed_elsewhere(client, program, study, expected, tmp_path):
    """Interruptions by the callback's return value and by its exception; the command line program runs the rest."""
    out = tmp_path / "out"
    # With 40 shards most are not yet submitted when the first is finished.
    most, first = dask.WINDOW, 40
    partly = dask.sweep(client, study, out, shards=first, shared=False, progress=lambda p: p.shards_done < 1)
    assert 0 < RUNS - partly["missing"] <= most * RUNS // first
    kept = ids(out)

    def failing(state):
        if state.done > state.before:
            raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        dask.sweep(client, study, out, shards=37, progress=failing)
    until(lambda: is_idle(client))
    assert len(kept) == len(set(kept)) > 0 and set(kept) <= set(ids(out)) and len(ids(out)) == len(set(ids(out))) < GOOD
    program("sweep", study, "--out", out, "--no-progress")
    assert (out / "results.jsonl").read_bytes() == expected


def test_ctrl_c_keeps_all_that_is_finished(client, study, expected, tmp_path, monkeypatch):
    """Includes shards whose results have not been collected yet."""
    futures = []

    def submit(*args, **options):
        futures.append(whole(*args, **options))
        return futures[-1]

    def press(state):
        if state.shards_done == 1:
            until(lambda: all(future.status == "finished" for future in futures[1:]))
            signal.raise_signal(signal.SIGINT)

    whole = client.submit
    monkeypatch.setattr(client, "submit", submit)
    with pytest.raises(KeyboardInterrupt):
        dask.sweep(client, study, tmp_path / "out", shards=4, shared=False, progress=press)
    # One inspection of a worker, and four shards.
    assert len(futures) == 1 + 4 and ids(tmp_path / "out") == list(range(GOOD))
    check(motorfit.sweep(study, tmp_path / "out"), expected)


@contextlib.contextmanager
def pressed(is_so, seconds=60):
    """Sends Ctrl-C once `is_so()` holds or the time is up; yields a list that is empty in the latter case."""
    was, over = [], threading.Event()

    def watch():
        deadline = time.monotonic() + seconds
        while not over.wait(0.05):
            if is_so():
                was.append(True)
            if was or time.monotonic() > deadline:
                interrupt_main()
                return

    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        yield was
    finally:
        over.set()
        watcher.join()


def test_ctrl_c_frees_the_workers(client, tmp_path):
    """The interruption comes during shards that take minutes each."""
    study, out = write(tmp_path, ENDLESS), tmp_path / "out"
    plan = motorfit.Sweep.plan(study, out)

    def done():
        return [shard["done"] for shard in plan.status()["shards"]]

    with pressed(lambda: any(done())) as was, pytest.raises(KeyboardInterrupt):
        dask.sweep(client, study, out, shards=4, shared=True)
    assert was, "no shard began"
    until(lambda: is_idle(client))
    assert any(done()) and max(done()) < plan.runs // 4
    kept = ids(out)
    assert len(kept) == len(set(kept))
    # The same call resumes the sweep.
    seen = []
    found = dask.sweep(client, study, out, shards=4, shared=True, progress=lambda p: seen.append(p) or False)
    assert seen[0].before == len(kept) and found["runs"] - found["missing"] >= len(kept)


def test_a_run_that_is_about_to_end_is_waited_for(study, tmp_path):
    plan = motorfit.Sweep.plan(study, tmp_path / "out")
    begun, may_end = threading.Event(), threading.Event()

    def hold(_):
        begun.set()
        may_end.wait(60)

    other = threading.Thread(target=plan.run, kwargs={"progress": hold})
    other.start()
    try:
        assert begun.wait(60)
        with pytest.raises(motorfit.DataError, match="another run"):
            plan.run()
        threading.Timer(0.3, may_end.set).start()
        wait_for_lock(plan, (1, 1))
        assert may_end.is_set() and plan.run()["before"] == GOOD
    finally:
        may_end.set()
        other.join()


def test_an_unreadable_recording_fails_as_on_one_machine(client, program, tmp_path):
    study = write_study(tmp_path / "study", 'recordings = ["line/*.csv"]\nmethods = ["sm"]\nseeds = "1..4"', motors=4)
    plan = motorfit.Sweep.plan(study, tmp_path / "here")
    motorfit.Sweep.plan(study, tmp_path / "there")
    line = study.parent / "line"
    (line / "0.csv").unlink()
    (line / "1.csv").write_text(step(seed=77).to_csv())
    (line / "2.csv").unlink()
    (line / "2.csv").mkdir()
    plan.run()
    here = plan.merge()["results"].read_text()
    program("sweep", "run", tmp_path / "there", "--no-progress")
    program("sweep", "merge", tmp_path / "there")
    assert (tmp_path / "there" / "results.jsonl").read_text() == here
    (tmp_path / "dask").mkdir()
    (tmp_path / "dask" / "manifest.json").write_bytes((plan.folder / "manifest.json").read_bytes())

    # Planning would reject the changed recordings.
    class Planned:
        _check_limits = motorfit.Sweep._check_limits

        @staticmethod
        def plan(study, out):
            return motorfit.Sweep.open(out)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dask, "Sweep", Planned)
        found = dask.sweep(client, study, tmp_path / "dask", shared=False)
    assert found["results"].read_text() == here
    assert "has changed since" in here and "No such file" in here and here.count('"stop":"failed"') == 12


def test_absolute_paths_do_not_travel(client, tmp_path):
    study = write_study(tmp_path / "study", 'recordings = "line/*.csv"\nmethods = "sm"', motors=1)
    far = tmp_path / "far.csv"
    far.write_text(step(seed=3).to_csv())
    study.write_text(f'recordings = ["line/0.csv", "{far}"]\nmethods = "sm"')
    with pytest.raises(motorfit.UsageError, match="absolute path") as caught:
        dask.sweep(client, study, tmp_path / "out", shared=False)
    assert "shared=True" in caught.value.remedy
    found = dask.sweep(client, study, tmp_path / "out")
    assert (found["missing"], found["failed"]) == (0, 0)


def test_paths_stay_below_the_workers_folder(tmp_path):
    from motorfit._shard import MISSING, write_recordings

    folder = write_recordings({"../../a.csv": b"a", "x/../../b.csv": b"b", "c/d.csv": b"d", "e.csv": MISSING}, tmp_path)
    assert (folder / "../../a.csv").read_bytes() == b"a" and (folder / "x/../../b.csv").read_bytes() == b"b"
    assert (folder / "c/d.csv").read_bytes() == b"d" and not (folder / "e.csv").exists()
    assert all(tmp_path in path.resolve().parents for path in folder.rglob("*"))
    with pytest.raises(motorfit.UsageError, match="outside"):
        write_recordings({"/etc/motorfit.csv": b"x"}, tmp_path / "other")


def test_resources_are_respected(client, study, expected, tmp_path):
    with pytest.raises(motorfit.DeviceError, match="no worker with .*GPU"):
        dask.sweep(client, study, tmp_path / "out", resources={"GPU": 1}, wait=1)
    with cluster(threads_per_worker=2, n_workers=1, resources={"GPU": 1}) as other:
        found = other.run(motorfit._shard.inspect_worker, [], {"GPU": 1})
        assert [one.slots for one in found.values()] == [1]
        check(dask.sweep(other, study, tmp_path / "out", shards=3, resources={"GPU": 1}, threads=64), expected)


def test_errors_of_workers_come_back(client, study, tmp_path, monkeypatch):
    monkeypatch.setattr(dask, "__version__", "0.0.1")
    with pytest.raises(motorfit.UsageError, match="motorfit"):
        dask.sweep(client, study, tmp_path / "out")
    monkeypatch.undo()
    out = tmp_path / "other"

    def spoil(state):
        if state.shards_done == 0:
            (out / "results-2-of-2.jsonl").write_text("no results\n")

    with pytest.raises(motorfit.DataError, match="not a results file") as caught:
        dask.sweep(client, study, out, shards=2, shared=True, retries=0, progress=spoil)
    assert caught.value.remedy


def test_different_instruction_sets_give_a_warning(client, study, expected, tmp_path):
    out = tmp_path / "out"
    motorfit.Sweep.plan(study, out).run(shard=(1, 4))
    path = out / "results-1-of-4.jsonl"
    head, rest = path.read_text().split("\n", 1)
    path.write_text(json.dumps({**json.loads(head), "instructions": "of another kind"}) + "\n" + rest)
    with pytest.warns(UserWarning, match="of another kind"):
        check(dask.sweep(client, study, out, shards=3, retries=0), expected)


@contextlib.contextmanager
def threads():
    """Yields a client of a cluster in this process."""
    with distributed.Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address=":0") as client:
        yield client


def test_identify_can_be_mapped_over_workers(client):
    records = [step(seed=seed) for seed in range(1, 5)]
    found = client.gather(client.map(motorfit.identify, records, threads=1))
    for one, record in zip(found, records, strict=True):
        assert one.parameters == motorfit.identify(record, threads=1).parameters


def test_threads_of_one_process_are_a_cluster_too(study, expected, tmp_path):
    with threads() as client:
        check(dask.sweep(client, study, tmp_path / "out", shared=False), expected)


def test_an_error_on_a_worker_is_tried_again(study, expected, tmp_path, monkeypatch):
    broken = iter([True, False, True])
    whole = motorfit._shard.write_recordings

    def failing(recordings, root):
        if next(broken, False):
            raise OSError("no room")
        return whole(recordings, root)

    monkeypatch.setattr(motorfit._shard, "write_recordings", failing)
    with threads() as client:
        check(dask.sweep(client, study, tmp_path / "out", shards=3, shared=False, retries=2), expected)
        broken = iter([True])
        with pytest.raises(OSError, match="no room"):
            dask.sweep(client, study, tmp_path / "other", shards=3, shared=False, retries=0)
    # The other shards are kept.
    assert len(ids(tmp_path / "other")) == GOOD * 2 // 3


def test_arguments_are_checked_before_the_work(client, tmp_path):
    study = write_study(tmp_path / "study", 'recordings = "line/*.csv"\nmethods = "sm"', motors=1)
    wrong = [
        *({"shards": value} for value in (0, -3, 2.5, "4", True, 10**7)),
        *({"retries": value} for value in (None, -1, 1.5, True)),
        *({"threads": value} for value in (0, -1, 1.5, "2", False)),
        *({"wait": value} for value in (-1, math.nan, math.inf, "60", True)),
        *({"shared": value} for value in ("no", 1, 0)),
        *({"resources": value} for value in ("GPU", ["GPU"], {"GPU": "1"}, {"GPU": -1}, {"GPU": math.nan}, {1: 1})),
        *({"progress": value} for value in (True, "print", 3)),
        {"limits": {"R": (2, 1)}},
    ]
    for settings in wrong:
        with pytest.raises(motorfit.UsageError, match=next(iter(settings))) as caught:
            dask.sweep(client, study, tmp_path / "out", **settings)
        assert caught.value.remedy, settings
    assert not (tmp_path / "out").exists()
    # Numpy scalars are accepted.
    numbers = {"shards": np.int64(2), "retries": np.int64(0), "threads": np.int32(1), "wait": np.float32(60)}
    found = dask.sweep(client, study, tmp_path / "out", shared=np.False_, resources={}, **numbers)
    assert (found["missing"], found["failed"]) == (0, 0)


def test_a_wrong_client_is_rejected(client, study, tmp_path):
    address = client.scheduler.address
    cluster = client.cluster
    with distributed.Client(address) as closed:
        pass
    remedies = {address: f"Client('{address}')", cluster: "Client(cluster)", None: "Client", closed: "open"}
    for other, remedy in remedies.items():
        with pytest.raises(motorfit.UsageError, match="the client is") as caught:
            dask.sweep(other, study, tmp_path / "out")
        assert remedy in caught.value.remedy
    assert not (tmp_path / "out").exists()


# Code that makes the import of a package fail.
WITHOUT = "import sys; sys.modules[{name!r}] = None; "


def test_import_without_dask_names_the_missing_package():
    program = WITHOUT.format(name="distributed") + "import motorfit.dask"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "ImportError: motorfit.dask needs distributed: pip install motorfit[dask]" in done.stderr


@contextlib.contextmanager
def served(kind, *arguments, without="nothing_that_is_there", **options):
    """Starts a Dask server in another process that cannot import `without`; yields its address."""
    program = WITHOUT.format(name=without) + (
        "import asyncio, distributed\n"
        "async def main():\n"
        f"    async with distributed.{kind}(*{arguments!r}, **{options!r}) as server:\n"
        "        print(server.address, flush=True)\n"
        "        await server.finished()\n"
        "asyncio.run(main())\n"
    )
    server = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    try:
        address = server.stdout.readline().strip()
        assert address, f"no {kind} began"
        yield address
    finally:
        server.kill()
        server.wait()


@contextlib.contextmanager
def by_hand(folder, scheduler, worker):
    with (
        served("Scheduler", port=0, dashboard_address=":0", **scheduler) as address,
        served("Worker", address, nthreads=2, dashboard=False, local_directory=str(folder), **worker),
        distributed.Client(address) as client,
    ):
        yield client


def test_a_scheduler_needs_no_motorfit(study, expected, tmp_path):
    with by_hand(tmp_path, {"without": "motorfit"}, {}) as client:
        for shared in (None, False):
            check(dask.sweep(client, study, tmp_path / f"out-{shared}", shared=shared), expected)


def test_a_worker_needs_motorfit(study, tmp_path):
    with by_hand(tmp_path, {}, {"without": "motorfit"}) as client:
        with pytest.raises(motorfit.UsageError, match="cannot import motorfit") as caught:
            dask.sweep(client, study, tmp_path / "out")
    assert motorfit.__version__ in caught.value.remedy and "every worker" in caught.value.remedy
