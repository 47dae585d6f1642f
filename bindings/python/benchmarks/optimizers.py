"""What the evaluator is worth to other tools: the same searches with our costs, with a numba-parallel cost, with scipy's
lsim, and jitted with JAX. One run on one machine; times are medians over rounds in which the contenders take turns.

    python bindings/python/benchmarks/optimizers.py [ROUNDS]
"""

import pathlib
import statistics
import sys
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
SIGNALS = np.column_stack([RECORD.current, RECORD.speed])
INVERSE = 1.0 / SIGNALS.std(axis=0)
OURS = motorfit.Evaluator(RECORD, bounds="table2", device="cpu")
BOUNDS = OURS.bounds


@numba.njit(inline="always")
def step_map(r, l, k, b, j, h):
    """Exact map over h under a held voltage: exp(A h), and its integral times B, by the eigenvalues of A."""
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


@numba.njit(parallel=True, fastmath=True)
def numba_costs(candidates, voltage, signals, inverse, h):
    """nrmse, scale std, of candidates (n, 5)."""
    costs = np.empty(len(candidates))
    for n in numba.prange(len(candidates)):
        r, l, k, b, j = candidates[n]
        p11, p12, p21, p22, g1, g2 = step_map(r, l, k, b, j, h)
        i = w = s1 = s2 = 0.0
        for t in range(len(voltage)):
            e1, e2 = signals[t, 0] - i, signals[t, 1] - w
            s1 += e1 * e1
            s2 += e2 * e2
            i, w = p11 * i + p12 * w + g1 * voltage[t], p21 * i + p22 * w + g2 * voltage[t]
        cost = np.sqrt((s1 * inverse[0] ** 2 + s2 * inverse[1] ** 2) / len(voltage))
        costs[n] = cost if cost < 1e30 else np.inf
    return costs


def numba_cost(candidates):
    return numba_costs(np.ascontiguousarray(candidates), RECORD.voltage, SIGNALS, INVERSE, PERIOD)


def lsim_cost(candidates):
    """The same by scipy's lsim, one candidate after the other, the voltage held."""
    costs = []
    for r, l, k, b, j in candidates:
        system = ([[-r / l, -k / l], [k / j, -b / j]], [[1 / l], [0.0]], np.eye(2), np.zeros((2, 1)))
        _, states, _ = scipy.signal.lsim(system, RECORD.voltage, RECORD.time, interp=False)
        costs.append(np.sqrt(np.sum(np.square((SIGNALS - states) * INVERSE)) / len(RECORD)))
    return np.array(costs)


def jax_gwo():
    """The Grey Wolf Optimizer as one jitted program: all generations, all agents, all samples."""
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

    return lambda seed: float(search(jax.random.PRNGKey(seed)))


def mealpy_gwo(seed):
    from mealpy import FloatVar
    from mealpy.swarm_based.GWO import OriginalGWO

    low, high = np.transpose(BOUNDS)
    problem = {
        "obj_func": lambda x: numba_cost(x[None])[0], "bounds": FloatVar(lb=low, ub=high), "minmax": "min", "log_to": None
    }
    return OriginalGWO(epoch=100, pop_size=100).solve(problem, seed=seed).target.fitness


def our_gwo(seed):
    found = motorfit.identify(
        RECORD, method="gwo", bounds="table2", polish="none", population=100, generations=100, seed=seed, device="cpu"
    )
    return found.cost


def evolution(costs, generations):
    def run(seed):
        return differential_evolution(
            lambda x: costs(x.T), BOUNDS, vectorized=True, updating="deferred", popsize=20, maxiter=generations, tol=0,
            polish=False, rng=seed,
        ).fun

    return run


def turns(title, contenders, rounds=ROUNDS):
    """Times of contenders that take turns, the first run of each left out."""
    times = {name: [] for name, _ in contenders}
    for round_ in range(rounds + 1):
        for name, work in contenders:
            begun = time.perf_counter()
            work(round_)
            if round_:
                times[name].append(time.perf_counter() - begun)
    ours = statistics.median(times[contenders[0][0]])
    print(title)
    for name, _ in contenders:
        took = statistics.median(times[name])
        print(f"    {name:38} {1e3 * took:10.2f} ms   {took / ours:8.2f} times ours")


def main():
    tried = np.array([low + np.random.default_rng(1).random((64, 5)) * (high - low) for low, high in [np.transpose(BOUNDS)]][0])
    np.testing.assert_allclose(numba_cost(tried), OURS(tried), rtol=1e-6)
    np.testing.assert_allclose(lsim_cost(tried[:4]), OURS(tried[:4]), rtol=1e-6)

    one = tried[:1]
    calls = []
    for _ in range(2000):
        begun = time.perf_counter()
        OURS(one)
        calls.append(time.perf_counter() - begun)
    small = motorfit.Evaluator(motorfit.simulate("m2", [0.0, 0.001], [1.0, 1.0]), bounds="table2", device="cpu")
    bare = []
    for _ in range(20000):
        begun = time.perf_counter()
        small(one)
        bare.append(time.perf_counter() - begun)
    print(f"a call with one candidate: {1e6 * statistics.median(calls):.1f} µs on {len(RECORD)} samples, "
          f"{1e6 * statistics.median(bare):.1f} µs on two: all but the evaluation")

    turns("differential_evolution(vectorized=True), 100 agents, 150 generations",
          [("motorfit.Evaluator", evolution(OURS, 150)), ("numba, parallel", evolution(numba_cost, 150))])
    turns("differential_evolution(vectorized=True), 100 agents, 5 generations",
          [("motorfit.Evaluator", evolution(OURS, 5)), ("scipy.signal.lsim", evolution(lsim_cost, 5))], 2)
    turns("Grey Wolf Optimizer, 100 agents, 100 generations",
          [("motorfit.identify", our_gwo), ("mealpy with a numba cost", mealpy_gwo), ("JAX, jitted as a whole", jax_gwo())])


if __name__ == "__main__":
    main()
