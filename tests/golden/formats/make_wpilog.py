"""Writes the WPILib data logs of the tests: python3 make_wpilog.py NAME, or all of them without a name (needs numpy and wpilib 2026).

The writer is WPILib's own; its clock is simulated, so that the times are those of a control loop of 20 ms. `recording.wpilog` has the
samples of recording.csv. The others are the four tests of SysId on simulated mechanisms, with noise in velocity and position.
"""
import csv
import os
import pathlib
import subprocess
import sys
import tempfile
import time

HERE = pathlib.Path(__file__).parent
PERIOD = 0.02
# Time between two entries of a period [s].
SKEW = 100e-6
# kS [V], kV, kA [V per unit per s, per s²], kG [V], offset of the angle [rad], noise of the velocity
MECHANISMS = {
    "simple": (0.25, 2.1, 0.32, 0.0, 0.0, 0.01),
    "elevator": (0.18, 3.9, 0.21, 0.62, 0.0, 0.004),
    "arm": (0.2, 1.4, 0.09, 0.75, 0.1, 0.01),
}
TESTS = ["quasistatic-forward", "quasistatic-reverse", "dynamic-forward", "dynamic-reverse"]


def simulated(name, test, seed):
    """Returns rows of time, voltage, position and velocity of a test; the voltage holds over each period."""
    import numpy as np

    ks, kv, ka, kg, offset, noise = MECHANISMS[name]
    random = np.random.default_rng(seed)
    sign = 1.0 if test.endswith("forward") else -1.0
    limits = {"simple": 1e9, "elevator": 1.4, "arm": 1.4}[name]
    # The mechanism starts at the end from which it can move, and at rest.
    position = {"simple": 0.0, "elevator": 0.7 - 0.65 * sign, "arm": -0.9 * sign}[name]
    velocity, rows, steps = 0.0, [], 20
    for n in range(int((3.0 if test.startswith("quasi") else 1.2) / PERIOD)):
        balance = kg * (np.cos(position + offset) if name == "arm" else 1.0)
        base = balance if kg > 0.0 else 0.0
        volts = base + sign * (0.8 * n * PERIOD if test.startswith("quasi") else 3.0)
        measured = position + 0.05 * noise * random.standard_normal()
        rows.append((n * PERIOD, volts, measured, velocity + noise * random.standard_normal()))
        for _ in range(steps):
            balance = kg * (np.cos(position + offset) if name == "arm" else 1.0)
            drive = volts - balance
            h = PERIOD / steps
            # Exact for a constant balance; friction can stop the mechanism but not reverse it.
            if velocity == 0.0 and abs(drive) <= ks:
                continue
            direction = np.sign(velocity) if velocity != 0.0 else np.sign(drive)
            steady = (drive - ks * direction) / kv
            decay = np.exp(-kv / ka * h)
            new = steady + (velocity - steady) * decay
            moved = steady * h + (velocity - steady) * (1.0 - decay) * ka / kv
            if velocity != 0.0 and new * velocity < 0.0:
                new = 0.0
            velocity, position = float(new), float(position + moved)
        if abs(position) > limits:
            break
    return rows


def recording(path):
    """Writes the samples of recording.csv, the first at 1 s of the log."""
    import wpilib
    import wpiutil.log as wpilog

    wpilib.DataLogManager.start(str(path.parent), path.name)
    log = wpilib.DataLogManager.getLog()
    names = [("voltage", "Volt"), ("current", "Ampere"), ("speed", "Radian per Second")]
    entries = [wpilog.DoubleLogEntry(log, f"/motor/{name}", unit) for name, unit in names]
    with open(HERE / "recording.csv") as file:
        for row in list(csv.reader(file))[1:]:
            at = 1_000_000 + round(float(row[0]) * 1e6)
            for entry, value in zip(entries, row[1:]):
                entry.append(float(value), at)
    finish(log)


def routine(path, name):
    """Writes the four tests as SysIdRoutineLog does on a robot."""
    import wpilib
    from wpilib import simulation, sysid

    simulation.pauseTiming()
    wpilib.DataLogManager.start(str(path.parent), path.name)
    log = sysid.SysIdRoutineLog(name)
    states = dict(zip(TESTS, [sysid.State.kQuasistaticForward, sysid.State.kQuasistaticReverse, sysid.State.kDynamicForward, sysid.State.kDynamicReverse]))
    for seed, test in enumerate(TESTS):
        for _, volts, position, velocity in simulated(name, test, seed):
            # As SysIdRoutine does: the motor's values first, each a little later, then the state.
            motor = log.motor("main").voltage(volts)
            simulation.stepTiming(SKEW)
            turn = 2 * 3.141592653589793
            motor.position(position) if name == "elevator" else motor.angularPosition(position / turn)
            simulation.stepTiming(SKEW)
            motor.velocity(velocity) if name == "elevator" else motor.angularVelocity(velocity / turn)
            simulation.stepTiming(SKEW)
            log.recordState(states[test])
            simulation.stepTiming(PERIOD - 3 * SKEW)
        log.recordState(sysid.State.kNone)
        simulation.stepTiming(0.5)
    finish(wpilib.DataLogManager.getLog())


def advantage(path):
    """Writes the tests of the simple mechanism as AdvantageKit does: only changes, duty cycle and battery voltage, other names."""
    import wpilib
    import wpiutil.log as wpilog

    wpilib.DataLogManager.start(str(path.parent), path.name)
    log = wpilib.DataLogManager.getLog()
    metadata = '{"source":"AdvantageKit"}'
    state = wpilog.StringLogEntry(log, "/RealOutputs/Flywheel/SysIdTestState", metadata)
    names = ["Flywheel/DutyCycle", "Flywheel/VelocityRadPerSec", "Flywheel/PositionRad", "PowerDistribution/BatteryVoltage"]
    entries = [wpilog.DoubleLogEntry(log, f"/{name}", metadata) for name in names]
    last, now = [None] * 4, 2_000_000
    for seed, test in enumerate(TESTS):
        state.append(test, now)
        for _, volts, position, velocity in simulated("simple", test, seed):
            for n, value in enumerate([volts / 12.5, velocity, position, 12.5]):
                if value != last[n]:
                    entries[n].append(value, now)
                    last[n] = value
            now += 20_000
        state.append("none", now)
        now += 500_000
    finish(log)


def finish(log):
    import wpilib

    # A thread writes the file every quarter of a second.
    log.flush()
    time.sleep(0.6)
    wpilib.DataLogManager.stop()


WRITERS = {"recording": recording, "advantage": advantage}
WRITERS |= {f"sysid_{name}": lambda path, name=name: routine(path, name) for name in MECHANISMS}


def main():
    if len(sys.argv) > 1:
        # The manager of the log is a singleton of its process, and writes to a folder of its own.
        WRITERS[sys.argv[1]](pathlib.Path(sys.argv[2]))
        return
    for name in WRITERS:
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / f"{name}.wpilog"
            subprocess.run([sys.executable, __file__, name, str(path)], check=True)
            (HERE / path.name).write_bytes(path.read_bytes())


if __name__ == "__main__":
    main()
