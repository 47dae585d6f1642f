"""Benchmark of the evaluator in searches of other packages.

The same searches run with motorfit.Evaluator, with a cost in parallel numba, in C, with scipy.signal.lsim, and jitted by JAX; the
overhead of a call is measured as well. Times are medians over rounds in which the contenders alternate, on one machine.

    python bindings/python/benchmarks/optimizers.py [ROUNDS]

If MOTORFIT_PROGRAM names the command line program, the throughput of a million candidates from numpy is compared with that
of the program.
"""

import ctypes
import os
import pathlib
import platform
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

import numba
import numpy as np
import scipy.linalg
import scipy.signal
from scipy.optimize import differential_evolution

import motorfit

ROOT = pathlib.Path(__file__).parents[3]
ROUNDS = int(sys.argv[1]) if len(sys.argv) > 1 else 5
RECORD = motorfit.Record.from_file(ROOT / "examples" / "m2-step.csv")
PERIOD = RECORD.period
VOLTAGE = RECORD.voltage
SIGNALS = np.column_stack([RECORD.current, RECORD.speed])
INVERSE = 1.0 / SIGNALS.std(axis=0)
OURS = motorfit.Evaluator(RECORD, bounds="table2", device="cpu")
BOUNDS = OURS.bounds


@numba.njit(inline="always")
def step_map(r, l, k, b, j, h):
    """Returns exp(A h) and its integral times B, by the eigenvalues of A: the step map of a zero-order hold."""
    a11, a12, a21, a22 = -r / l, -k / l, k / j, -b / j
    mean, half = 0.5 * (a11 + a22), 0.5 * (a11 - a22)
    square = half * half + a12 * a21
    grow = np.exp(mean * h)
    root = np.sqrt(abs(square))
    if square > 0:
        c, s = np.cosh(root * h), np.sinh(root * h) / root
    elif square < 0:
        c, s = np.cos(root * h), np.sin(root * h) / root
    else:
        c, s = 1.0, h
    p11, p12 = grow * (c + half * s), grow * a12 * s
    p21, p22 = grow * a21 * s, grow * (c - half * s)
    det = a11 * a22 - a12 * a21
    e1, e2 = (p11 - 1) / l, p21 / l
    return p11, p12, p21, p22, (a22 * e1 - a12 * e2) / det, (a11 * e2 - a21 * e1) / det


@numba.njit(fastmath=True)
def numba_one(candidate, voltage, signals, inverse, h):
    """Returns the criterion nrmse with scale std of one candidate, shape (5,)."""
    r, l, k, b, j = candidate
    p11, p12, p21, p22, g1, g2 = step_map(r, l, k, b, j, h)
    i = w = s1 = s2 = 0.0
    for t in range(len(voltage)):
        e1, e2 = signals[t, 0] - i, signals[t, 1] - w
        s1 += e1 * e1
        s2 += e2 * e2
        i, w = p11 * i + p12 * w + g1 * voltage[t], p21 * i + p22 * w + g2 * voltage[t]
    cost = np.sqrt((s1 * inverse[0] ** 2 + s2 * inverse[1] ** 2) / len(voltage))
    return cost if cost < 1e30 else np.inf


@numba.njit(parallel=True, fastmath=True)
def numba_costs(candidates, voltage, signals, inverse, h):
    """Returns the costs of candidates, shape (n, 5), on all cores."""
    costs = np.empty(len(candidates))
    for n in numba.prange(len(candidates)):
        costs[n] = numba_one(candidates[n], voltage, signals, inverse, h)
    return costs


def numba_cost(candidates):
    return numba_costs(np.ascontiguousarray(candidates), VOLTAGE, SIGNALS, INVERSE, PERIOD)


def lsim_cost(candidates):
    """Returns the costs of candidates by scipy.signal.lsim, one after the other, with a zero-order hold."""
    costs = []
    for r, l, k, b, j in candidates:
        system = ([[-r / l, -k / l], [k / j, -b / j]], [[1 / l], [0.0]], np.eye(2), np.zeros((2, 1)))
        _, states, _ = scipy.signal.lsim(system, RECORD.voltage, RECORD.time, interp=False)
        costs.append(np.sqrt(np.sum(np.square((SIGNALS - states) * INVERSE)) / len(RECORD)))
    return np.array(costs)


