"""Writes step_maps.csv: one-step maps of DC motors from 60-digit matrix exponentials (mpmath).

A = [[-R/L, -K/L], [K/J, -B/J]], voltage input (1/L, 0), torque input (0, -1/J).
zoh: exp of [[A, B], [0, 0]] h.  foh: exp of [[A, b, 0], [0, 0, 1], [0, 0, 0]] h, whose last column is h G1.
rk4: the four stages of the classical method with a zero-order hold.  euler: x + h (A x + B u).
"""
import itertools

import mpmath as mp

mp.mp.dps = 60
TABLE2 = [("0.1", "1"), ("0.001", "0.1"), ("0.005", "0.1"), ("1e-5", "1e-3"), ("1e-5", "1e-3")]
MOTORS = [list(corner) for corner in itertools.product(*TABLE2)]
MOTORS += [
    ["0.921042", "0.007759", "0.073472", "0.000678", "0.000136"],  # M2
    ["3.2", "1e-4", "0.004", "1e-8", "1e-7"],  # a tiny coreless motor
    ["0.5", "0.004", "0.8", "0.01", "0.05"],  # a large slow motor
    # Repeated eigenvalues: (R/L - B/J)^2 = 4 K^2/(L J), here R = 1, L = 0.01, B/J = 0, and nearly so.
    ["1", "0.01", "0.05", "1e-30", "1e-4"],
    ["1", "0.01", "0.050000001", "1e-30", "1e-4"],
]
STEPS = ["1e-5", "1e-4", "1e-3", "1e-2", "1e-1"]


def parts(values):
    # Parameters are rounded to doubles, so that both sides start from the same numbers.
    r, l, k, b, j = (mp.mpf(float(v)) for v in values)
    return mp.matrix([[-r / l, -k / l], [k / j, -b / j]]), mp.matrix([[1 / l, 0], [0, -1 / j]])


def exact(values, h):
    a, b = parts(values)
    m = mp.zeros(5)
    m[0:2, 0:2], m[0:2, 2:4] = a * h, b * h
    whole = mp.expm(m, method="taylor")
    ramp = mp.zeros(4)
    ramp[0:2, 0:2], ramp[0:2, 2], ramp[2, 3] = a * h, b[:, 0] * h, mp.mpf(1)
    end = mp.expm(ramp, method="taylor")[0:2, 3]
    return whole[0:2, 0:2] - mp.eye(2), whole[0:2, 2:4], end


def rk4(values, h):
    a, b = parts(values)

    def step(x, u):
        f = lambda x: a * x + b * u
        k1 = f(x)
        k2 = f(x + h / 2 * k1)
        k3 = f(x + h / 2 * k2)
        k4 = f(x + h * k3)
        return x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    return columns(step)


def euler(values, h):
    a, b = parts(values)
    return columns(lambda x, u: x + h * (a * x + b * u))


def columns(step):
    unit = [mp.matrix([1, 0]), mp.matrix([0, 1])]
    zero = mp.matrix([0, 0])
    d, gains = mp.zeros(2), mp.zeros(2)
    for n in range(2):
        d[:, n] = step(unit[n], zero) - unit[n]
        gains[:, n] = step(zero, unit[n])
    return d, gains, zero


def row(name, values, h, d, gains, end):
    start = gains[:, 0] - end
    numbers = [d[0, 0], d[0, 1], d[1, 0], d[1, 1], start[0], start[1], end[0], end[1], gains[0, 1], gains[1, 1]]
    return ",".join([name, h, *values] + [mp.nstr(n, 20) for n in numbers])


lines = ["method,h,R,L,K,B,J,d00,d01,d10,d11,start_i,start_w,end_i,end_w,torque_i,torque_w"]
for values, h in itertools.product(MOTORS, STEPS):
    step = mp.mpf(float(h))
    d, gains, end = exact(values, step)
    lines.append(row("zoh", values, h, d, gains, mp.matrix([0, 0])))
    lines.append(row("foh", values, h, d, gains, end))
    lines.append(row("rk4", values, h, *rk4(values, step)))
    lines.append(row("euler", values, h, *euler(values, step)))
open(__file__.replace(".py", ".csv"), "w").write("\n".join(lines) + "\n")
