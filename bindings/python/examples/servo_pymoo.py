"""Searches the parameters of a servo with its own control law by CMA-ES of pymoo; the equations are a mapping.

Friction, armature and stiffness of such a servo are numbers that robot simulators need.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymoo.algorithms.soo.nonconvex.cmaes import CMAES
from pymoo.core.problem import Problem
from pymoo.optimize import minimize

import motorfit

servo = motorfit.Model({
    "format": 1,
    "name": "servo with a proportional control law",
    "inputs": {"target": {"unit": "rad"}},
    "constants": {"mgl": {"value": 0.5, "unit": "N*m"}},
    "parameters": {
        "kp": {"unit": "N*m/rad", "min": 1.0, "max": 100.0, "log": True},
        "kv": {"unit": "N*m*s/rad", "min": 0.01, "max": 10.0, "log": True},
        "J": {"unit": "kg*m^2", "min": 1e-3, "max": 1.0, "log": True},
        "Tc": {"unit": "N*m", "min": 0.0, "max": 1.0},
    },
    "states": {
        "q": {"unit": "rad", "d": "w", "initial": 0},
        "w": {"unit": "rad/s", "d": "(kp*(target - q) - kv*w - mgl*sin(q) - stick(w, Tc))/J", "initial": 0},
    },
    "outputs": {"q": {"value": "q", "unit": "rad"}},
})
truth = {"kp": 20.0, "kv": 1.0, "J": 0.05, "Tc": 0.2}
time = np.arange(1500) * 2e-3
target = {"target": np.where(time % 1.0 < 0.5, 0.6, -0.4)}
angle = servo.simulate(truth, target, time=time)["q"] + 1e-3 * np.random.default_rng(1).standard_normal(len(time))
costs = motorfit.Evaluator(servo.read({"time_s": time, "target [rad]": target["target"], "q [rad]": angle}), model=servo)


class Servo(Problem):  # type: ignore[misc]  # pymoo has no types
    def __init__(self) -> None:
        super().__init__(n_var=len(costs.names), n_obj=1, xl=0.0, xu=1.0)
        low, high = np.transpose(costs.bounds)
        self.log = low > 0
        self.ends = np.where(self.log, np.log(np.maximum(low, 1e-300)), low), np.where(self.log, np.log(high), high)

    def values(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        low, high = self.ends
        coordinate = low + x * (high - low)
        return np.where(self.log, np.exp(np.where(self.log, coordinate, 0.0)), coordinate)

    def _evaluate(self, x: NDArray[np.float64], out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        out["F"] = costs(self.values(x))


problem = Servo()
found = minimize(problem, CMAES(x0=np.full(4, 0.5), popsize=40, restarts=1), ("n_evals", 8000), seed=1)
for name, value in zip(costs.names, problem.values(found.X)):
    print(f"{name} = {value:.5g} (true value {truth[name]:g})")
print(f"cost {found.F[0]:.6g}")
