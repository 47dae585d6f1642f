"""Writes sobol.csv: the digits of points of the Sobol' sequence, by scipy, times 2^53, for 32 axes. Each line begins with the number of
the point."""

import csv

from scipy.stats import qmc

POINTS = [1, 2, 3, 5, 100, 12345, 1_000_003]
AXES = 32

with open("sobol.csv", "w", newline="") as file:
    writer = csv.writer(file)
    for point in POINTS:
        # 30 bits, the default, suffice for points below 2^30.
        sequence = qmc.Sobol(AXES, scramble=False, bits=30)
        sequence.fast_forward(point)
        [row] = sequence.random(1)
        writer.writerow([point, *(int(value * 2**53) for value in row)])
