"""`identify`: results equal those of the command line program exactly; attributes, progress, interruption, errors."""

import json
import math
import pathlib
import pickle
import re
import signal
import subprocess
import sys
import threading
import time
import warnings
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor

import matplotlib.image
import numpy as np
import pytest

import motorfit
from conftest import M2, ROOT, step


def without_times(document):
    """Returns the document without times and device."""
    document = {key: value for key, value in document.items() if key not in ("seconds", "device")}
    # The advice spells flags in the program and keyword arguments here.
    document["trust"] = {**document["trust"], "next": document["trust"]["next"] is not None}
    return document


@pytest.mark.parametrize(
    ("flags", "settings"),
    [
        ([], {}),
        (["--method", "gwo", "--seed", "7"], {"method": "gwo", "seed": 7}),
        (["--method", "ga", "--polish", "none", "--population", "30", "--generations", "20", "--set", "mutation=0.1"],
         {"method": "ga", "polish": "none", "population": 30, "generations": 20, "set": "mutation=0.1"}),
        (["--method", "jaya", "--criterion", "itae", "--scale", "peak", "--bounds", "R=0.5:2,L=0.001:0.1"],
         {"method": "jaya", "criterion": "itae", "scale": "peak", "bounds": {"R": (0.5, 2), "L": (0.001, 0.1)}}),
        (["--fix", "R=0.921042", "--with", "coulomb"], {"fix": {"R": 0.921042}, "with_": ["coulomb"]}),
        (["--discretization", "foh", "--initial", "free"], {"discretization": "foh", "initial": "free"}),
    ],
)
def test_the_numbers_are_those_of_the_command_line(program, tmp_path, flags, settings):
    path = tmp_path / "record.csv"
    path.write_text(step(seed=5).to_csv())
    printed = json.loads(program("identify", path, "--json", "--device", "cpu", *flags).stdout)
    found = motorfit.identify(motorfit.Record.from_file(path), device="cpu", **settings)
    assert without_times(found.to_dict()) == without_times(printed)
    assert found.trust == printed["trust"]["level"]


def test_a_joint_fit_and_held_out_recordings_too(program, tmp_path):
    paths = [tmp_path / f"{n}.csv" for n in range(3)]
    for n, path in enumerate(paths):
        path.write_text(step(seed=n).to_csv())
    printed = program("identify", paths[0], paths[1], "--validate", paths[2], "--json").stdout
    records = [motorfit.Record.from_file(path) for path in paths]
    found = motorfit.identify(records[:2], validate=records[2])
    assert without_times(found.to_dict()) == without_times(json.loads(printed))
    assert found.to_dict()["validation"]["records"]


def test_attributes_are_consistent(record):
    found = motorfit.identify(record, method="gwo", generations=30)
    assert set(found.parameters) == set("RLKBJ") == set(found.std_errors) == set(found.ci95)
    for symbol, value in found.parameters.items():
        low, high = found.ci95[symbol]
        assert low < value < high
        assert abs(value - M2[symbol]) < 6 * found.std_errors[symbol]
    errors = np.array([found.std_errors[symbol] for symbol in found.free])
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), errors, rtol=1e-12)
    np.testing.assert_allclose(found.covariance, found.correlation * np.outer(errors, errors), rtol=1e-12)
    assert found.history.shape == (30,) and np.all(np.diff(found.history) <= 0)
    left = record.speed - found.modelled()[0]["speed_rad_s"]
    fit = 100 * (1 - np.linalg.norm(left) / np.linalg.norm(record.speed - record.speed.mean()))
    assert found.fit_percent["speed"] == pytest.approx(fit, abs=1e-9)
    assert "R = 0.9" in repr(found)


def test_drawings_are_svg(record, tmp_path):
    found = motorfit.identify(record, method="gwo", generations=10)
    for drawing in (found.plot_response(), found.plot_correlation(), found.plot_history()):
        assert drawing._repr_svg_().startswith("<svg") and drawing.caption
    with pytest.raises(IndexError):
        found.plot_response(1)
    assert motorfit.identify(record, polish="none").plot_correlation() is None


