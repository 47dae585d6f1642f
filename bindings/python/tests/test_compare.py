"""`compare`: results equal those of the command line program exactly; arrays by method; errors for wrong settings."""

import json
import math
import warnings
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import motorfit
from conftest import M2, ROOT

SMALL = {"runs": 6, "generations": 20, "population": 30}
FLAGS = ["--runs", "6", "--generations", "20", "--population", "30"]


@pytest.fixture(scope="module")
def small():
    return motorfit.compare(**SMALL)


def untimed(document):
    """Returns the document without times and everything derived from them."""
    if isinstance(document, dict):
        timed = {"seconds", "seconds_one_run", "tables", "reached", "name"}
        return {key: untimed(value) for key, value in document.items() if key not in timed}
    return [untimed(value) for value in document] if isinstance(document, list) else document


@pytest.mark.parametrize(
    "settings, flags",
    [
        ({}, []),
        ({"criteria": ["nrmse:std", "iae:peak"], "methods": "gwo,ga"}, ["--criteria", "nrmse:std,iae:peak", "--methods", "gwo,ga"]),
        ({"set": ["ga.mutation=0.1/0.2"], "seed": 7, "bounds": {"R": (0.5, 1.5)}}, ["--set", "ga.mutation=0.1/0.2", "--seed", "7", "--bounds", "R=0.5:1.5"]),
        ({"fix": {"K": 0.073472}, "discretization": "foh", "target": 0.05}, ["--fix", "K=0.073472", "--discretization", "foh", "--target", "0.05"]),
    ],
)
def test_numbers_are_those_of_the_command_line(program, settings, flags):
    printed = json.loads(program("compare", *FLAGS, *flags, "--json", "--device", "cpu").stdout)
    found = motorfit.compare(**SMALL, **settings, device="cpu")
    assert untimed(found.to_dict()) == untimed(printed)
    assert json.loads(found.to_json()) == found.to_dict()


def test_a_recording_is_compared_on(program):
    path = ROOT / "examples" / "m2-step.csv"
    printed = json.loads(program("compare", path, *FLAGS, "--json", "--device", "cpu").stdout)
    found = motorfit.compare(motorfit.Record.from_file(path), **SMALL, device="cpu")
    assert found.to_dict()["blocks"][0]["methods"][0]["runs"] == printed["blocks"][0]["methods"][0]["runs"]
    assert found.expected == found.to_dict()["refined"]


def test_searches_on_a_model_are_those_of_the_command_line(program):
    path = ROOT / "examples" / "m2-step.csv"
    settings = ["--model", "dc-motor", "--methods", "jaya,de", "--fix", "B=7e-4", "--bounds", "R=0.5:1.5"]
    printed = json.loads(program("compare", path, *FLAGS, *settings, "--json", "--device", "cpu").stdout)
    machine = motorfit.Model("dc-motor")
    found = machine.compare(path, **SMALL, methods="jaya,de", fix={"B": 7e-4}, bounds={"R": (0.5, 1.5)}, device="cpu")
    assert untimed(found.to_dict()) == untimed(printed)
    assert found.blocks[0].parameters["de"].shape == (6, len(found.expected)) and "K" in found.to_columns()
    with pytest.raises(motorfit.UsageError, match="Steiglitz"):
        machine.compare(path, methods="gwo,sm", **SMALL)


def test_methods_are_compared_in_other_coordinates():
    found = motorfit.compare(methods=["de", "gwo"], runs=6, population=12, generations=5, transform=["mirror", "log"])
    tests = found.to_dict()["invariance"]
    assert [(test["method"], test["transform"]) for test in tests] == [
        ("de", "mirror"), ("gwo", "mirror"), ("de", "log"), ("gwo", "log"),
    ]
    assert [block.setting.split("transform ")[1:] for block in found.blocks] == [[], ["mirror"], ["log"]]


def test_the_preset_of_the_paper(program):
    printed = json.loads(program("compare", "--preset", "paper", "--runs", "2", "--json", "--device", "cpu").stdout)
    found = motorfit.compare(preset="paper", runs=2, device="cpu")
    assert untimed(found.to_dict()["blocks"]) == untimed(printed["blocks"])
    assert found.to_dict()["paper"]


def test_attributes_agree_with_the_document(small):
    document = small.to_dict()
    (block,), (printed,) = small.blocks, document["blocks"]
    assert block.setting == printed["setting"]
    assert block.methods == ["gwo", "jaya", "ga"]
    assert block.ranking == printed["ranking"]
    assert sorted(block.ranking, key=lambda name: np.median(block.costs[name])) == block.ranking
    for contest in printed["methods"]:
        name, runs = contest["method"], contest["runs"]
        assert block.costs[name].tolist() == [run["cost"] for run in runs]
        assert block.parameters[name].tolist() == [list(run["parameters"].values()) for run in runs]
        assert block.histories[name].tolist() == [run["history"] for run in runs]
        assert block.evaluations[name].tolist() == [run["evaluations"] for run in runs]
        assert block.seconds[name] == contest["seconds_one_run"] > 0
        assert block.histories[name].shape == (6, 20)
    assert small.expected == M2
    assert small.steiglitz_mcbride == document["steiglitz_mcbride"]["parameters"]
    assert small.evaluations == document["evaluations"] >= 3 * 6 * 20 * 30
    assert small.device[0] == "cpu" and not small.interrupted and small.seconds > 0
    assert block.ranking[0] in repr(small) and block.ranking[0] in repr(block)


