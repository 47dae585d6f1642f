"""Files for simulators: MuJoCo reproduces the fitted trajectories; Modelica's equations do, integrated by scipy; URDF has the joint."""

import json
import re
import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import motorfit

PERIOD = 1e-3
TIME = np.arange(1500) * PERIOD
VOLTAGE = np.where(TIME < 0.05, 0.0, np.where(TIME < 0.6, 10.0, np.where(TIME < 1.1, -6.0, 2.5)))
MOTOR = {"R": 0.92, "L": 0.0078, "K": 0.0735, "B": 0.00068, "J": 0.000136}


def simulated(text, control, steps_at_least=1):
    """Angle, speed and activation of a MuJoCo model at each sample, the control held over each."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    steps = round(PERIOD / model.opt.timestep)
    assert steps >= steps_at_least and abs(steps * model.opt.timestep / PERIOD - 1) < 1e-9
    rows = []
    for value in control:
        rows.append([data.qpos[0], data.qvel[0], data.act[-1] if model.na else np.nan])
        data.ctrl[0] = value
        for _ in range(steps):
            mujoco.mj_step(model, data)
    return np.array(rows).T, model


def apart(own, expected):
    return np.sqrt(np.mean((own - expected) ** 2)) / np.std(expected)


def motor(**extensions):
    parameters = {**MOTOR, **extensions}
    return motorfit.simulate(parameters, TIME, VOLTAGE, noise="50dB", seed=3)


def test_mujoco_reproduces_the_motor():
    found = motorfit.identify(motor())
    (modelled,) = found.modelled()
    (_, speed, current), model = simulated(found.exports["mjcf"], VOLTAGE, 10)
    # The first-order integration of the winding leads by half a step of the simulation, 1e-3 of the rise.
    assert apart(speed, modelled["speed_rad_s"]) < 3e-3
    assert apart(current, modelled["current_A"]) < 1e-2
    assert not model.actuator_ctrllimited[0]


def test_mujoco_reproduces_friction_and_load():
    # The motor stops between reversals, where friction of MuJoCo's usual stiffness creeps.
    found = motorfit.identify(motor(Tc=0.05, TL=0.02), with_="coulomb,load")
    (modelled,) = found.modelled()
    (_, speed, current), model = simulated(found.exports["mjcf"], VOLTAGE)
    assert apart(speed, modelled["speed_rad_s"]) < 1e-2
    assert apart(current, modelled["current_A"]) < 2e-2
    assert model.dof_frictionloss[0] == pytest.approx(found.parameters["Tc"]) and model.nu == 2


def recorded(model, inputs, outputs):
    """Recording of a model with white noise 50 dB below each output."""
    random = np.random.default_rng(1)
    noisy = {name: y + 10**-2.5 * np.std(y) * random.standard_normal(len(y)) for name, y in outputs.items()}
    return model.read({"time_s": TIME, **inputs, **noisy})


def servo():
    model = motorfit.Model("servo-pendulum")
    values = {"G": 0.6, "J": 0.02, "B": 0.01, "Tc": 0.05, "Ts": 0.0, "ws": 1.0, "K": 0.3, "R": 2.0, "kp": 30.0, "kd": 1.5}
    reference = np.where(TIME < 0.05, 0.0, np.where(TIME < 0.8, 0.9, -0.4))
    outputs = model.simulate(values, {"ref": reference}, time=TIME)
    fix = {name: values[name] for name in values if name not in ("G", "J")}
    return model.identify(recorded(model, {"ref": reference}, outputs), fix=fix), reference


def test_mujoco_reproduces_a_servo_with_a_pendulum():
    found, reference = servo()
    (modelled,) = found.modelled()
    (angle, _, _), _ = simulated(found.exports["mjcf"], reference)
    assert apart(angle, modelled["q"]) < 3e-3


ARM = """
format = 1
name = "Arm whose actuator is a gain"
[inputs]
v = { unit = "V" }
[parameters]
kt = { unit = "N*m/V", min = 0.01, max = 4, log = true }
J = { unit = "kg*m^2", min = 1e-3, max = 0.1, log = true }
B = { unit = "N*m*s/rad", min = 1e-3, max = 2.8, log = true }
G = { unit = "N*m", min = 0, max = 4 }
[states]
q = { unit = "rad", d = "w", initial = 0 }
w = { unit = "rad/s", d = "(kt*v - G*sin(q) - B*w)/J", initial = 0 }
[outputs]
q = { value = "q", unit = "rad" }
w = { value = "w", unit = "rad/s" }
[export]
armature = "J"
damping = "B"
pendulum = "G"
gain = "kt"
"""


def test_mujoco_reproduces_an_actuator_that_is_a_gain():
    model = motorfit.Model(ARM)
    outputs = model.simulate({"kt": 0.2, "J": 0.012, "B": 0.14, "G": 0.44}, {"v": VOLTAGE}, time=TIME)
    # Without a current all four share one unknown scale.
    found = model.identify(recorded(model, {"v": VOLTAGE}, outputs), fix={"J": 0.012})
    (modelled,) = found.modelled()
    text = found.exports["mjcf"]
    (angle, speed, _), simulator = simulated(text, VOLTAGE)
    assert apart(angle, modelled["q"]) < 3e-3 and apart(speed, modelled["w"]) < 3e-3
    assert simulator.actuator_gear[0][0] == pytest.approx(found.parameters["kt"]) and "<motor name" in text
    assert f"effort {found.parameters['kt']:.6g}"[:12] in found.exports["urdf"]


def test_urdf_is_read_with_inertia_and_friction():
    found = motorfit.identify(motor(Tc=0.05), with_="coulomb")
    text = found.exports["urdf"]
    model = mujoco.MjModel.from_xml_string(text)
    of = found.parameters
    inertia = model.body_inertia[-1][0] + model.dof_armature[0]
    assert inertia == pytest.approx(of["J"], rel=1e-9)
    assert (model.dof_damping[0], model.dof_frictionloss[0]) == pytest.approx((of["B"], of["Tc"]))
    limit = ElementTree.fromstring(text).find("joint/limit")
    assert float(limit.get("effort")) == pytest.approx(of["K"] * 10 / of["R"], rel=1e-6)


def integrated(text, inputs):
    """Integrates the equations of a Modelica file, with the inputs held over each sample; the states at the samples."""
    number = r"-?[0-9.]+(?:e-?[0-9]+)?"
    known = dict(re.findall(rf"(?:parameter|constant) Real (\w+)(?:\([^)]*\))? = ({number})", text))
    scope = {name: float(value) for name, value in known.items()}
    scope.update({"tanh": np.tanh, "sin": np.sin, "exp": np.exp, "max": max, "min": min, "abs": abs})
    states = {name: float(start) for name, start in re.findall(rf"Real (\w+)\([^)]*start=({number}), fixed=true\)", text)}
    equations = re.findall(r"^  (der\(\w+\)|\w+) = (.*);$", text.split("equation\n")[1], re.MULTILINE)
    definitions = [(left, right.replace("^", "**")) for left, right in equations if not left.startswith(("der", "y_"))]
    rates = {left[4:-1]: right.replace("^", "**") for left, right in equations if left.startswith("der")}
    assert list(rates) == list(states)

    def rate(now):
        def of(_, x):
            values = {**scope, **now, **dict(zip(states, x))}
            for left, right in definitions:
                values[left] = eval(right, {}, values)
            return [eval(right, {}, values) for right in rates.values()]

        return of

    x, rows = list(states.values()), []
    for n in range(len(TIME)):
        rows.append(x)
        now = {name: signal[n] for name, signal in inputs.items()}
        x = solve_ivp(rate(now), (0, PERIOD), x, rtol=1e-8, atol=1e-10).y[:, -1]
    return dict(zip(states, np.array(rows).T))


def test_modelica_has_the_equations_of_the_motor_and_of_a_model():
    found = motorfit.identify(motor())
    (modelled,) = found.modelled()
    states = integrated(found.exports["modelica"], {"v": VOLTAGE, "TL": np.zeros(len(TIME))})
    assert apart(states["i"], modelled["current_A"]) < 1e-6
    assert apart(states["w"], modelled["speed_rad_s"]) < 1e-6
    # A model with definitions, constants, and units other than SI.
    model = motorfit.Model("dc-thermal")
    values = {"R": 0.9, "L": 2.0, "K": 0.05, "B": 1e-4, "J": 1e-4, "Cw": 5.0, "Rth": 3.0, "beta": 0.001}
    inputs = {"v": VOLTAGE, "Ta": np.full(len(TIME), 25.0)}
    outputs = model.simulate(values, inputs, time=TIME, initial={"T": 25.0})
    fix = {name: values[name] for name in ("beta", "Rth", "Cw", "B")}
    found = model.identify(recorded(model, inputs, outputs), fix=fix)
    (modelled,) = found.modelled()
    text = found.exports["modelica"]
    assert 'parameter Real L(unit="H") = 0.002' in text and 'unit="1/K"' in text
    states = integrated(text, {"v": VOLTAGE, "Ta": np.full(len(TIME), 298.15)})
    assert apart(states["w"], modelled["w"]) < 1e-5
    assert apart(states["T"] - 273.15, modelled["T"]) < 1e-5


def test_json_has_parameters_with_errors_and_roles():
    found = motorfit.identify(motor(Tc=0.05), with_="coulomb")
    of = json.loads(found.exports["json"])
    assert (of["format"], of["format_version"], of["trust"]) == ("motorfit-machine", 1, found.trust)
    assert of["parameters"]["R"]["value"] == found.parameters["R"]
    assert of["parameters"]["R"]["std_error"] == found.std_errors["R"]
    assert of["roles"]["armature"] == {"value": found.parameters["J"], "unit": "kg*m^2"}
    assert of["roles"]["frictionloss"]["value"] == found.parameters["Tc"]


def test_what_is_not_identifiable_is_not_exported_as_a_number():
    # Without the voltage nothing is known of R and L.
    columns = motor().to_columns()
    record = motorfit.Record.from_columns({name: columns[name] for name in ("time_s", "current_A", "speed_rad_s")})
    found = motorfit.identify(record, fix={"K": MOTOR["K"]})
    assert np.isnan(found.parameters["R"])
    assert set(found.exports) == {"urdf", "json"}
    assert json.loads(found.exports["json"])["parameters"]["R"]["value"] is None
    assert "R (resistance) = not identifiable" in found.exports["urdf"]
    # Of a model that has two resistances in series only the sum is known.
    model = motorfit.Model(motorfit.Model("dc-motor").text.replace("R*i", "(R + Rs)*i").replace("[states]", """
Rs = { unit = "ohm", min = 0.01, max = 1.0, log = true, description = "Resistance of the leads" }
[states]"""))
    outputs = model.simulate({**MOTOR, "Rs": 0.2}, {"v": VOLTAGE, "TL": np.zeros(len(TIME))}, time=TIME)
    found = model.identify(recorded(model, {"v": VOLTAGE}, outputs))
    assert np.isnan(found.parameters["R"]) and set(found.exports) == {"urdf", "json"}


def test_effects_without_a_place_are_named():
    # Dead time and brush drop are named in comments of formats without a place for them.
    found = motorfit.identify(motor(td=0.004), with_="dead-time")
    assert "Not held by this format: dead time, td" in found.exports["mjcf"]
    assert "delay(" in found.exports["modelica"]