def test_figures_are_saved_in_the_format_of_the_suffix(record, tmp_path, monkeypatch):
    drawing = record.plot()
    for name in ("fit.svg", "FIT.SVG"):
        drawing.save(tmp_path / name)
        assert (tmp_path / name).read_text() == str(drawing)
    # An SVG file follows the colours of the system.
    for figure in (drawing, motorfit.identify(record).plot_correlation()):
        assert "prefers-color-scheme: dark" in str(figure)
    drawing.save(str(tmp_path / "fit.png"))
    pixels = matplotlib.image.imread(tmp_path / "fit.png")
    width = float(re.search(r'width="([\d.]+)"', str(drawing)).group(1))
    assert pixels.shape[1] == round(2 * width) and pixels.shape[2] in (3, 4)
    # White ground, with the lines in other colours.
    assert pixels[0, 0].min() == 1.0 and 0.001 < (pixels[..., :3].min(axis=2) < 0.5).mean() < 0.5
    for wrong in ("fit.pdf", "fit"):
        with pytest.raises(motorfit.UsageError, match=f"{wrong}.*\n.*svg or .png"):
            drawing.save(tmp_path / wrong)
    with pytest.raises(FileNotFoundError, match="none.*fit.svg"):
        drawing.save(tmp_path / "none" / "fit.svg")
    monkeypatch.setitem(sys.modules, "resvg_py", None)
    with pytest.raises(ImportError, match="other.png.*pip install"):
        drawing.save(tmp_path / "other.png")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["FIT.SVG", "fit.png", "fit.svg"]


def test_an_identification_is_simulated(record):
    found = motorfit.identify(record)
    again = motorfit.simulate(found)
    np.testing.assert_allclose(again.speed, found.modelled()[0]["speed_rad_s"], rtol=1e-9, atol=1e-9)
    np.testing.assert_array_equal(motorfit.simulate(found, record).speed, again.speed)
    np.testing.assert_array_equal(motorfit.simulate(found, record.time, record.voltage).speed, again.speed)
    np.testing.assert_array_equal(motorfit.simulate(pickle.loads(pickle.dumps(found))).speed, again.speed)
    loaded = motorfit.simulate(found, record, load_torque=np.full(len(record), 0.01))
    assert loaded.speed[-1] < again.speed[-1] - 1
    held = motorfit.identify([record, step(seed=2)], per_recording="R", with_="coulomb", discretization="foh")
    values = {name.removesuffix("[0]"): value for name, value in held.parameters.items() if not name.endswith("[1]")}
    assert motorfit.simulate(held, record).speed[-1] == pytest.approx(motorfit.simulate(values, record).speed[-1], rel=1e-6)
    assert np.abs(motorfit.simulate(held).speed - motorfit.simulate(values, record).speed).max() > 1e-3, "another discretization"


def test_what_cannot_be_simulated_is_an_error(record):
    lacking = motorfit.identify(motorfit.Record(record.time, voltage=record.voltage, speed=record.speed))
    with pytest.raises(motorfit.NotIdentifiedError, match="R, .*not identified"):
        motorfit.simulate(lacking)
    by_current = motorfit.Record(record.time, current=record.current, speed=record.speed)
    with pytest.raises(motorfit.DataError, match="no voltage"):
        motorfit.simulate("m2", by_current)
    for given in (("m2",), ("m2", record.time), ("m2", record, record.voltage), ("m2", None, record.voltage)):
        with pytest.raises(TypeError, match="needs time and voltage"):
            motorfit.simulate(*given)


PWM = "time=ms:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA"
#: Attribute of each key of `to_dict` whose name differs.
RENAMED = {"motorfit": "version", "with": "extensions", "ladder": "model_selection", "residuals": "residual_tests",
           "repeatability": "noise_floor"}
#: Keys whose attributes are objects of Python instead of documents.
OBJECTS = {"trust", "records", "parameters", "fit_percent", "correlation", "history", "warnings", "remarks"}


