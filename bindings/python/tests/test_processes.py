"""Forked and spawned processes: a child of a parent with running threads does not hang, and returns the same results."""

import multiprocessing

import numpy as np
import pytest

import motorfit
from conftest import M2, step

# Time limit of a child [s]; a fit takes some milliseconds.
PATIENCE = 60


def fit(record):
    return motorfit.identify(record).parameters


def search(record):
    found = motorfit.identify(record, method="gwo", generations=5, progress=lambda p: True)
    return found.cost, motorfit.compare(runs=2, generations=3, population=8).blocks[0].costs["gwo"].tolist()


def evaluate(given):
    costs, table = given
    return costs(table)


def study(folder):
    return motorfit.sweep(folder / "study.toml", folder / "forked")["runs"]


def in_process(how, work, given):
    """Returns the result of `work` in another process; a hang fails the test."""
    with multiprocessing.get_context(how).Pool(1) as pool:
        return pool.apply_async(work, (given,)).get(PATIENCE)


@pytest.fixture(scope="module")
def record():
    made = step()
    # Starts the threads of the parent.
    motorfit.identify(made)
    motorfit.Evaluator(made)(np.repeat([list(M2.values())], 20_000, axis=0))
    return made


@pytest.mark.parametrize("how", ["fork", "spawn", "forkserver"])
def test_other_processes_give_the_same(record, how):
    assert in_process(how, fit, record) == fit(record)
    assert in_process(how, search, record) == search(record)


@pytest.mark.parametrize("how", ["fork", "spawn"])
@pytest.mark.parametrize("threads", [None, 1, 2])
def test_evaluators_work_in_other_processes(record, how, threads):
    costs = motorfit.Evaluator(record, threads=threads, device="cpu")
    table = np.repeat([list(M2.values())], 5000, axis=0)
    expected = costs(table)
    np.testing.assert_array_equal(in_process(how, evaluate, (costs, table)), expected)


INHERITED = {}


def inherited(table):
    return INHERITED["costs"](table)


@pytest.mark.parametrize("how", ["fork", "spawn"])
def test_results_are_returned_completely(record, how):
    found = in_process(how, motorfit.identify, record)
    assert found.parameters == fit(record)
    assert str(found.plot_response()) == str(motorfit.identify(record).plot_response())


def test_an_evaluator_that_was_forked_with_its_process_works(record):
    table = np.repeat([list(M2.values())], 5000, axis=0)
    for threads in (None, 1, 2):
        INHERITED["costs"] = motorfit.Evaluator(record, threads=threads, device="cpu")
        np.testing.assert_array_equal(in_process("fork", inherited, table), INHERITED["costs"](table))


def test_a_sweep_runs_in_a_fork(record, tmp_path):
    (tmp_path / "a.csv").write_text(record.to_csv())
    (tmp_path / "study.toml").write_text('recordings = ["a.csv"]\nmethods = ["gwo"]\npopulation = [10]\ngenerations = [3]\nseeds = "1..4"\n')
    assert motorfit.sweep(tmp_path / "study.toml", tmp_path / "here")["runs"] == 4
    assert in_process("fork", study, tmp_path) == 4
    assert (tmp_path / "forked" / "results.jsonl").read_bytes() == (tmp_path / "here" / "results.jsonl").read_bytes()