def jax_gwo():
    """Returns the Grey Wolf Optimizer as one jitted program over generations, candidates and samples."""
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    low, high = map(jnp.array, np.transpose(BOUNDS))
    voltage, signals = jnp.array(RECORD.voltage), jnp.array(SIGNALS)

    def cost(values):
        r, l, k, b, j = values
        a = jnp.array([[-r / l, -k / l], [k / j, -b / j]])
        augmented = jnp.zeros((3, 3)).at[:2, :2].set(a * PERIOD).at[0, 2].set(PERIOD / l)
        exponential = jax.scipy.linalg.expm(augmented)
        phi, gain = exponential[:2, :2], exponential[:2, 2]

        def step(x, sample):
            v, y = sample
            return phi @ x + gain * v, jnp.sum(jnp.square((y - x) * INVERSE))

        _, squares = jax.lax.scan(step, jnp.zeros(2), (voltage, signals))
        return jnp.sqrt(jnp.sum(squares) / len(voltage))

    costs = jax.vmap(cost)

    @jax.jit
    def search(key):
        key, first = jax.random.split(key)
        agents = jax.random.uniform(first, (100, 5), minval=low, maxval=high)
        leaders, best = agents[:3], jnp.full(3, jnp.inf)

        def generation(g, state):
            key, agents, leaders, best = state
            found = jnp.concatenate([best, costs(agents)])
            order = jnp.argsort(jnp.where(jnp.isnan(found), jnp.inf, found))[:3]
            leaders, best = jnp.concatenate([leaders, agents])[order], found[order]
            key, one, two = jax.random.split(key, 3)
            a = 2 - 2 * g / 99
            spread = a * (2 * jax.random.uniform(one, (3, 100, 5)) - 1)
            around = 2 * jax.random.uniform(two, (3, 100, 5))
            towards = leaders[:, None] - spread * jnp.abs(around * leaders[:, None] - agents)
            return key, jnp.clip(towards.mean(axis=0), low, high), leaders, best

        return jax.lax.fori_loop(0, 100, generation, (key, agents, leaders, best))[3][0]

    def run(seed):
        search(jax.random.PRNGKey(seed)).block_until_ready()

    return run


def mealpy_gwo(batch):
    """Returns the search of mealpy, with one candidate per call (its default) or one generation per call."""
    from mealpy import FloatVar
    from mealpy.swarm_based.GWO import OriginalGWO
    from mealpy.utils.target import Target

    class Batch(OriginalGWO):
        def update_target_for_population(self, pop=None, mode=None):
            for agent, cost in zip(pop, numba_cost(np.array([agent.solution for agent in pop]))):
                agent.target = Target(objectives=[cost], weights=[1.0])
            return pop

    low, high = np.transpose(BOUNDS)
    problem = {
        "obj_func": lambda x: numba_one(x, VOLTAGE, SIGNALS, INVERSE, PERIOD),
        "bounds": FloatVar(lb=low, ub=high),
        "minmax": "min",
        "log_to": None,
    }
    kind, mode = (Batch, "swarm") if batch else (OriginalGWO, "single")
    def run(seed):
        kind(epoch=100, pop_size=100).solve(problem, mode=mode, seed=seed)

    return run


class Recording(ctypes.Structure):
    """The recording of `benches/baseline/gwo.c`."""

    _fields_ = [("samples", ctypes.c_long), ("first", ctypes.c_long), ("step", ctypes.c_double)]
    _fields_ += [(name, ctypes.POINTER(ctypes.c_double)) for name in ("voltage", "current", "speed")]
    _fields_ += [("weight", 2 * ctypes.c_double), ("before", ctypes.c_double)]


def c_cost():
    """Returns a cost in C, compiled here for this processor; None without a compiler that knows OpenMP."""
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None:
        return None
    folder = tempfile.TemporaryDirectory()
    library = pathlib.Path(folder.name) / "gwo.so"
    flags = ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fopenmp", "-DLIBRARY", "-shared", "-fPIC"]
    if platform.machine() in ("x86_64", "AMD64"):
        flags.append("-mprefer-vector-width=512")
    if subprocess.run([compiler, *flags, ROOT / "benches" / "baseline" / "gwo.c", "-o", library, "-lm"]).returncode:
        return None
    function = ctypes.CDLL(library).costs
    function.restype = None
    pointer = lambda values: values.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
    weight = np.square(INVERSE) / len(RECORD)
    columns = [np.ascontiguousarray(values) for values in (VOLTAGE, *SIGNALS.T)]
    first = int(np.argmax(VOLTAGE != 0))
    before = float(np.sum(np.square(SIGNALS[:first]) * weight))
    own = Recording(len(RECORD), first, PERIOD, *map(pointer, columns), (2 * ctypes.c_double)(*weight), before)

    def costs(candidates):
        candidates = np.ascontiguousarray(candidates)
        found = np.empty(len(candidates))
        function(ctypes.byref(own), pointer(candidates), ctypes.c_long(len(candidates)), pointer(found))
        return found

    # The recording points into the columns.
    costs.columns = columns
    return costs


def numpy_gwo(costs):
    """Returns the Grey Wolf Optimizer in numpy, with a cost that takes a generation a call."""
    low, high = np.transpose(BOUNDS)

    def run(seed):
        random = np.random.default_rng(seed)
        agents = low + random.random((100, len(low))) * (high - low)
        leaders, best = agents[:3], np.full(3, np.inf)
        for generation in range(100):
            found = np.concatenate([best, costs(agents)])
            order = np.argsort(found)[:3]
            leaders, best = np.concatenate([leaders, agents])[order], found[order]
            a = 2 - 2 * generation / 100
            spread = a * (2 * random.random((3, 100, len(low))) - 1)
            around = 2 * random.random((3, 100, len(low)))
            towards = leaders[:, None] - spread * np.abs(around * leaders[:, None] - agents)
            agents = np.clip(towards.mean(axis=0), low, high)

    return run


