"""Writes feedback.csv: gains of WPILib's own linear-quadratic regulator (needs robotpy-wpimath 2026)."""
import pathlib

import wpimath.controller as controller
import wpimath.system.plant as plant

# Name, output per volt, velocity per unit, period [s], normalized, delay [s].
CONTROLLERS = [
    ("wpilib", 1.0, 1.0, 0.02, True, 0.0),
    ("ctre-v6", 1.0, 1.0, 0.001, True, 0.001),
    ("ctre-v5", 1023 / 12, 0.1, 0.001, False, 0.0815),
    ("ctre-cancoder", 1 / 12, 60.0, 0.001, True, 0.0815),
    ("rev-neo", 1 / 12, 60.0, 0.001, False, 0.112),
    ("rev-encoder", 1 / 12, 60.0, 0.001, False, 0.0815),
    ("venom", 4096 / 12, 60.0, 0.001, False, 0.005),
]
MECHANISMS = [(3.060, 0.327), (0.0693, 0.1170), (2.1, 0.32), (3.9, 0.21), (1.4, 0.09), (12.0, 1.5)]
POSITION, VELOCITY, VOLTS = 1.0, 1.5, 7.0

lines = ["# WPILib 2026.2.2, errors of 1 and 1.5, 7 V", "controller,kV,kA,velocity_kP,position_kP,position_kD"]
for name, output, factor, period, normalized, delay in CONTROLLERS:
    for kv, ka in MECHANISMS:
        system = plant.LinearSystemId.identifyVelocitySystemMeters(kv, ka)
        velocity = controller.LinearQuadraticRegulator_1_1(system, [VELOCITY], [VOLTS], period)
        velocity.latencyCompensate(system, period, delay)
        system = plant.LinearSystemId.identifyPositionSystemMeters(kv, ka)
        position = controller.LinearQuadraticRegulator_2_1(system, [POSITION, VELOCITY], [VOLTS], period)
        position.latencyCompensate(system, period, delay)
        per_period = 1.0 if normalized else 1.0 / period
        gains = [velocity.K(0, 0) * output / factor, position.K(0, 0) * output, position.K(0, 1) * output * per_period]
        lines.append(",".join([name, repr(kv), repr(ka)] + [repr(float(gain)) for gain in gains]))
(pathlib.Path(__file__).parent / "feedback.csv").write_text("\n".join(lines) + "\n")