@pytest.mark.parametrize("settings", [{}, {"with_": "auto"}, {"method": "gwo", "generations": 5, "polish": "none"}])
def test_everything_of_to_dict_is_an_attribute(record, settings):
    found = motorfit.identify(record, **settings)
    for key, value in found.to_dict().items():
        attribute = getattr(found, RENAMED.get(key, key))
        assert key in OBJECTS or attribute == value, key
    trust = found.to_dict()["trust"]
    assert found.trust == trust["level"]
    assert [reason.code for reason in found.trust_reasons] == [reason["code"] for reason in trust["reasons"]]


def test_the_next_step_is_spelled_as_a_keyword():
    """The document has the command of the program in its place."""
    found = motorfit.identify(motorfit.Record.from_file(ROOT / "examples" / "pwm-log.csv", columns=PWM))
    assert found.trust == "check" and found.next_step == 'with_="auto"'
    assert "--with auto" in found.to_dict()["trust"]["next"]
    assert [reason.code for reason in found.trust_reasons] == ["residuals", "model_incomplete"]
    assert motorfit.identify(step()).next_step is None


def test_summaries_and_frames_have_the_estimates(record):
    found = motorfit.identify(record, fix={"B": M2["B"]})
    text = found.summary()
    assert all(word in text for word in ("Trust: ", "R, resistance", f"{found.parameters['R']:.6g}"[:6], "fit [%]", "fixed"))
    assert max(map(len, text.splitlines())) <= 130
    for frame in (found.to_frame(), found.to_frame("polars")):
        assert list(frame["parameter"]) == list(found.parameters)
        for n, name in enumerate(found.parameters):
            row = [frame[key][n] for key in ("value", "std_error", "ci95_low", "ci95_high")]
            np.testing.assert_array_equal(row, [found.parameters[name], found.std_errors[name], *found.ci95[name]])
        assert list(frame["unit"])[0] == "ohm" and list(frame["fixed"]) == [name == "B" for name in found.parameters]


def test_the_callback_sees_each_generation_and_can_end_the_search(record):
    seen = []
    found = motorfit.identify(record, method="gwo", generations=25, progress=seen.append)
    assert [p.generation for p in seen] == list(range(1, 26)) and seen[-1].evaluations == 2500
    assert seen[-1].cost == found.history[-1]
    ended = motorfit.identify(record, method="gwo", progress=lambda p: p.generation < 10)
    assert ended.to_dict()["stop"] == "interrupted" and len(ended.history) == 10

    def failing(progress):
        raise LookupError(progress.generation)

    with pytest.raises(LookupError, match="1"):
        motorfit.identify(record, method="gwo", progress=failing)


def test_wrong_settings_are_named(record):
    with pytest.raises(TypeError, match="did you mean method"):
        motorfit.identify(record, metod="gwo")
    with pytest.raises(motorfit.UsageError, match="method"):
        motorfit.identify(record, method="simplex")
    with pytest.raises(motorfit.UsageError):
        motorfit.identify(record, bounds={"R": (2, 1)})
    with pytest.raises(TypeError, match="population"):
        motorfit.identify(record, population="many")
    with pytest.raises(motorfit.DeviceError):
        motorfit.identify(record, device="gpu:no such adapter", method="gwo")
    with pytest.raises(TypeError):
        motorfit.identify([])
    flat = motorfit.Record(record.time, voltage=np.zeros(len(record)), current=record.current, speed=record.speed)
    with pytest.raises(motorfit.NotIdentifiedError):
        motorfit.identify(flat)


def test_single_estimators_agree_with_identify(record):
    found = motorfit.identify(record)
    estimate = motorfit.steiglitz_mcbride(record)
    refined = motorfit.refine(record, estimate)
    assert refined["converged"]
    for symbol, value in found.parameters.items():
        assert refined["parameters"][symbol] == pytest.approx(value, rel=1e-6)
        assert refined["std_errors"][symbol] == pytest.approx(found.std_errors[symbol], rel=1e-4)
    with pytest.raises(motorfit.UsageError, match="J"):
        motorfit.refine(record, {key: estimate[key] for key in "RLKB"})


