"""Steiglitz-McBride (1965) and Levenberg-Marquardt with analytic sensitivities in numpy and scipy.

Baseline of benches/estimate.rs, and an independent implementation for its numbers.

    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 python benches/baseline/estimate.py examples/m2-step.csv
"""
import sys
import time

import numpy as np
from scipy.linalg import expm, expm_frechet, logm
from scipy.optimize import least_squares
from scipy.signal import lfilter

t, v, i, w = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1).T
h = t[1] - t[0]


def noise(y):
    return np.median(np.abs(np.diff(y, 3))) / 0.6745 / np.sqrt(20)


def lag(x, k):
    return np.concatenate([np.zeros(k), x[:-k]])


def steiglitz_mcbride():
    sigma, a, last, zero = [noise(i), noise(w)], np.array([1.0, 0, 0]), None, np.zeros_like(v)
    for _ in range(60):
        u, fi, fw = (lfilter([1.0], a, x) for x in (v, i, w))
        u1, u2 = lag(u, 1), lag(u, 2)
        rows = np.vstack([
            np.column_stack([-lag(fi, 1), -lag(fi, 2), u1, u2, zero, zero]) / sigma[0],
            np.column_stack([-lag(fw, 1), -lag(fw, 2), zero, zero, u1, u2]) / sigma[1],
        ])
        th = np.linalg.lstsq(rows, np.concatenate([fi / sigma[0], fw / sigma[1]]), rcond=None)[0]
        roots = np.roots([1.0, th[0], th[1]])
        a = np.real(np.poly(np.where(abs(roots) > 1, 1 / np.conj(roots), roots)))
        if last is not None and np.max(abs(th[:2] - last)) < 1e-7:
            break
        last = th[:2]
    a1, a2 = th[:2]
    g = np.array([th[2], th[4]])
    g1 = np.array([th[3], th[5]]) - a1 * g
    phi = np.column_stack([g1, -a1 * g1 - a2 * g]) @ np.linalg.inv(np.column_stack([g, g1]))
    A = np.real(logm(phi)) / h
    b = np.linalg.solve(phi - np.eye(2), A @ g)
    alpha1, alpha0, beta1 = -np.trace(A), np.linalg.det(A), b[0]
    beta0, gamma0 = -A[1, 1] * b[0] + A[0, 1] * b[1], A[1, 0] * b[0] - A[0, 0] * b[1]
    L, BJ, KJ = 1 / beta1, beta0 / beta1, gamma0 / beta1
    R = L * (alpha1 - BJ)
    K = (alpha0 * L - R * BJ) / KJ
    J = K / KJ
    return np.array([R, L, K, J * BJ, J])


def step_maps(p):
    """Returns the exponential of the augmented system matrix, and its derivatives by the logarithms of the parameters."""
    R, L, K, B, J = p
    M, slopes = np.zeros((3, 3)), np.zeros((5, 3, 3))
    M[0], M[1, :2] = [-R / L, -K / L, 1 / L], [K / J, -B / J]
    slopes[0][0, 0] = -R / L
    slopes[1][0] = -M[0]
    slopes[2][0, 1], slopes[2][1, 0] = -K / L, K / J
    slopes[3][1, 1] = -B / J
    slopes[4][1] = -M[1]
    return expm(M * h), [expm_frechet(M * h, D * h, compute_expm=False) for D in slopes]


def residuals(log_p, sigma):
    E, slopes = step_maps(np.exp(log_p))
    P, a = E[:2, :2], [1, -np.trace(E[:2, :2]), np.linalg.det(E[:2, :2])]

    def run(f0, f1):
        return (lfilter([0, 1, -P[1, 1]], a, f0) + lfilter([0, 0, P[0, 1]], a, f1),
                lfilter([0, 0, P[1, 0]], a, f0) + lfilter([0, 1, -P[0, 0]], a, f1))

    x0, x1 = run(E[0, 2] * v, E[1, 2] * v)
    columns = [run(*(D[n, 0] * x0 + D[n, 1] * x1 + D[n, 2] * v for n in (0, 1))) for D in slopes]
    jacobian = np.column_stack([np.concatenate([s0 / sigma[0], s1 / sigma[1]]) for s0, s1 in columns])
    return np.concatenate([(x0 - i) / sigma[0], (x1 - w) / sigma[1]]), jacobian


def refine(p):
    sigma, log_p, last = [noise(i), noise(w)], np.log(p), {}

    def value(x):
        last["x"], (r, last["jacobian"]) = x.copy(), residuals(x, sigma)
        return r

    def slope(x):
        return last["jacobian"] if np.array_equal(last.get("x"), x) else residuals(x, sigma)[1]

    for _ in range(3):
        found = least_squares(value, log_p, slope, method="lm", xtol=1e-10, ftol=1e-12)
        log_p, e, n = found.x, found.fun, len(v)
        sigma = [sigma[0] * np.sqrt(np.mean(e[:n] ** 2)), sigma[1] * np.sqrt(np.mean(e[n:] ** 2))]
    covariance = np.linalg.inv(found.jac.T @ found.jac)
    return np.exp(log_p), np.exp(log_p) * np.sqrt(np.diag(covariance))


times = []
for _ in range(41):
    start = time.perf_counter()
    p = steiglitz_mcbride()
    middle = time.perf_counter()
    p, errors = refine(p)
    times.append((middle - start, time.perf_counter() - start))
sm, both = np.median(times, axis=0)
for name, value, error in zip("RLKBJ", p, errors):
    print(f"{name} {value:.9e} ± {error:.3e}")
print(f"SM {1e3 * sm:.2f} ms, with the refinement {1e3 * both:.2f} ms")
