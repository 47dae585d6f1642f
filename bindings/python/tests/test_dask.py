"""Sweeps over workers: the bytes of one machine, whatever happens to the workers."""

import contextlib
import json
import os
import signal
import threading
import time

import pytest

import motorfit
from conftest import step
from test_sweep import ids, write_study

distributed = pytest.importorskip("distributed")
config = pytest.importorskip("dask").config
dask = pytest.importorskip("motorfit.dask")
wait_for_lock = pytest.importorskip("motorfit._shard").wait_for_lock

# One motor outside of the study's folder, one that is none.
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
    """Some seconds of work for two cores."""
    return write(tmp_path_factory.mktemp("long"), LONG)


@pytest.fixture(scope="module")
def long_expected(program, long_study, tmp_path_factory):
    return by_program(program, long_study, tmp_path_factory.mktemp("long-expected") / "out")


RUNS, GOOD = 240, 180
# Seeds of the long study, and so runs of one of four shards.
LONG = 280


def check(found, expected):
    """The bytes are right, and no run is lost or doubled."""
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
    assert [state.done for state in seen] == list(range(6)) and {state.shards for state in seen} == {5}
    assert (seen[-1].runs_done, seen[-1].runs, seen[-1].failed) == (RUNS, RUNS, RUNS - GOOD)
    # Failures are tried again, all else is not.
    again = dask.sweep(client, study, tmp_path / "out", shared=shared)
    assert again["results"].read_bytes() == expected and ids(tmp_path / "out") == list(range(GOOD))


@pytest.mark.parametrize(("shared", "allowed"), [(False, 3), (True, 3), (False, 0)])
def test_a_killed_worker_costs_a_retry_and_nothing_else(long_study, long_expected, tmp_path, shared, allowed):
    """Also where Dask itself gives a task up with its first worker."""
    killed = []

    def kill(state):
        if state.done and not killed:
            # One that is at work.
            at_work = [address for address, keys in client.processing().items() if keys]
            os.kill(client.run(os.getpid)[at_work[0]], signal.SIGKILL)
            killed.extend(at_work[:1])

    with config.set({"distributed.scheduler.allowed-failures": allowed}), cluster() as client:
        before = set(client.run(os.getpid).values())
        found = dask.sweep(client, long_study, tmp_path / "out", shards=6, shared=shared, progress=kill)
        client.wait_for_workers(2)
        after = set(client.run(os.getpid).values())
    assert len(killed) == 1, "no worker was killed at work"
    assert len(before & after) == 1
    check(found, long_expected)


def test_what_is_interrupted_goes_on_elsewhere(client, program, study, expected, tmp_path):
    """By an answer of the callback, by an exception of it, then with other shards; the rest by the command line."""
    out = tmp_path / "out"
    partly = dask.sweep(client, study, out, shards=8, shared=False, progress=lambda p: p.done < 1)
    assert 0 < partly["missing"] < RUNS

    def failing(state):
        if state.runs_done > RUNS - partly["missing"]:
            raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        dask.sweep(client, study, out, shards=7, progress=failing)
    kept = ids(out)
    assert RUNS - partly["missing"] - 60 <= len(kept) < GOOD and len(kept) == len(set(kept))
    deadline = time.monotonic() + 20
    while any(client.processing().values()) and time.monotonic() < deadline:
        time.sleep(0.1)
    program("sweep", study, "--out", out, "--no-progress")
    assert (out / "results.jsonl").read_bytes() == expected


def until(is_so, seconds=30):
    deadline = time.monotonic() + seconds
    while not is_so():
        assert time.monotonic() < deadline, "it took too long"
        time.sleep(0.05)


def test_ctrl_c_keeps_all_that_is_finished(client, study, expected, tmp_path):
    """Also shards that are finished and have not come back yet."""

    def press(state):
        if state.done == 1:
            until(lambda: not any(client.processing().values()))
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        dask.sweep(client, study, tmp_path / "out", shards=4, shared=False, progress=press)
    assert ids(tmp_path / "out") == list(range(GOOD))
    check(motorfit.sweep(study, tmp_path / "out"), expected)


