"""Shows a progress bar: the callback is called after each generation, and would end the search by returning False."""

from tqdm import tqdm

import motorfit

record = motorfit.Record.from_file("examples/m2-step.csv")
with tqdm(total=300, unit=" generations") as bar:

    def look(progress: motorfit.Progress) -> None:
        bar.update(progress.generation - bar.n)
        bar.set_postfix(cost=f"{progress.cost:.5g}", refresh=False)

    found = motorfit.identify(record, method="gwo", generations=300, progress=look)
for name, value in found.parameters.items():
    print(f"{name} = {value:.6g} ± {found.std_errors[name]:.2g}")
