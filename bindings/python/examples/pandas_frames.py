"""Fits two pandas frames jointly, and returns parameters and signals as frames."""

import pandas

import motorfit

frame = pandas.read_csv("examples/m2-step.csv", comment="#")
frame = frame.rename(columns={"current_A": "Current (mA)"}).assign(**{"Current (mA)": frame["current_A"] * 1e3})
first, second = frame.iloc[:2000], frame.iloc[1000:]
found = motorfit.identify([first, second])

print(found.to_frame().to_string())
for record, model in zip(found.records, found.modelled()):
    both = record.to_frame().join(pandas.DataFrame(model).add_suffix("_model"))
    print(both.describe().loc[["mean", "std"]].to_string())