def test_ctrl_c_frees_the_workers(client, long_study, long_expected, tmp_path):
    out = tmp_path / "out"

    def shards():
        return motorfit.Sweep.open(out).status()["shards"]

    def press(state):
        if state.done == 1:
            until(lambda: any(shard["running"] and 0 < shard["done"] < LONG // 2 for shard in shards()))
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        dask.sweep(client, long_study, out, shards=4, shared=True, progress=press)
    until(lambda: not any(shard["running"] for shard in shards()))
    # One that was on its way did not go on to its end.
    assert any(0 < shard["done"] < LONG for shard in shards())
    check(dask.sweep(client, long_study, out, shards=4, shared=True), long_expected)


def test_a_run_that_is_about_to_end_is_waited_for(study, tmp_path):
    plan = motorfit.Sweep.plan(study, tmp_path / "out")
    begun = threading.Event()
    other = threading.Thread(target=plan.run, kwargs={"progress": lambda _: begun.set()})
    other.start()
    begun.wait()
    with pytest.raises(motorfit.DataError, match="another run"):
        plan.run()
    wait_for_lock(plan, (1, 1))
    assert plan.run()["before"] == GOOD
    other.join()


def test_a_recording_that_cannot_be_read_fails_as_on_one_machine(client, program, tmp_path):
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

    # A plan would say that the recordings have changed.
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
    from motorfit._shard import MISSING, lay

    folder = lay({"../../a.csv": b"a", "x/../../b.csv": b"b", "c/d.csv": b"d", "e.csv": MISSING}, tmp_path)
    assert (folder / "../../a.csv").read_bytes() == b"a" and (folder / "x/../../b.csv").read_bytes() == b"b"
    assert (folder / "c/d.csv").read_bytes() == b"d" and not (folder / "e.csv").exists()
    assert all(tmp_path in path.resolve().parents for path in folder.rglob("*"))
    with pytest.raises(motorfit.UsageError, match="outside"):
        lay({"/etc/motorfit.csv": b"x"}, tmp_path / "other")


def test_resources_are_asked_for(client, study, expected, tmp_path):
    with pytest.raises(motorfit.DeviceError, match="no worker with .*GPU"):
        dask.sweep(client, study, tmp_path / "out", resources={"GPU": 1}, wait=1)
    with cluster(threads_per_worker=2, n_workers=1, resources={"GPU": 1}) as other:
        looked = other.run(motorfit._shard.look, [], {"GPU": 1})
        assert [one.slots for one in looked.values()] == [1]
        check(dask.sweep(other, study, tmp_path / "out", shards=3, resources={"GPU": 1}, threads=64), expected)


def test_errors_of_workers_come_back(client, study, tmp_path, monkeypatch):
    monkeypatch.setattr(dask, "__version__", "0.0.1")
    with pytest.raises(motorfit.UsageError, match="motorfit"):
        dask.sweep(client, study, tmp_path / "out")
    monkeypatch.undo()
    out = tmp_path / "other"

    def spoil(state):
        if state.done == 0:
            (out / "results-2-of-2.jsonl").write_text("no results\n")

    with pytest.raises(motorfit.DataError, match="no results file") as caught:
        dask.sweep(client, study, out, shards=2, shared=True, retries=0, progress=spoil)
    assert caught.value.remedy


def test_other_instructions_are_said(client, study, expected, tmp_path):
    out = tmp_path / "out"
    motorfit.Sweep.plan(study, out).run(shard=(1, 4))
    path = out / "results-1-of-4.jsonl"
    head, rest = path.read_text().split("\n", 1)
    path.write_text(json.dumps({**json.loads(head), "instructions": "of another kind"}) + "\n" + rest)
    with pytest.warns(UserWarning, match="of another kind"):
        check(dask.sweep(client, study, out, shards=3, retries=0), expected)


@contextlib.contextmanager
def threads():
    """A cluster in this process."""
    with distributed.Client(processes=False, n_workers=1, threads_per_worker=2, dashboard_address=":0") as client:
        yield client


def test_threads_of_one_process_are_a_cluster_too(study, expected, tmp_path):
    with threads() as client:
        check(dask.sweep(client, study, tmp_path / "out", shared=False), expected)


def test_an_error_on_a_worker_is_tried_again(study, expected, tmp_path, monkeypatch):
    broken = iter([True, False, True])
    whole = motorfit._shard.lay

    def lay(recordings, root):
        if next(broken, False):
            raise OSError("no room")
        return whole(recordings, root)

    monkeypatch.setattr(motorfit._shard, "lay", lay)
    with threads() as client:
        check(dask.sweep(client, study, tmp_path / "out", shards=3, shared=False, retries=2), expected)
        broken = iter([True])
        with pytest.raises(OSError, match="no room"):
            dask.sweep(client, study, tmp_path / "other", shards=3, shared=False, retries=0)
    # The others are kept.
    assert len(ids(tmp_path / "other")) == GOOD * 2 // 3
