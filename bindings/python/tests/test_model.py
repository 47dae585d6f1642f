"""Models of users: text, files, mappings; simulation, evaluator and identification agree with each other and with closed forms."""

import pickle

import numpy as np
import pytest

import motorfit
from conftest import answers, same

TEXT = """
format = 1
name = "first order"
[inputs]
u = { unit = "V" }
[parameters]
R = { unit = "ohm", min = 0.1, max = 10, log = true }
L = { unit = "H", min = 1e-3, max = 1, log = true }
[states]
i = { unit = "A", d = "(u - R*i)/L", initial = "measured" }
[outputs]
i = { value = "i", unit = "A" }
"""
SECTIONS = {
    "format": 1,
    "name": "first order",
    "inputs": {"u": {"unit": "V"}},
    "parameters": {
        "R": {"unit": "ohm", "min": np.float64(0.1), "max": 10, "log": True},
        "L": {"unit": "H", "min": 1e-3, "max": 1, "log": True},
    },
    "states": {"i": {"unit": "A", "d": "(u - R*i)/L", "initial": "measured"}},
    "outputs": {"i": {"value": "i", "unit": "A"}},
}
TRUTH = {"R": 2.0, "L": 0.05}
TIME = np.arange(400) * 1e-3
VOLTAGE = np.where(TIME < 0.1, 0.0, np.where(TIME < 0.25, 6.0, -3.0))


def closed_form():
    """Current of the circuit: exponential approaches to u/R with the time constant L/R."""
    current = np.zeros(len(TIME))
    decay = np.exp(-1e-3 * TRUTH["R"] / TRUTH["L"])
    for n in range(len(TIME) - 1):
        end = VOLTAGE[n] / TRUTH["R"]
        current[n + 1] = end + (current[n] - end) * decay
    return current


def record(model, sigma=0.01, seed=1):
    noise = sigma * np.random.default_rng(seed).standard_normal(len(TIME))
    (found,) = model.read({"time_s": TIME, "u [V]": VOLTAGE, "i [mA]": 1000 * (closed_form() + noise)})
    return found


def test_sources_are_one_model(tmp_path):
    path = tmp_path / "circuit.toml"
    path.write_text(TEXT)
    of_text, of_path, of_sections = motorfit.Model(TEXT), motorfit.Model(path), motorfit.Model(SECTIONS)
    assert of_text == of_path and hash(of_text) == hash(of_path)
    for model in (of_text, of_sections, pickle.loads(pickle.dumps(of_sections))):
        assert model.name == "first order" and model.parameters == ["R", "L"]
        assert model.inputs == ["u"] and model.states == model.outputs == ["i"]
        assert model.bounds == {"R": (0.1, 10.0), "L": (1e-3, 1.0)}
        assert model.units == {"u": "V", "i": "A", "R": "ohm", "L": "H"}
        assert motorfit.Model(model.text) == model
    assert "pmsm" in motorfit.Model.built_in() and motorfit.Model("pmsm").parameters[0] == "R"
    assert "alias Scalar = f32;" in of_text.wgsl("f32") and "alias Scalar = f64;" in of_text.wgsl()


def test_order_of_a_mapping_is_kept():
    swapped = {**SECTIONS, "parameters": dict(reversed(SECTIONS["parameters"].items()))}
    assert motorfit.Model(swapped).parameters == ["L", "R"]


@pytest.mark.parametrize(
    ("source", "error", "message"),
    [
        (3, TypeError, "text, the path or the name"),
        ({"format": [1]}, TypeError, r"format is \[1\]"),
        ({"format": float("nan")}, TypeError, "finite"),
        ({1: 2}, TypeError, "give text"),
        ("no-such-model", motorfit.DataError, "neither a file nor a built-in model"),
        (TEXT.replace("R*i", "r*i"), motorfit.DataError, 'line 10, column .*"r" is not known'),
    ],
)
def test_wrong_models_are_reported(source, error, message):
    with pytest.raises(error, match=message):
        motorfit.Model(source)


