import motorfit

record = motorfit.Record.from_file("examples/m2-step.csv")
found = motorfit.identify(record)
found.plot_response().save("/tmp/motorfit/fit.svg")

costs = motorfit.Evaluator(record, criterion="nrmse")  # for any optimizer: shape (n, 5) in, (n,) out
print(costs([[0.92, 0.0078, 0.073, 0.00068, 0.00014]]))
