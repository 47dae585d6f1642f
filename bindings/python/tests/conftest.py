"""Fixtures: the motor of the paper, simulated recordings, and the command line program as the reference of results."""

import os
import pathlib
import signal
import subprocess

import numpy as np
import pandas
import pytest

import motorfit

# A shell starts background jobs with SIGINT ignored, which child processes inherit.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).parents[3]
M2 = {"R": 0.921042, "L": 0.007759, "K": 0.073472, "B": 0.000678, "J": 0.000136}


def step(seed=1, noise="40dB", duration=1.0, at=0.1):
    """Returns a simulated recording of the paper's motor: a step of 10.5 V at ``at`` [s], sampled at 1 kHz."""
    time = np.arange(0, duration, 0.001)
    return motorfit.simulate(M2, time, np.where(time >= at, 10.5, 0.0), noise=noise, seed=seed)


@pytest.fixture(scope="session")
def record():
    return step()


@pytest.fixture(scope="session")
def program():
    """Returns a function that runs the command line program built from the same sources."""
    path = os.environ.get("MOTORFIT_PROGRAM")
    if not path:
        if os.environ.get("MOTORFIT_NO_SKIP"):
            pytest.fail("MOTORFIT_PROGRAM names no program")
        pytest.skip("MOTORFIT_PROGRAM names no program")

    def run(*args):
        done = subprocess.run([path, *map(str, args)], capture_output=True, text=True, check=False)
        assert done.returncode in (0, 3, 4), done.stderr
        return done

    return run


def answers(thing):
    """Returns the values of all properties and of all methods without arguments, and the repr."""
    found = {"repr": repr(thing)}
    for name in dir(thing):
        if name.startswith("__") or name in ("_restore", "save"):
            continue
        value = getattr(thing, name)
        found[name] = value() if callable(value) else value
    return found


def same(a, b):
    """Asserts that two values are equal: arrays including nan, figures by their SVG."""
    if isinstance(a, (motorfit.Svg, motorfit.Record)):
        text = str if isinstance(a, motorfit.Svg) else motorfit.Record.to_csv
        assert type(a) is type(b) and text(a) == text(b)
    elif isinstance(a, motorfit.ComparisonBlock):
        same(answers(a), answers(b))
    elif isinstance(a, dict):
        assert list(a) == list(b)
        for key in a:
            same(a[key], b[key])
    elif isinstance(a, (list, tuple)):
        assert type(a) is type(b) and len(a) == len(b)
        for one, other in zip(a, b, strict=True):
            same(one, other)
    elif isinstance(a, pandas.DataFrame):
        assert a.equals(b)
    elif isinstance(a, np.ndarray):
        assert a.dtype == b.dtype
        np.testing.assert_array_equal(a, b)
    else:
        assert type(a) is type(b) and (a == b or a != a)