def test_other_threads_run_during_a_search(record):
    def search(generations):
        """Returns the sorted times [s] of the start, of the wake-ups of another thread meanwhile, and of the end."""
        seen, done = [time.perf_counter()], threading.Event()

        def look():
            while not done.is_set():
                seen.append(time.perf_counter())
                time.sleep(0.001)

        thread = threading.Thread(target=look)
        thread.start()
        try:
            motorfit.identify(record, method="gwo", population=400, generations=generations, polish="none")
        finally:
            seen.append(time.perf_counter())
            done.set()
            thread.join()
        return np.sort(seen)

    generations = 200
    while (seen := search(generations))[-1] - seen[0] < 0.3:
        generations *= 4
    # If the search kept the GIL, one gap would be as long as the search.
    assert np.diff(seen).max() < 0.5 * (seen[-1] - seen[0])


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
@pytest.mark.parametrize("work", ["identify", "evaluate"])
def test_ctrl_c_ends_it(work):
    calls = {
        "identify": "motorfit.identify(r, method='gwo', population=20000, generations=20000)",
        "evaluate": "e = motorfit.Evaluator(r, device='cpu', threads=1); e(np.tile([1.0, 0.01, 0.1, 1e-3, 1e-4], (5_000_000, 1)))",
    }
    program = (
        "import numpy as np, motorfit\n"
        "t = np.arange(0, 3, 0.001)\n"
        "r = motorfit.simulate('m2', t, np.where(t > 0.1, 10.5, 0.0), noise='40dB')\n"
        "print('ready', flush=True)\n"
        f"try:\n    {calls[work]}\nexcept KeyboardInterrupt:\n    print('interrupted')\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, cwd=pathlib.Path.home())
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.7)
    assert child.poll() is None, "it ended before it could be interrupted"
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=60)[0] == "interrupted\n"


@pytest.mark.parametrize("false", [False, np.False_, np.float64(1) < 0])
def test_any_false_ends_the_search(record, false):
    found = motorfit.identify(record, method="gwo", progress=lambda p: false)
    assert len(found.history) < 10


@pytest.mark.parametrize("other", [None, True, np.True_, 0, "", []])
def test_other_return_values_do_not_end_the_search(record, other):
    assert len(motorfit.identify(record, method="gwo", generations=15, progress=lambda p: other).history) == 15


def test_the_callback_runs_in_the_calling_thread(record):
    seen = set()
    nested = []

    def look(progress):
        seen.add(threading.current_thread())
        if not nested:
            # The threads of the pool are occupied by the search that waits for this callback.
            nested.append(motorfit.identify(record, method="gwo", generations=3, progress=lambda p: None).cost)
            table = np.repeat([list(M2.values())], 20_000, axis=0)
            nested.append(motorfit.Evaluator(record, device="cpu")(table)[0])

    motorfit.identify(record, method="gwo", generations=5, progress=look)
    assert seen == {threading.current_thread()} and len(nested) == 2


def test_searches_in_many_threads_with_nested_work(record):
    expected = motorfit.identify(record, method="gwo", generations=8, seed=3).cost

    def look(progress):
        motorfit.steiglitz_mcbride(record)

    def work(_):
        return motorfit.identify(record, method="gwo", generations=8, seed=3, progress=look).cost

    with ThreadPoolExecutor(6) as pool:
        assert set(pool.map(work, range(12))) == {expected}


def test_a_wrong_callback_is_rejected(record):
    async def look(progress):
        return False

    with pytest.raises(TypeError, match="coroutine"):
        motorfit.identify(record, method="gwo", progress=look)
    with pytest.raises(TypeError, match="function"):
        motorfit.identify(record, progress=3)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"method": "gwo", "population": 0}, "population"),
        ({"bounds": {"R": 0.5}}, "bounds"),
        ({"device": "cuda"}, "device"),
        ({"criterion": "itae", "time_origin": float("nan")}, "time_origin"),
        ({"threads": 0}, "threads"),
    ],
)
def test_errors_name_keyword_arguments(record, settings, message):
    with pytest.raises(motorfit.MotorfitError) as raised:
        motorfit.identify(record, **settings)
    text = f"{raised.value} {raised.value.remedy}"
    assert "--" not in text and message in text


