"""Runs the Grey Wolf Optimizer of mealpy on the evaluator; in mode "swarm" a generation is evaluated in one call."""

from typing import Any

import numpy as np
from mealpy import FloatVar
from mealpy.swarm_based.GWO import OriginalGWO
from mealpy.utils.target import Target

import motorfit


class BatchGWO(OriginalGWO):  # type: ignore[misc]  # mealpy has no types
    """Evaluates a generation in one call."""

    costs: motorfit.Evaluator

    def update_target_for_population(self, pop: list[Any], mode: str | None = None) -> list[Any]:
        values = self.costs(np.array([agent.solution for agent in pop]))
        for agent, cost in zip(pop, values):
            agent.target = Target(objectives=[cost], weights=[1.0])
        return pop


record = motorfit.Record.from_file("examples/m2-step.csv")
costs = motorfit.Evaluator(record, bounds="table2")
low, high = np.transpose(costs.bounds)
search = BatchGWO(epoch=100, pop_size=100)
search.costs = costs
problem = {"obj_func": lambda x: costs(x)[0], "bounds": FloatVar(lb=low, ub=high), "minmax": "min", "log_to": None}
found = search.solve(problem, mode="swarm", seed=1)
for name, value in zip(costs.names, found.solution):
    print(f"{name} = {value:.5g}")
print(f"cost {found.target.fitness:.6g}")
