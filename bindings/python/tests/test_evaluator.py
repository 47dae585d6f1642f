"""`Evaluator`: every array-like gives the costs of the plain float64 array bit for bit, or raises an error."""

import pickle
import signal
import threading

import numpy as np
import pandas
import polars
import pytest

import motorfit
from conftest import M2, step


@pytest.fixture(scope="module")
def evaluator(record):
    return motorfit.Evaluator(record, device="cpu")


def candidates(n, seed=0):
    """Returns candidates with log-normal deviations of 30 % from the paper's motor, shape (n, 5)."""
    return np.array(list(M2.values())) * np.exp(np.random.default_rng(seed).normal(0, 0.3, (n, 5)))


def test_costs_are_those_of_the_criterion(record, evaluator):
    """Oracle: the nrmse formula in numpy on signals of `simulate`, to a relative 1e-9."""
    assert evaluator.names == ["R", "L", "K", "B", "J"] and evaluator.device[0] == "cpu"
    tried = candidates(5)
    expected = []
    for values in tried:
        model = motorfit.simulate(dict(zip("RLKBJ", values)), record.time, record.voltage)
        errors = [(record.current - model.current) / record.current.std(), (record.speed - model.speed) / record.speed.std()]
        expected.append(np.sqrt(np.mean(np.square(errors)) * 2))
    # nrmse² is (1/N) Σ Σ e² over both channels; the kernels sum in another order.
    np.testing.assert_allclose(evaluator(tried), expected, rtol=1e-9)


def test_bounds_and_settings(record):
    held = motorfit.Evaluator(record, fix={"R": 0.921042}, bounds={"L": (0.001, 0.1)}, criterion="ise", scale="none")
    assert held.names == ["L", "K", "B", "J"] and held.bounds[0] == (0.001, 0.1)
    assert held(np.array(list(M2.values()))[1:]).shape == (1,)
    with pytest.raises(TypeError, match="did you mean criterion"):
        motorfit.Evaluator(record, criterium="ise")


def ways(values):
    """Returns the same numbers in several memory layouts and types."""
    n, p = values.shape
    backwards = np.ascontiguousarray(values[::-1, ::-1])[::-1, ::-1]
    wide = np.zeros((2 * n, 3 * p))
    wide[::2, ::3] = values
    unaligned = np.frombuffer(b"\0" * 3 + values.tobytes(), np.uint8)[3:].view(np.float64).reshape(n, p)
    packed = np.zeros((n, p), np.dtype([("value", "f8"), ("note", "i4")]))
    packed["value"] = values
    frozen = values.copy()
    frozen.flags.writeable = False
    return {
        "C order": values.copy(),
        "Fortran order": np.asfortranarray(values),
        "transposed": np.ascontiguousarray(values.T).T,
        "negative strides": backwards,
        "strides": wide[::2, ::3],
        "not aligned": unaligned,
        "a field of packed records": packed["value"],
        "read-only": frozen,
        "other byte order": values.astype(values.dtype.newbyteorder()),
        "long double": values.astype(np.longdouble),
        "lists": values.tolist(),
        "tuples": tuple(map(tuple, values.tolist())),
        "objects of numpy": [list(row) for row in values],
        "a subclass": values.view(type("Own", (np.ndarray,), {})),
        "a memory view": memoryview(values),
        "masked, nothing masked": np.ma.masked_array(values, mask=False),
        "record of frame": __import__("pandas").DataFrame(values),
    }


@pytest.mark.parametrize("way", list(ways(np.ones((2, 5)))))
@pytest.mark.parametrize("n", [1, 2, 7, 1000, 3000])
def test_however_numbers_come_they_are_the_same(evaluator, way, n):
    values = candidates(n, seed=n)
    given = ways(values)[way]
    if way in ("not aligned", "a field of packed records") and n > 1:
        assert not given.flags.aligned
    before = np.array(given)
    np.testing.assert_array_equal(evaluator(given), evaluator(values))
    np.testing.assert_array_equal(np.array(given), before)


@pytest.mark.parametrize("dtype", ["float16", "float32", "int8", "int64", "uint64"])
def test_other_types_are_their_values(evaluator, dtype):
    values = np.maximum(candidates(20) * 100, 1).astype(dtype)
    np.testing.assert_array_equal(evaluator(values), evaluator(values.astype(np.float64)))


def test_fuzzed_arrays_give_right_numbers_or_an_error(evaluator):
    rng = np.random.default_rng(1)
    plain = {}
    for _ in range(400):
        n = int(rng.integers(1, 40))
        values = plain.setdefault(n, candidates(n, seed=n))
        given = values
        for _ in range(int(rng.integers(1, 4))):
            change = rng.integers(6)
            if change == 0:
                given = np.asfortranarray(given)
            elif change == 1:
                given = np.repeat(given, 2, axis=0)[::2]
            elif change == 2:
                given = np.concatenate([given, given], axis=1)[:, :5]
            elif change == 3:
                given = np.flip(np.flip(given).copy())
            elif change == 4:
                given = given.astype(rng.choice([">f8", "<f8", "longdouble"]))
            else:
                given = np.frombuffer(b"x" * int(rng.integers(1, 8)) + given.astype("f8").tobytes(), np.uint8)
                given = given[len(given) - n * 40 :].view(np.float64).reshape(n, 5)
        np.testing.assert_array_equal(evaluator(given), evaluator(values))


