import pathlib

import motorfit

found = motorfit.identify("examples/m2-step.csv")
pathlib.Path("/tmp/motorfit").mkdir(exist_ok=True)
found.plot_response().save("/tmp/motorfit/fit.svg")

costs = motorfit.Evaluator("examples/m2-step.csv", criterion="nrmse")  # for any optimizer: shape (n, 5) in, (n,) out
print(costs([[0.92, 0.0078, 0.073, 0.00068, 0.00014]]))
