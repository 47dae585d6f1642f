"""Writes optimizers.csv: evaluations that independent implementations take to reach a target cost.

pip install "cma==4.5.0" "minionpy==1.9.1" "scipy==1.17.1" numpy
A line for each method and function: name of both, the target, the budget, then the sorted evaluations of each run; inf where the
budget was not enough.
"""
import math
import numpy as np

BEST = np.array([1.3, -2.1, 0.7, 2.9, -0.4])
LOW, HIGH, N = -5.0, 5.0, 5


def sphere(x):
    return float(np.sum((x - BEST) ** 2))


def ellipsoid(x):
    return float(np.sum(10.0 ** (1.5 * np.arange(N)) * (x - BEST) ** 2))


def rosenbrock(x):
    z = x - BEST + 1.0
    return float(np.sum(100.0 * (z[1:] - z[:-1] ** 2) ** 2 + (1.0 - z[:-1]) ** 2))


def rastrigin(x):
    z = x - BEST
    return float(np.sum(z * z - 10.0 * np.cos(2.0 * math.pi * z) + 10.0))


def corner(x):
    """A quadratic function whose lowest point is outside of the box: the optimum is at a bound of three axes."""
    z = x - np.array([6.0, -2.1, -7.0, 5.5, -0.4])
    return float(np.sum(10.0 ** (0.5 * np.arange(N)) * z**2) - (1.0 + 10.0 * 4.0 + 10.0**1.5 * 0.25))


FUNCTIONS = {"sphere": (sphere, 1e-8), "ellipsoid": (ellipsoid, 1e-8), "rosenbrock": (rosenbrock, 1e-8),
             "rastrigin": (rastrigin, 1e-2), "corner": (corner, 1e-8)}


class Reached(Exception):
    pass


def evaluations(function, target, budget, run):
    """Evaluations until the target; inf if the budget does not suffice."""
    count = 0

    def counted(x):
        nonlocal count
        if count >= budget:
            raise Reached(math.inf)
        count += 1
        cost = function(np.asarray(x, dtype=float))
        if cost <= target:
            raise Reached(count)
        return cost

    try:
        run(counted)
    except Reached as reached:
        return reached.args[0]
    return math.inf


def cmaes(seed):
    import cma

    def run(f):
        rng = np.random.default_rng(seed)
        options = {"bounds": [[LOW] * N, [HIGH] * N], "seed": seed + 1, "verbose": -9,
                   "tolfun": 0, "tolfunhist": 1e-12, "maxfevals": math.inf}
        cma.fmin(f, lambda: rng.uniform(LOW, HIGH, N), 2.0, options, restarts=30, bipop=True)

    return run


def de(seed):
    from scipy.optimize import differential_evolution

    def run(f):
        rng = np.random.default_rng(seed)
        start = rng.uniform(LOW, HIGH, (50, N))
        differential_evolution(f, [(LOW, HIGH)] * N, strategy="rand1bin", mutation=0.5, recombination=0.9, init=start, tol=0,
                               atol=0, maxiter=10**6, polish=False, updating="deferred", rng=rng)

    return run


def lshade(seed):
    import minionpy

    def run(f):
        failed = []

        def rows(X):
            out = []
            for x in X:
                if failed:
                    out.append(0.0)
                    continue
                try:
                    out.append(f(x))
                except Reached as reached:
                    failed.append(reached)
                    out.append(0.0)
            return out

        options = {"population_size": 90, "x_tol": -1.0, "f_tol": -1.0, "memory_size": 6, "archive_size_ratio": 2.6}
        minionpy.LSHADE(rows, [(LOW, HIGH)] * N, None, BUDGET["lshade"], None, seed, options).optimize()
        if failed:
            raise failed[0]

    return run


METHODS = {"cmaes": cmaes, "de": de, "lshade": lshade}
BUDGET = {"cmaes": 10_000, ("cmaes", "rastrigin"): 50_000, "de": 50_000, "lshade": 20_000}
RUNS = 101

if __name__ == "__main__":
    import sys
    with open("optimizers.csv", "w") as file:
        for method, search in METHODS.items():
            for name, (function, target) in FUNCTIONS.items():
                budget = BUDGET.get((method, name), BUDGET[method])
                found = sorted(evaluations(function, target, budget, search(seed)) for seed in range(RUNS))
                print(method, name, sum(map(math.isfinite, found)), np.quantile(found, [0.1, 0.25, 0.5, 0.75, 0.9], method="lower"), file=sys.stderr, flush=True)
                file.write(",".join([method, name, repr(target), str(budget), *map(str, found)]) + "\n")
