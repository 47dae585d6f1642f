"""Runs a genetic algorithm of pymoo on the evaluator; a vectorized problem evaluates a generation in one call."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.soo.nonconvex.ga import GA
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

import motorfit


class Motor(Problem):  # type: ignore[misc]  # pymoo has no types
    def __init__(self, costs: motorfit.Evaluator) -> None:
        low, high = np.transpose(costs.bounds)
        super().__init__(n_var=len(low), n_obj=1, xl=low, xu=high)
        self.costs = costs

    def _evaluate(self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        out["F"] = self.costs(x)


record = motorfit.Record.from_file("examples/m2-step.csv")
costs = motorfit.Evaluator(record, bounds="table2")
found = minimize(Motor(costs), GA(pop_size=100), ("n_gen", 100), seed=1)
for name, value in zip(costs.names, found.X):
    print(f"{name} = {value:.5g}")
print(f"cost {found.F[0]:.6g}")
