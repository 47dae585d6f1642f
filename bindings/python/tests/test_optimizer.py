"""`Optimizer`: searches by ask/tell equal those of `identify` bit for bit; errors for wrong calls."""

import numpy as np
import pytest

import motorfit


@pytest.mark.parametrize("method", ["gwo", "jaya", "ga", "random"])
def test_ask_and_tell_reproduce_the_search_of_identify(record, method):
    found = motorfit.identify(
        record, method=method, polish="none", bounds="table2", population=40, generations=25, seed=3, device="cpu"
    )
    evaluator = motorfit.Evaluator(record, bounds="table2", device="cpu")
    search = motorfit.Optimizer(method, evaluator.bounds, population=40, generations=25, seed=3)
    history = []
    for _ in range(25):
        asked = search.ask()
        assert asked.shape == (40, 5)
        np.testing.assert_array_equal(search.ask(), asked)
        search.tell(evaluator(asked))
        history.append(search.best()[1])
    np.testing.assert_array_equal(history, found.history)
    np.testing.assert_array_equal(search.best()[0], [found.parameters[name] for name in "RLKBJ"])


@pytest.mark.parametrize("method", ["gwo", "jaya", "ga", "random"])
def test_any_cost_function_can_be_minimized(method):
    """Quadratic cost in three dimensions: the median over 20 seeds is well below that of random search."""
    costs = []
    for seed in range(20):
        search = motorfit.Optimizer(method, [(-5.0, 5.0)] * 3, population=30, generations=60, seed=seed)
        for _ in range(60):
            search.tell(np.sum((search.ask() - 1.0) ** 2, axis=1))
        costs.append(search.best()[1])
    # The best of 1800 points in a box of side 10 is about 0.1 away in each coordinate.
    assert np.median(costs) < (1.0 if method == "random" else 0.02)


@pytest.mark.parametrize("method", ["lshade", "cmaes"])
def test_populations_of_different_sizes_spend_the_same_evaluations(method):
    """At the end `ask` returns no candidates; the optimum of a quadratic cost is found to rounding."""
    search = motorfit.Optimizer(method, [(-5.0, 5.0)] * 3, population=30, generations=100)
    sizes = []
    while len(asked := search.ask()):
        sizes.append(len(asked))
        search.tell(np.sum((asked - 1.0) ** 2, axis=1))
    assert sum(sizes) == 3000 and len(set(sizes)) > 1
    assert search.ask().shape == (0, 3)
    assert search.best()[1] < 1e-6


def test_a_multistart_needs_recordings(record):
    with pytest.raises(motorfit.UsageError, match="residuals"):
        motorfit.Optimizer("multistart", [(0, 1)])
    found = motorfit.identify(record, method="multistart", polish="none", bounds="table2", device="cpu")
    assert found.history[-1] <= found.history[0]


def test_settings_and_faults():
    search = motorfit.Optimizer("ga", [(0, 1)], population=10, generations=5, set=["mutation=0.2"])
    assert search.best() is None and search.method == "ga"
    search.ask()
    with pytest.raises(ValueError, match="9 costs for 10"):
        search.tell(np.ones(9))
    search.tell(np.full(10, np.nan))
    assert search.best() is None
    with pytest.raises(motorfit.UsageError):
        motorfit.Optimizer("sm", [(0, 1)])
    with pytest.raises(ValueError, match="shape"):
        motorfit.Optimizer("gwo", [])
    with pytest.raises(motorfit.UsageError):
        motorfit.Optimizer("gwo", [(1, 0)])
    with pytest.raises(motorfit.UsageError):
        motorfit.Optimizer("ga", [(0, 1)], set=["mutatoin=1"])
    with pytest.raises(motorfit.UsageError):
        motorfit.Optimizer("gwo", [(0, 1)], population=10**15)


def test_runs_of_a_seed_differ_and_repeat():
    def first(run):
        return motorfit.Optimizer("gwo", [(0, 1)] * 2, seed=4, run=run).ask()

    np.testing.assert_array_equal(first(0), first(0))
    assert not np.array_equal(first(0), first(1))


@pytest.mark.parametrize("method", ["gwo", "jaya", "ga", "random"])
def test_a_cost_of_minus_infinity_is_ignored(method):
    search = motorfit.Optimizer(method, [(0, 1), (0, 1)], population=10, generations=9)
    costs = np.sum(search.ask() ** 2, axis=1)
    costs[3] = -np.inf
    search.tell(costs)
    values, cost = search.best()
    assert cost == costs[np.isfinite(costs)].min()
    for _ in range(5):
        search.tell(np.sum(search.ask() ** 2, axis=1))
    assert np.isfinite(search.best()[1]) and search.best()[1] <= cost


def test_tell_requires_ask():
    search = motorfit.Optimizer("gwo", [(0, 1)], population=10)
    with pytest.raises(RuntimeError, match="ask"):
        search.tell(np.ones(10))
    search.ask()
    search.tell(np.ones(10))
    with pytest.raises(RuntimeError, match="ask"):
        search.tell(np.ones(10))


@pytest.mark.parametrize("bounds", [[(0, 1), (2, 3)], [[0, 1], [2, 3]], np.array([[0.0, 1.0], [2.0, 3.0]]), ([0, 1], (2, 3))])
def test_bounds_come_in_any_form(bounds):
    asked = motorfit.Optimizer("random", bounds, population=50, set=None).ask()
    assert asked.shape == (50, 2) and asked[:, 0].max() <= 1 and asked[:, 1].min() >= 2


def test_settings_come_in_any_form():
    box = [(0, 1)]
    texts = [motorfit.Optimizer("ga", box, set=given) for given in ("mutation=0.2", ["mutation=0.2"], {"mutation": 0.2})]
    for search in texts:
        search.tell(np.arange(len(search.ask())))
    np.testing.assert_array_equal(texts[0].ask(), texts[1].ask())
    np.testing.assert_array_equal(texts[0].ask(), texts[2].ask())
    with pytest.raises(ValueError, match=r"\(p, 2\)"):
        motorfit.Optimizer("ga", [1, 2, 3])
    assert "ga" in repr(texts[0]) and "cost 0" in repr(texts[0])
