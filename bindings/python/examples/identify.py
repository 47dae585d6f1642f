import motorfit

record = motorfit.Record.from_file("examples/m2-step.csv")
found = motorfit.identify(record, with_="auto")
for name, value in found.parameters.items():
    print(f"{name} = {value:.6g} ± {found.std_errors[name]:.2g}")