def test_costs_that_are_not_numbers_are_inf(evaluator):
    values = candidates(6)
    good = evaluator(values)
    values[0], values[1], values[2] = np.nan, -np.inf, 0.0
    # Negative viscous friction.
    values[3, 3] = -1.0
    # With an infinite inductance the current is zero: the cost is finite.
    values[4, 1] = np.inf
    costs = evaluator(values)
    assert np.isinf(costs[:4]).all() and np.isfinite(costs[4])
    assert costs[5] == good[5]


@pytest.mark.parametrize(
    ("given", "error"),
    [
        (np.ones((3, 4)), ValueError),
        (np.ones((3, 6)), ValueError),
        (np.ones((2, 3, 5)), ValueError),
        (np.float64(1), ValueError),
        (np.ones((3, 5), complex), TypeError),
        (np.ones((3, 5), bool), TypeError),
        (np.full((3, 5), "1"), TypeError),
        (np.full((3, 5), None), TypeError),
        (np.full((3, 5), "2020-01-01", dtype="datetime64[D]"), TypeError),
        (np.zeros((3, 5), dtype=[("a", "f8")]), TypeError),
        (np.ma.masked_array(np.ones((3, 5)), mask=np.eye(3, 5)), ValueError),
        ([[1.0] * 5, [1.0] * 4], ValueError),
        (object(), TypeError),
        (None, TypeError),
    ],
)
def test_other_objects_than_tables_are_errors(evaluator, given, error):
    with pytest.raises(error):
        evaluator(given)


def test_empty_tables_have_no_costs(evaluator):
    assert evaluator(np.empty((0, 5))).shape == (0,)
    with pytest.raises(ValueError, match="shape"):
        evaluator(np.empty((0,)))


def test_tables_have_the_costs_of_the_kernel(record, evaluator):
    tables = motorfit.Evaluator(record, evaluator="tables")
    assert (tables.evaluator, evaluator.evaluator) == ("tables", "kernel")
    np.testing.assert_allclose(tables(candidates(5000)), evaluator(candidates(5000)), rtol=1e-9)


def test_a_cost_does_not_depend_on_the_table(evaluator):
    """Large tables are evaluated in pieces; the oracle is a small table."""
    values = candidates(300_000)
    costs = evaluator(values)
    picked = np.random.default_rng(2).integers(0, len(values), 50)
    np.testing.assert_array_equal(evaluator(values[picked]), costs[picked])


def test_threads_take_turns(record):
    shared = motorfit.Evaluator(record, device="cpu")
    tables = [candidates(2000, seed=n) for n in range(8)]
    expected = [shared(table) for table in tables]
    found = [None] * 8

    def work(n):
        for _ in range(5):
            found[n] = shared(tables[n])

    threads = [threading.Thread(target=work, args=(n,)) for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for one, other in zip(found, expected):
        np.testing.assert_array_equal(one, other)


def test_several_recordings_are_one_problem():
    records = [step(seed=n) for n in range(3)]
    joint = motorfit.Evaluator(records, device="cpu")
    alone = [motorfit.Evaluator(r, device="cpu")(candidates(4)) for r in records]
    # For recordings of equal length the joint mean square is the mean of theirs, each scaled by its own deviation.
    np.testing.assert_allclose(joint(candidates(4)), np.sqrt(np.mean(np.square(alone), axis=0)), rtol=1e-3)


@pytest.mark.parametrize("threads", [1, 2])
def test_threads_change_no_bit(record, threads):
    limited = motorfit.Evaluator(record, device="cpu", threads=threads)
    np.testing.assert_array_equal(limited(candidates(500)), motorfit.Evaluator(record, device="cpu")(candidates(500)))


def test_columns_of_frames_go_by_their_names(evaluator):
    values = candidates(9)
    frame = pandas.DataFrame(values, columns=evaluator.names)
    mixed = frame[list(reversed(evaluator.names))].assign(note="x")
    for given in (frame, mixed, frame.astype("Float64"), polars.DataFrame(frame.to_dict("list")), polars.DataFrame(values)):
        np.testing.assert_array_equal(evaluator(given), evaluator(values))
    with pytest.raises(ValueError, match="lack the column J"):
        evaluator(frame.drop(columns="J"))


def test_names_have_the_index_of_the_recording(record):
    other = step(seed=2)
    several = motorfit.Evaluator([record, other], per_recording="R")
    assert several.names == ["R[0]", "R[1]", "L", "K", "B", "J"]
    assert several.names == motorfit.identify([record, other], per_recording="R").free
    with pytest.raises(motorfit.DataError, match="the same recording"):
        motorfit.identify([record, record])


def test_an_evaluator_pickles(record):
    made = motorfit.Evaluator([record, record], criterion="iae", fix={"K": 0.07}, bounds={"R": [0.5, 2]}, threads=1)
    again = pickle.loads(pickle.dumps(made))
    assert again.names == made.names and again.bounds == made.bounds
    np.testing.assert_array_equal(again(candidates(5)[:, [0, 1, 3, 4]]), made(candidates(5)[:, [0, 1, 3, 4]]))


def test_nested_calls_work_or_raise(evaluator):
    expected = evaluator(candidates(3))

    class Given:
        def __array__(self, *args, **kwargs):
            np.testing.assert_array_equal(evaluator(candidates(3)), expected)
            return candidates(3)

    np.testing.assert_array_equal(evaluator(Given()), expected)
    seen = []

    def handler(*_):
        try:
            evaluator(candidates(3))
        except RuntimeError as error:
            seen.append(str(error))

    before = signal.signal(signal.SIGALRM, handler)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.1, 0.1)
        evaluator(np.repeat(candidates(1), 2_000_000, axis=0))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    assert seen and "within one of its own calls" in seen[0]
    np.testing.assert_array_equal(evaluator(candidates(3)), expected)
