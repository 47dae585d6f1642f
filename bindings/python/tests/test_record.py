"""`Record` and `read`: files, arrays and frames give the same samples bit for bit; pickling; errors for wrong input."""

import errno
import io
import math
import pickle
import sys

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
    # Python parses the numbers, because the parser of pandas may be off by one ulp.
    frame = pandas.read_csv(EXAMPLE, comment="#", dtype=str).astype(float)
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
    assert math.isnan(found.parameters["R"])


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
def test_invalid_signals_are_errors(signals, error):
    with pytest.raises(error):
        motorfit.Record([0.0, 0.1, 0.2], **signals)


def test_errors_have_place_and_remedy(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.1,1,x,0\n")
    with pytest.raises(motorfit.DataError) as caught:
        motorfit.Record.from_file(path)
    assert "bad.csv" in caught.value.message and "3" in caught.value.message and caught.value.remedy
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value) and isinstance(again, ValueError)
    for kind in (motorfit.DataError, FileNotFoundError, motorfit.MissingFileError):
        with pytest.raises(kind) as caught:
            motorfit.Record.from_file(tmp_path / "none.csv")
        again = pickle.loads(pickle.dumps(caught.value))
        assert str(again) == str(caught.value) and again.filename == str(tmp_path / "none.csv") and again.errno == errno.ENOENT
    with pytest.raises(TypeError, match="did you mean columns"):
        motorfit.read(path, colums="time=t")


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
@pytest.mark.parametrize("start", [None, "2026-01-01T12:00"])
def test_timestamps_are_rejected_with_advice(record, unit, start):
    elapsed = np.round(record.time * 1e3).astype("timedelta64[ms]").astype(f"timedelta64[{unit}]")
    times = elapsed if start is None else np.datetime64(start) + elapsed
    columns = {**record.to_columns(), "time_s": times}
    for frame in (columns, pandas.DataFrame(columns)):
        with pytest.raises(motorfit.DataError) as raised:
            motorfit.Record.from_columns(frame)
        assert 'numpy.timedelta64(1, "s")' in raised.value.remedy
    columns["time_s"] = (times - times[0]) / np.timedelta64(1, "s")
    np.testing.assert_allclose(motorfit.Record.from_columns(columns).time, record.time, atol=1e-12)
    # An additional column of this type is ignored.
    beside = motorfit.Record.from_columns({"when": times, **record.to_columns()})
    assert beside.to_csv() == record.to_csv()


def test_text_in_frames_is_ignored(record):
    count = len(record)
    notes = {"note": ["# start"] * 50 + ["% so\nor so"] * (count - 50), "# of\ntry": ["a, b"] * count}
    assert motorfit.Record.from_columns({**notes, **record.to_columns()}).to_csv() == record.to_csv()
    headed = {f"# {name}\n" if name == "time_s" else name: values for name, values in record.to_columns().items()}
    assert motorfit.Record.from_columns(headed).to_csv() == record.to_csv()


def test_frames_take_the_options_of_files(record, tmp_path):
    path = tmp_path / "r.csv"
    path.write_text(record.to_csv())
    options = {"crop": "0.05:0.8", "decimate": 2, "columns": {"time": "time_s", "current": "current_A"}}
    of_file = motorfit.Record.from_file(path, **options)
    of_frame = motorfit.Record.from_columns(record.to_columns(), **options)
    assert of_frame.to_csv() == of_file.to_csv() and len(of_frame) < len(record) / 2
    columns = np.rec.fromarrays(list(record.to_columns().values()), names=list(record.to_columns()))
    assert motorfit.Record.from_columns(columns).to_csv() == record.to_csv()
    gap = {name: np.delete(values, slice(300, 500)) for name, values in record.to_columns().items()}
    with pytest.raises(motorfit.DataError, match="gap|step"):
        motorfit.Record.from_columns(gap)
    assert len(motorfit.Record.from_columns(gap, gaps="keep")) == len(record) - 200
    with pytest.raises(motorfit.DataError, match="2 recordings"):
        motorfit.Record.from_columns(gap, gaps="split")


@pytest.mark.parametrize("rate", [0, -1, float("nan"), float("inf")])
def test_a_rate_is_positive(record, rate):
    with pytest.raises(motorfit.UsageError, match="rate"):
        motorfit.Record.from_columns(record.to_columns(), rate=rate)


def test_other_objects_than_frames_are_rejected(record):
    frame = pandas.DataFrame(record.to_columns())
    for wrong in (frame["time_s"], record.time, 3, None, "text"):
        with pytest.raises(TypeError, match="mapping of columns or a frame"):
            motorfit.Record.from_columns(wrong)
    with pytest.raises(ValueError, match="speed_rad_s"):
        motorfit.Record.from_columns({**record.to_columns(), "speed_rad_s": np.ones((len(record), 2))})
    with pytest.raises(ValueError, match="masked"):
        masked = np.ma.masked_array(record.speed, mask=record.time > 0.5)
        motorfit.Record.from_columns({**record.to_columns(), "speed_rad_s": masked})
    with pytest.raises(motorfit.DataError) as raised:
        motorfit.Record.from_columns(frame.set_index("time_s"))
    assert "reset_index" in raised.value.remedy
    wrong = {**record.to_columns(), "current_A": ["?" if n == 7 else "1" for n in range(len(record))]}
    with pytest.raises(motorfit.DataError, match="row 7"):
        motorfit.Record.from_columns(wrong)


