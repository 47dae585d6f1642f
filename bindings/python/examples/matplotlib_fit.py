"""Plots a fit with matplotlib: measured and simulated speed, and the residuals."""

import pathlib

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt

import motorfit

record = motorfit.Record.from_file("examples/m2-step.csv")
found = motorfit.identify(record)
assert record.speed is not None
model = found.modelled()[0]["speed_rad_s"]

figure, (above, below) = plt.subplots(2, sharex=True, layout="constrained")
above.plot(record.time, record.speed, ".", markersize=2, color="0.6", label="measured")
above.plot(record.time, model, label=f"model, fit {found.fit_percent['speed']:.2f} %")
above.set_ylabel("speed [rad/s]")
above.legend()
below.plot(record.time, record.speed - model, linewidth=0.5)
below.set(xlabel="time [s]", ylabel="measured − model [rad/s]")
pathlib.Path("/tmp/motorfit").mkdir(exist_ok=True)
figure.savefig("/tmp/motorfit/fit.png", dpi=150)
print("wrote /tmp/motorfit/fit.png")