def our_gwo(seed):
    motorfit.identify(
        RECORD, method="gwo", bounds="table2", polish="none", population=100, generations=100, seed=seed, device="cpu"
    )


class Timed:
    """Cost function that accumulates its run time [s]."""

    def __init__(self, costs):
        self.costs, self.seconds = costs, 0.0

    def __call__(self, candidates):
        begun = time.perf_counter()
        found = self.costs(candidates)
        self.seconds += time.perf_counter() - begun
        return found


def evolution(costs, generations):
    def run(seed):
        timed = Timed(costs)
        differential_evolution(
            lambda x: timed(x.T), BOUNDS, vectorized=True, updating="deferred", popsize=20, maxiter=generations, tol=0,
            polish=False, rng=seed,
        )
        return timed.seconds

    return run


def turns(title, contenders, rounds=ROUNDS):
    """Prints median times of alternating contenders, without the first run; a run may return the time in its costs [s]."""
    times = {name: [] for name, _ in contenders}
    costs = {name: [] for name, _ in contenders}
    first = {}
    for round_ in range(rounds + 1):
        for name, work in contenders:
            begun = time.perf_counter()
            took = work(round_)
            seconds = time.perf_counter() - begun
            first.setdefault(name, seconds)
            if round_:
                times[name].append(1e3 * seconds)
                costs[name].append(1e3 * took if took else None)
    print(title)
    ours, *_ = times
    for name in times:
        took = statistics.median(times[name])
        line = f"    {name:28} {took:10.2f} ms {took / statistics.median(times[ours]):8.2f} times ours"
        if costs[name][0]:
            took = statistics.median(costs[name])
            line += f"; in the costs {took:10.2f} ms {took / statistics.median(costs[ours]):8.2f} times ours"
        print(f"{line}; the first time {first[name]:.1f} s")


def overhead(tried):
    """Prints the time of a call with one candidate; on two samples it is nearly all overhead."""
    one, two = tried[:1], motorfit.simulate("m2", [0.0, 0.001], [1.0, 1.0])
    medians = []
    for costs, count in [(OURS, 2000), (motorfit.Evaluator(two, bounds="table2", device="cpu"), 20000)]:
        times = []
        for _ in range(count):
            begun = time.perf_counter()
            costs(one)
            times.append(time.perf_counter() - begun)
        medians.append(1e6 * statistics.median(times))
    print(f"a call with one candidate: {medians[0]:.1f} µs on {len(RECORD)} samples, {medians[1]:.1f} µs on two")


def million(program):
    """Prints the throughput of a million candidates from numpy, and of a million that the program draws itself."""
    low, high = np.transpose(BOUNDS)
    candidates = low + np.random.default_rng(1).random((1_000_000, len(low))) * (high - low)
    command = [program, "evaluate", ROOT / "examples" / "m2-step.csv", "--sample", "uniform:1000000"]
    command += ["--bounds", "table2", "--device", "cpu", "--top", "1"]
    numpy, rust = [], []
    for _ in range(2 * ROUNDS):
        begun = time.perf_counter()
        OURS(candidates)
        numpy.append(time.perf_counter() - begun)
        message = subprocess.run(command, capture_output=True, text=True, check=True).stderr
        rust.append(1e-3 * float(re.search(r"\(evaluation ([\d.]+) ms\)", message)[1]))
    ratios = [100 * b / a for a, b in zip(numpy, rust)]
    print(f"10^6 candidates: {1 / statistics.median(numpy):.2f} million a second from numpy, "
          f"{1 / statistics.median(rust):.2f} million in Rust alone: {statistics.median(ratios):.1f} %")


def main():
    low, high = np.transpose(BOUNDS)
    tried = low + np.random.default_rng(1).random((64, len(low))) * (high - low)
    np.testing.assert_allclose(numba_cost(tried), OURS(tried), rtol=1e-6)
    np.testing.assert_allclose(lsim_cost(tried[:4]), OURS(tried[:4]), rtol=1e-6)

    overhead(tried)
    if program := os.environ.get("MOTORFIT_PROGRAM"):
        million(program)
    turns("differential_evolution(vectorized=True), 100 agents, 150 generations",
          [("motorfit.Evaluator", evolution(OURS, 150)), ("numba, parallel", evolution(numba_cost, 150))])
    turns("differential_evolution(vectorized=True), 100 agents, 5 generations",
          [("motorfit.Evaluator", evolution(OURS, 5)), ("scipy.signal.lsim", evolution(lsim_cost, 5))], 2)
    in_c = c_cost()
    if in_c:
        np.testing.assert_allclose(in_c(tried), OURS(tried), rtol=1e-6)
    turns("Grey Wolf Optimizer, 100 agents, 100 generations",
          [("motorfit.identify", our_gwo), *([("C cost, numpy", numpy_gwo(in_c))] if in_c else []), ("mealpy, numba, one by one", mealpy_gwo(False)),
           ("mealpy, numba, parallel", mealpy_gwo(True)), ("JAX, jitted as a whole", jax_gwo())])


if __name__ == "__main__":
    main()