def test_signals_are_read_only(record):
    for signal in ("time", "voltage", "current", "speed"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(record, signal)[0] = 1.0
    record.to_columns()["current_A"][0] = 1.0


@pytest.mark.parametrize("source", ["path", "pathlib", "bytes", "text", "pandas", "polars", "mapping", "structured array"])
def test_everything_that_holds_a_recording_is_taken(tmp_path, record, source):
    path = tmp_path / "log.csv"
    path.write_text(record.to_csv())
    columns = record.to_columns()
    given = {
        "path": lambda: str(path),
        "pathlib": lambda: path,
        "bytes": lambda: io.BytesIO(path.read_bytes()),
        "text": lambda: open(path, encoding="utf-8"),
        "pandas": lambda: pandas.DataFrame(columns),
        "polars": lambda: polars.DataFrame(columns),
        "mapping": lambda: columns,
        "structured array": lambda: np.rec.fromarrays(list(columns.values()), names=list(columns)),
    }[source]
    expected = motorfit.steiglitz_mcbride(record)
    assert motorfit.steiglitz_mcbride(given()) == expected
    assert motorfit.steiglitz_mcbride([given()]) == expected
    other = step(seed=7)
    found = motorfit.identify([given(), other])
    assert [r.to_csv() for r in found.records] == [record.to_csv(), other.to_csv()]
    assert motorfit.identify(other, validate=given()).validation["records"]
    # An evaluator of an open file is pickled with its recording.
    again = pickle.loads(pickle.dumps(motorfit.Evaluator(given(), bounds="table2")))
    assert np.isfinite(again([[0.92, 0.0078, 0.073, 0.00068, 0.00014]])).all()
    if source in ("bytes", "text"):
        cropped = motorfit.Record.from_file(given(), crop="0.1:0.5")
        assert cropped.to_csv() == motorfit.Record.from_columns(columns, crop="0.1:0.5").to_csv()
        assert len(motorfit.read(given())) == 1


def test_errors_of_open_files_have_their_place(tmp_path):
    path = tmp_path / "bad.csv"
    path.write_text("time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.1,1,x,0\n")
    with open(path, "rb") as file, pytest.raises(motorfit.DataError, match="bad.csv.*line 3") as raised:
        motorfit.identify(file)
    assert not isinstance(raised.value, FileNotFoundError)

    class Odd:
        def read(self):
            return 3

    with pytest.raises(TypeError, match="neither bytes nor text"):
        motorfit.read(Odd())
    with pytest.raises(FileNotFoundError, match="none.csv"):
        motorfit.identify([path.with_name("none.csv")])


@pytest.mark.parametrize("work", [motorfit.identify, motorfit.steiglitz_mcbride, motorfit.Evaluator])
def test_other_objects_than_recordings_are_rejected_with_advice(record, work):
    for given in (lambda wrong: wrong, lambda wrong: [record, wrong]):
        with pytest.raises(TypeError, match="give a Record.*collect"):
            work(given(polars.DataFrame(record.to_columns()).lazy()))
        for wrong in ([], 3, [3], None, record.time):
            with pytest.raises(TypeError, match="give a Record"):
                work(given(wrong))
    with pytest.raises(TypeError, match="not a Series"):
        work(pandas.DataFrame(record.to_columns())["time_s"])
    with pytest.raises(TypeError, match="from_columns"):
        motorfit.read(record.to_columns())


def test_recordings_are_sliced_by_samples(record):
    part = record[100:500]
    assert len(part) == 400 and part.notes == [*record.notes, "the samples 100..500"]
    for signal in ("time", "voltage", "current", "speed"):
        np.testing.assert_array_equal(getattr(part, signal), getattr(record, signal)[100:500])
    assert record[:].to_csv() == record.to_csv() and record[-10:].to_csv() == record[len(record) - 10 :].to_csv()
    first, rest = record.split(0.7)
    assert record[: len(first)].to_csv() == first.to_csv() and record[len(first) :].to_csv() == rest.to_csv()
    for wrong in (slice(5, 5), slice(5, 6), slice(9, 3), slice(10**9, None)):
        with pytest.raises(motorfit.UsageError, match="not a recording"):
            record[wrong]
    with pytest.raises(motorfit.UsageError, match="step"):
        record[::2]
    for wrong in (3, "time", (1, 2), slice(0.5, 1)):
        with pytest.raises(TypeError):
            record[wrong]
    with pytest.raises(TypeError):
        iter(record).__next__()


def test_records_are_shown_and_become_frames(record):
    figure = record.plot()
    assert all(name in str(figure) for name in ("voltage [V]", "current [A]", "speed [rad/s]"))
    frame = record.to_frame()
    assert isinstance(frame, pandas.DataFrame) and list(frame) == list(record.to_columns())
    assert motorfit.Record.from_columns(record.to_frame("polars")).to_csv() == record.to_csv()
    with pytest.raises(ValueError, match="numpy.*pandas"):
        record.to_frame("numpy")


@pytest.mark.parametrize("installed", [[], ["polars"]])
def test_frames_need_one_of_the_libraries(record, monkeypatch, installed):
    for name in {"pandas", "polars"} - set(installed):
        monkeypatch.setitem(sys.modules, name, None)
    if installed:
        assert isinstance(record.to_frame(), polars.DataFrame)
    else:
        with pytest.raises(ImportError, match="pip install pandas"):
            record.to_frame()


def test_decimation_is_one_or_more(record):
    with pytest.raises(motorfit.UsageError, match="^decimate is 0"):
        motorfit.Record.from_columns(record.to_columns(), decimate=0)
    with pytest.raises(motorfit.UsageError, match="^decimate is 0"):
        motorfit.read(EXAMPLE, decimate=0)
