"""Runs the differential evolution of scipy, one call per generation: scipy passes (p, n), the evaluator takes (n, p)."""

from scipy.optimize import differential_evolution

import motorfit

record = motorfit.Record.from_file("examples/m2-step.csv")
costs = motorfit.Evaluator(record, bounds="table2")
found = differential_evolution(
    lambda x: costs(x.T), costs.bounds, vectorized=True, updating="deferred", popsize=20, maxiter=150, tol=0, polish=False, rng=1
)
for name, value in zip(costs.names, found.x):
    print(f"{name} = {value:.5g}")
print(f"cost {found.fun:.6g} after {found.nfev} calls of {20 * len(costs.names)} candidates")  # nfev counts calls
