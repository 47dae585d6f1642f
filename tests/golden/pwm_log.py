"""Writes examples/pwm-log.csv: the motor M2 of the paper with 0.02 N·m of Coulomb friction, driven by PWM through an H-bridge, as a
microcontroller logs it every 4 ms. Independent of the library: the equations are integrated in steps of 2 µs, exactly while the motor turns in one
direction, with rest where the friction holds. The speed is logged in revolutions per minute with steps of 0.1, the current in mA.

    python3 tests/golden/pwm_log.py > examples/pwm-log.csv
"""

import math
import random

R, L, K, B, J, TC = 0.921042, 0.007759, 0.073472, 0.000678, 0.000136, 0.02
SUPPLY, FULL = 12.0, 255
PERIOD, STEPS, SAMPLES = 4e-3, 2000, 1500
SIGMA_CURRENT, SIGMA_SPEED = 0.031, 1.07  # A and rad/s, about 40 dB
LEVELS = [255, 96, -160, 0, 200, -255, 64, 128, -96, 224, 0, -64, 160, -200, 255]  # counts, 0.4 s each
H = PERIOD / STEPS


def exponential(a, h):
    """Returns exp(a h) and the integral of exp(a s) ds from 0 to h of a 2 by 2 matrix, by their series."""
    one = [[1.0, 0.0], [0.0, 1.0]]
    product = lambda x, y: [[sum(x[i][k] * y[k][j] for k in range(2)) for j in range(2)] for i in range(2)]
    power, total, integral = one, [row[:] for row in one], [[h, 0.0], [0.0, h]]
    for n in range(1, 20):
        power = [[value * h / n for value in row] for row in product(power, a)]
        total = [[total[i][j] + power[i][j] for j in range(2)] for i in range(2)]
        integral = [[integral[i][j] + power[i][j] * h / (n + 1) for j in range(2)] for i in range(2)]
    return total, integral


def main():
    random.seed(20261129)
    ((e, f), (g, q)), ((a, b), (c, d)) = exponential([[-R / L, -K / L], [K / J, -B / J]], H)
    decay, gain = math.exp(-R / L * H), (1 - math.exp(-R / L * H)) / R
    i = w = 0.0
    print("ms;pwm;rpm;mA")
    for n in range(SAMPLES):
        pwm = LEVELS[n * len(LEVELS) // SAMPLES]
        rpm = (w + random.gauss(0, SIGMA_SPEED)) * 60 / (2 * math.pi)
        milliamperes = 1000 * (i + random.gauss(0, SIGMA_CURRENT))
        print(f"{4 * n};{pwm};{rpm:.1f};{milliamperes:.0f}")
        v = SUPPLY * pwm / FULL
        for _ in range(STEPS):
            if w == 0.0 and abs(K * i) <= TC:
                i = i * decay + v * gain
                continue
            side = math.copysign(1.0, w if w != 0.0 else i)
            x, y = v / L, -TC * side / J
            i, after = e * i + f * w + a * x + b * y, g * i + q * w + c * x + d * y
            w = 0.0 if after * side < 0.0 else after


main()