def test_simulation_is_the_closed_form():
    model = motorfit.Model(TEXT)
    found = model.simulate(TRUTH, {"u": VOLTAGE}, time=TIME)["i"]
    np.testing.assert_allclose(found, closed_form(), rtol=0, atol=1e-12)
    begun = model.simulate(TRUTH, {"u": np.zeros(400)}, time=TIME, initial={"i": 3.0})["i"]
    np.testing.assert_allclose(begun, 3.0 * np.exp(-TIME * 40.0), rtol=0, atol=1e-12)
    for parameters, inputs, initial, message in [
        ({"R": 1.0}, {"u": VOLTAGE}, None, "lacks L"),
        ({**TRUTH, "K": 1.0}, {"u": VOLTAGE}, None, "there is no K"),
        (TRUTH, {}, None, "lacks u"),
        (TRUTH, {"u": VOLTAGE[1:]}, None, "399 values for 400 times"),
        (TRUTH, {"u": VOLTAGE}, {"w": 1.0}, "there is no w"),
    ]:
        with pytest.raises(motorfit.UsageError, match=message):
            model.simulate(parameters, inputs, time=TIME, initial=initial)


def test_costs_are_those_of_the_definition():
    model = motorfit.Model(TEXT)
    one = record(model)
    costs = motorfit.Evaluator(one, model=model, criterion="mse", scale="none")
    assert costs.names == ["R", "L"] and costs.bounds == [(0.1, 10.0), (1e-3, 1.0)] and costs.device[0] == "cpu"
    # The simulation begins with the first measured sample.
    noise = 0.01 * np.random.default_rng(1).standard_normal(len(TIME))
    start = noise[0] * np.exp(-TIME * TRUTH["R"] / TRUTH["L"])
    expected = np.mean((noise - start) ** 2)
    found = costs([[2.0, 0.05], [np.nan, 1.0], [4.0, 0.05]])
    assert abs(found[0] / expected - 1) < 1e-9 and np.isinf(found[1]) and found[2] > found[0]
    again = pickle.loads(pickle.dumps(costs))
    np.testing.assert_array_equal(again([[2.0, 0.05]]), found[:1])
    alone = motorfit.Evaluator(one, model=model, criterion="mse", scale="none", threads=1, fix={"L": 0.05})
    assert alone.names == ["R"]
    np.testing.assert_array_equal(alone([[2.0]]), found[:1])


def test_identification_covers_the_truth():
    model = motorfit.Model(SECTIONS)
    inside = 0
    for seed in range(40):
        found = model.identify(record(model, seed=seed))
        inside += sum(low <= TRUTH[name] <= high for name, (low, high) in found.ci95.items())
    # Of 80 intervals 95 % ± 3.5 √(0.95·0.05/80) cover.
    assert 69 <= inside <= 80
    assert found.trust == "good" and found.trust_reasons == [] and found.next_step is None
    assert found.units == {"R": "ohm", "L": "H"} and found.free == ["R", "L"] and found.correlation.shape == (2, 2)
    assert found.fit_percent["i"] > 98 and found.modelled()[0]["i"].shape == (400,)
    assert found.to_dict()["parameters"]["R"]["value"] == found.parameters["R"] and found.model == model
    assert list(found.to_frame("pandas")["parameter"]) == ["R", "L"]
    assert "R = " in repr(found) and "trust good" in repr(found)
    same(answers(pickle.loads(pickle.dumps(found))), answers(found))


def test_held_out_recordings_progress_and_wrong_settings():
    model = motorfit.Model(TEXT)
    seen = []
    found = model.identify(record(model), validate=record(model, seed=2), progress=lambda of: seen.append(of.generation))
    assert found.validation["fit_percent"]["i"] > 98 and seen
    with pytest.raises(motorfit.UsageError, match="the model has no term \"coulomb\""):
        model.identify(record(model), with_="coulomb")
    with pytest.raises(motorfit.DataError):
        motorfit.Model("pmsm").identify(record(model))


def test_starts_are_one_or_several():
    model = motorfit.Model(TEXT)
    one = record(model)
    alone = model.identify(one)
    for start in [
        "R=2,L=0.05",
        {"R": 2.0},
        ["R=2", "L=0.05", "R=5"],
        [{"R": 2.0, "L": 0.05}, {"R": 5.0}, {}],
        ["R=2,L=0.05", {"R": 5.0}],
    ]:
        # They lead to the optimum that the search has found: nothing changes.
        assert model.identify(one, start=start).parameters == alone.parameters
    with pytest.raises(motorfit.UsageError, match="start gives R twice"):
        model.identify(one, start="R=2,R=3")
    with pytest.raises(TypeError, match="start: give"):
        model.identify(one, start=[1.0, 2.0])
