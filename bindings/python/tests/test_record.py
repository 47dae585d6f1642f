"""Recordings: from files, arrays, frames; their way through pickle; what is refused."""

import pickle

import numpy as np
import pandas
import polars
import pytest

import motorfit
from conftest import ROOT, step

EXAMPLE = ROOT / "examples" / "m2-step.csv"


def test_a_file_and_its_columns_are_one_recording():
    of_file = motorfit.Record.from_file(EXAMPLE)
    assert len(of_file) == len(of_file.time) == len(of_file.speed) > 1000
    assert of_file.path == EXAMPLE and len(of_file.sha256) == 64
    # Else pandas is off by an ulp.
    frame = pandas.read_csv(EXAMPLE, comment="#", float_precision="round_trip")
    again = motorfit.Record.from_columns(frame)
    for signal in ("time", "voltage", "current", "speed"):
        np.testing.assert_array_equal(getattr(of_file, signal), getattr(again, signal))
    mapping = {name: frame[name].to_numpy() for name in frame.columns}
    assert motorfit.Record.from_columns(mapping) == again


def test_columns_go_out_and_come_back_to_the_last_bit(record):
    assert motorfit.Record.from_columns(pandas.DataFrame(record.to_columns())).to_csv() == record.to_csv()
    np.testing.assert_array_equal(motorfit.Record.from_columns(record.to_columns()).speed, record.speed)


def test_a_polars_frame_is_a_recording(record):
    frame = polars.DataFrame(record.to_columns())
    assert motorfit.Record.from_columns(frame).to_csv() == record.to_csv()
    part = frame.slice(100, 500).rechunk()
    np.testing.assert_array_equal(motorfit.Record.from_columns(part).speed, record.speed[100:600])
    several = polars.concat([frame[:300], frame[300:]], rechunk=False)
    assert motorfit.Record.from_columns(several).to_csv() == record.to_csv()
    single = frame.with_columns(polars.col("current_A").cast(polars.Float32))
    np.testing.assert_array_equal(motorfit.Record.from_columns(single).current, record.current.astype("f4").astype("f8"))
    found = motorfit.identify(motorfit.Record.from_columns(frame))
    table = polars.DataFrame({"name": list(found.parameters), "value": list(found.parameters.values())})
    assert table["name"].to_list() == ["R", "L", "K", "B", "J"] and table["value"].is_finite().all()
    missing = frame.with_columns(polars.when(polars.int_range(polars.len()) != 7).then("speed_rad_s").alias("speed_rad_s"))
    with pytest.raises(motorfit.DataError, match="speed"):
        motorfit.Record.from_columns(missing)


def test_headings_name_quantity_and_unit(record):
    frame = {
        "t [ms]": record.time * 1e3,
        "Voltage": record.voltage,
        "Current (mA)": record.current * 1e3,
        "speed_rpm": record.speed * 30 / np.pi,
        "note": ["ok"] * len(record),
    }
    read = motorfit.Record.from_columns(frame)
    np.testing.assert_allclose(read.time, record.time, rtol=1e-12)
    np.testing.assert_allclose(read.current, record.current, rtol=1e-12)
    np.testing.assert_allclose(read.speed, record.speed, rtol=1e-12)
    odd = {"a": record.time, "b": record.voltage, "c": record.current}
    named = motorfit.Record.from_columns(odd, columns="time=a:s,voltage=b:V,current=c:A")
    np.testing.assert_array_equal(named.current, record.current)


@pytest.mark.parametrize("kind", ["file", "arrays", "prepared", "current as input"])
def test_it_pickles(kind):
    made = {
        "file": lambda: motorfit.Record.from_file(EXAMPLE),
        "arrays": lambda: step(seed=2),
        "prepared": lambda: motorfit.read(EXAMPLE, filter="butterworth:100", mask="0.2:0.3", rate=500.0)[0],
        "current as input": lambda: motorfit.Record(step().time, current=step().current, speed=step().speed),
    }[kind]()
    back = pickle.loads(pickle.dumps(made))
    assert back == made and repr(back) == repr(made)
    # Equal recordings give equal results.
    assert made.to_csv() == back.to_csv()


def test_bytes_of_something_else_are_refused():
    with pytest.raises(motorfit.DataError):
        motorfit.Record._restore(b"something else")


def test_a_recording_without_a_voltage_has_the_current_as_input(record):
    by_current = motorfit.Record(record.time, current=record.current, speed=record.speed)
    assert by_current.voltage is None
    found = motorfit.identify(by_current, fix={"K": 0.073472})
    assert found.parameters["J"] == pytest.approx(0.000136, rel=0.02)
    assert found.parameters["R"] is None


@pytest.mark.parametrize(
    ("signals", "error"),
    [
        ({"voltage": [0.0, 1.0], "current": [0.0, 1.0, 2.0]}, motorfit.DataError),
        ({"voltage": [0.0, np.nan, 1.0], "current": [0.0, 1.0, 2.0]}, motorfit.DataError),
        ({"voltage": [0.0, 1.0, 1.0]}, motorfit.DataError),
        ({"voltage": np.zeros((3, 1)), "current": [0.0, 1.0, 2.0]}, ValueError),
        ({"voltage": ["a", "b", "c"], "current": [0.0, 1.0, 2.0]}, TypeError),
        ({"voltage": np.zeros(3, complex), "current": [0.0, 1.0, 2.0]}, TypeError),
    ],
)
def test_what_is_no_recording_is_refused(signals, error):
    with pytest.raises(error):
        motorfit.Record([0.0, 0.1, 0.2], **signals)


def test_errors_say_where_and_what_to_do(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.1,1,x,0\n")
    with pytest.raises(motorfit.DataError) as caught:
        motorfit.Record.from_file(path)
    assert "bad.csv" in caught.value.message and "3" in caught.value.message and caught.value.remedy
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and isinstance(again, ValueError)
    with pytest.raises(motorfit.DataError):
        motorfit.Record.from_file(tmp_path / "none.csv")
    with pytest.raises(TypeError, match="did you mean columns"):
        motorfit.read(path, colums="time=t")