def test_drawings(small):
    (block,) = small.blocks
    for drawing in (block.plot_convergence(), block.plot_errors(), block.plot_distributions(), block.plot_waterfall()):
        assert ET.fromstring(str(drawing)).tag.endswith("svg")
        assert drawing.caption
        assert "jaya" in str(drawing)


def test_diverging_candidates_cost_infinity():
    found = motorfit.compare(runs=6, generations=3, population=5, bounds={"R": (100, 1000), "L": (1e-6, 1e-5)}, discretization="euler")
    (block,) = found.blocks
    for name in block.methods:
        assert np.all(np.isinf(block.costs[name]))
        assert np.all(np.isnan(block.parameters[name]))
    assert found.to_dict()["blocks"][0]["methods"][0]["runs"][0]["cost"] is None


def test_a_callback_ends_it():
    seen = []

    def look(progress):
        seen.append(progress.generation)
        return progress.generation < 5

    found = motorfit.compare(runs=2, generations=50, population=20, progress=look)
    assert found.interrupted
    (block,) = found.blocks
    assert max(seen) < 50
    assert all(history.shape[1] < 50 for history in block.histories.values())

    def fails(_):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        motorfit.compare(**SMALL, progress=fails)


@pytest.mark.parametrize(
    "settings, message",
    [
        ({"preset": "paper", "methods": "gwo"}, "preset=\"paper\" cannot be combined with methods"),
        ({"methods": "sm"}, "methods names no search"),
        ({"methods": ["gwo", "gwo"]}, "names gwo twice"),
        ({"methods": "wolf"}, "wolf"),
        ({"methods": "auto"}, "auto cannot be compared"),
        ({"criteria": "nrmse:nothing"}, "nrmse:nothing"),
        ({"criteria": ["mse:std", "mse:std"]}, "criteria has a value twice"),
        ({"generations": [3, 3]}, "generations has a value twice"),
        ({"population": []}, "nothing to compare"),
        ({"set": "ga.nothing=1"}, "nothing"),
        ({"set": "mutation=1"}, "names no method"),
        ({"runs": 0}, "nothing to compare"),
        ({"target": -1.0}, "target"),
        ({"target": math.nan}, "target"),
        ({"threads": 0}, "threads is 0"),
        ({"fix": {"R": -1.0}}, "fix: R is -1"),
    ],
)
def test_wrong_settings_raise_usage_errors(settings, message):
    with pytest.raises(motorfit.UsageError, match=message) as raised:
        motorfit.compare(**settings)
    assert raised.value.remedy


def test_keywords_are_checked(record):
    with pytest.raises(TypeError, match="did you mean methods"):
        motorfit.compare(method="gwo")
    with pytest.raises(TypeError):
        motorfit.compare(runs=2.5)
    with pytest.raises(motorfit.UsageError, match="combined with records"):
        motorfit.compare(record, preset="paper")
    with pytest.raises(motorfit.DataError):
        motorfit.compare(motorfit.Record(record.time, current=record.current, speed=record.speed))


def test_comparisons_are_shown_as_text_html_and_frames():
    found = motorfit.compare(runs=3, generations=4, population=8, methods="gwo,jaya", criteria="nrmse:std,iae:peak")
    frame = found.to_frame()
    assert len(frame) == 2 * 2 * 3 and list(frame["run"][:3]) == [0, 1, 2]
    for block in found.blocks:
        for method in block.methods:
            rows = frame[(frame["setting"] == block.setting) & (frame["method"] == method)]
            np.testing.assert_array_equal(rows["cost"], block.costs[method])
            np.testing.assert_array_equal(rows[list("RLKBJ")], block.parameters[method])
            np.testing.assert_array_equal(rows["evaluations"], block.evaluations[method])
    text = " ".join(ET.fromstring(found._repr_html_()).itertext())
    for shown in (text, found.summary()):
        assert all(block.setting in shown for block in found.blocks) and "lowest median cost" in " ".join(shown.split())
    assert found._repr_html_().count("<figure") == 2
    document = found.to_dict()
    assert [found.truth, found.runs, found.stop, found.invariance] == [document[key] for key in ("truth", "runs", "stop", "invariance")]
    assert {key for key in document if not hasattr(found, {"motorfit": "version"}.get(key, key))} == set()


def test_warnings_of_comparisons_are_python_warnings(record):
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        found = motorfit.compare(record, methods="gwo", runs=2, generations=3, population=8, bounds={"R": (2, 5)})
    assert [w.message for w in issued if issubclass(w.category, motorfit.MotorfitWarning)] == found.warnings
    assert all(w.code in repr(found) for w in found.warnings)
