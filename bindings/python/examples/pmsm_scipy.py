"""Identifies a permanent-magnet synchronous machine from its equations: by motorfit, then by an optimizer of scipy.

The recording is simulated here; `machine.read("log.csv")` reads one of a test bench.
"""

import numpy as np
from scipy.optimize import differential_evolution

import motorfit

machine = motorfit.Model("pmsm")
time = np.arange(1000) * 1e-4
voltage = {"vd": np.where(time < 0.04, 0.0, 1.0), "vq": np.where(time % 0.05 < 0.025, 6.0, 2.0)}
truth = {"R": 0.5, "Ld": 1e-3, "Lq": 1.5e-3, "psi": 0.05, "B": 1e-4, "J": 2e-4}
signals = machine.simulate(truth, voltage, time=time)
noise = np.random.default_rng(1)
measured = {name: values + 0.01 * np.std(values) * noise.standard_normal(len(time)) for name, values in signals.items()}
columns = {"time_s": time, **{f"{name} [V]": values for name, values in voltage.items()}}
columns |= {"id [A]": measured["id"], "iq [A]": measured["iq"], "speed [rad/s]": measured["w"]}
(record,) = machine.read(columns)

found = machine.identify(record)
for name, value in found.parameters.items():
    print(f"{name} = {value:.5g} ± {found.std_errors[name]:.2g} {found.units[name]}, true value {truth[name]:g}")

# Parameters over decades are searched in their logarithms. scipy passes (p, n), the evaluator takes (n, p).
costs = motorfit.Evaluator(record, model=machine)
decades = np.log10(costs.bounds)
search = differential_evolution(
    lambda x: costs(10 ** x.T), decades, vectorized=True, updating="deferred", popsize=20, maxiter=150, tol=0, polish=False, rng=1
)
print(f"cost {search.fun:.6g} by differential evolution, {found.cost:.6g} by identify")