@pytest.mark.parametrize("pair", [(0.5, 2), [0.5, 2.0], np.array([0.5, 2.0]), "0.5:2"])
def test_pairs_come_in_any_form(record, pair):
    bounds = motorfit.Evaluator(record, bounds={"R": pair}).bounds
    assert bounds[0] == (0.5, 2.0)


def test_wrong_values_are_named(record):
    with pytest.raises(TypeError, match="fix: R is None"):
        motorfit.identify(record, fix={"R": None})
    with pytest.raises(TypeError, match="population: 'float' object"):
        motorfit.identify(record, population=2.5)
    with pytest.raises(TypeError, match="bounds: R is .1, 2, 3."):
        motorfit.identify(record, bounds={"R": [1, 2, 3]})
    noise = {"scale": "noise", "noise": {"i": 0.05, "w": 0.5}}
    assert motorfit.identify(record, **noise).cost == motorfit.identify(record, scale="noise", noise="i=0.05,w=0.5").cost


def test_figures_are_found_by_index(record):
    found = motorfit.identify(record)
    picture = ET.fromstring(found.plot_response(-1)._repr_svg_())
    assert picture.get("viewBox") == f"0 0 {picture.get('width')} {picture.get('height')}"
    with pytest.raises(IndexError):
        found.plot_response(-2)
    assert "Svg" in repr(found.plot_response())


@pytest.mark.parametrize("lacking", ["speed only", "current as input"])
def test_unidentified_parameters_are_nan(record, lacking):
    """The loop of README runs on every recording: what is not identified is nan, and can be formatted as a number."""
    columns = record.to_columns()
    without = {"speed only": "current_A", "current as input": "voltage_V"}[lacking]
    found = motorfit.identify(motorfit.Record.from_columns({k: v for k, v in columns.items() if k != without}))
    unknown = [name for name, value in found.parameters.items() if math.isnan(value)]
    assert unknown and unknown == [name for name, e in found.to_dict()["parameters"].items() if e["value"] is None]
    for name, value in found.parameters.items():
        assert f"{value:.6g} ± {found.std_errors[name]:.2g}"
        if math.isnan(value):
            assert math.isnan(found.std_errors[name]) and all(map(math.isnan, found.ci95[name]))
    assert math.isnan(found.fit_percent["current"]) and found.fit_percent["speed"] > 90


def test_fixed_parameters_have_no_standard_error(record):
    found = motorfit.identify(record, fix={"R": 0.92})
    assert found.parameters["R"] == 0.92 and math.isnan(found.std_errors["R"])
    assert all(math.isnan(error) for error in motorfit.identify(record, polish="none").std_errors.values())


def test_warnings_are_python_warnings_with_codes(record):
    lacking = motorfit.Record(record.time, voltage=record.voltage, speed=record.speed)
    with pytest.warns(motorfit.MotorfitWarning) as issued:
        found = motorfit.identify(lacking)
    assert [w.message for w in issued] == found.warnings and issued[0].filename == __file__
    assert [w.code for w in found.warnings] == [w["code"] for w in found.to_dict()["warnings"]] and found.warnings
    assert [w.code for w in found.remarks] == [w["code"] for w in found.to_dict()["remarks"]]
    for warning in found.warnings:
        assert warning.code in repr(found) and warning.code in str(warning) and "--" not in warning.message
        assert pickle.loads(pickle.dumps(warning)) == warning
    with warnings.catch_warnings():
        warnings.simplefilter("error", motorfit.MotorfitWarning)
        with pytest.raises(motorfit.MotorfitWarning, match="channel_missing"):
            motorfit.identify(lacking)
        assert "warnings" not in repr(motorfit.identify(record))
