"""What the tests share: a motor, its recordings, the program that numbers are held against."""

import os
import pathlib
import signal
import subprocess

import numpy as np
import pytest

import motorfit

# Tests that are started in the background would not hear Ctrl-C, and their children neither.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = pathlib.Path(__file__).parents[3]
M2 = {"R": 0.921042, "L": 0.007759, "K": 0.073472, "B": 0.000678, "J": 0.000136}


def step(seed=1, noise="40dB", duration=1.0, at=0.1):
    """The paper's motor under a step of 10.5 V, 1 kHz."""
    time = np.arange(0, duration, 0.001)
    return motorfit.simulate(M2, time, np.where(time >= at, 10.5, 0.0), noise=noise, seed=seed)


@pytest.fixture(scope="session")
def record():
    return step()


@pytest.fixture(scope="session")
def program():
    """The command line program, built from the same sources."""
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
