"""Pickled results: every attribute equals that of the original, bit for bit."""

import copy
import pickle

import numpy as np
import pytest

import motorfit
from conftest import M2, answers, same, step


def results():
    record = step()
    other = step(seed=2, duration=0.8)
    speed = motorfit.Record.from_columns({"time_s": record.time, "voltage_V": record.voltage, "speed_rad_s": record.speed})
    columns = record.to_columns()
    current = motorfit.Record.from_columns({name: columns[name] for name in ("time_s", "current_A", "speed_rad_s")})
    return {
        "step": motorfit.identify(record),
        "search without polish": motorfit.identify(record, method="gwo", polish="none", generations=5, population=10),
        "joint": motorfit.identify([record, other], per_recording="R", fix={"K": M2["K"]}),
        "not told": motorfit.identify(speed),
        "held out": motorfit.identify(record, validate=other),
        "compared": motorfit.compare(runs=3, generations=4, population=8, criteria="nrmse:std,iae:peak"),
        "nothing known": motorfit.compare(record, methods="gwo", runs=2, generations=3, population=8),
        "drawing": motorfit.identify(record).plot_correlation(),
        "interrupted": motorfit.identify(record, method="gwo", progress=lambda p: p.generation < 3),
        "by the current": motorfit.identify(current, fix={"K": M2["K"]}),
    }


RESULTS = results()


@pytest.mark.parametrize("kind", RESULTS)
@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_results_answer_the_same(kind, protocol):
    made = RESULTS[kind]
    again = pickle.loads(pickle.dumps(made, protocol))
    assert type(again) is type(made) and again is not made
    same(answers(made), answers(again))
    same(answers(made), answers(pickle.loads(pickle.dumps(again, protocol))))


def test_every_answer_is_compared():
    assert {"parameters", "covariance", "history", "modelled", "plot_response", "to_dict", "_repr_html_"} <= set(answers(RESULTS["step"]))
    assert {"blocks", "expected", "to_json"} <= set(answers(RESULTS["compared"]))
    assert {"costs", "histories", "plot_waterfall"} <= set(answers(RESULTS["compared"].blocks[0]))


def test_unpickled_values_cannot_be_changed():
    again = pickle.loads(pickle.dumps(RESULTS["step"]))
    again.parameters["R"] = 0.0
    again.covariance[:] = 0.0
    again.modelled()[0]["current_A"][:] = 0.0
    same(answers(RESULTS["step"]), answers(again))


@pytest.mark.parametrize("kind", RESULTS)
def test_immutable_objects_are_their_own_copy(kind):
    for thing in (RESULTS[kind], pickle.loads(pickle.dumps(RESULTS[kind])), step()):
        assert copy.copy(thing) is thing and copy.deepcopy([thing])[0] is thing


@pytest.mark.parametrize("recording", [1, -2, 2**62, -(2**63)])
def test_a_wrong_index_is_an_error(recording):
    for made in (RESULTS["step"], pickle.loads(pickle.dumps(RESULTS["step"]))):
        with pytest.raises(IndexError, match="there are 1 recordings"):
            made.plot_response(recording)


@pytest.mark.parametrize("made, name", [(RESULTS["step"], "cost"), (RESULTS["compared"], "blocks"), (RESULTS["compared"].blocks[0], "costs")])
def test_a_pickle_of_another_version_is_an_error(made, name):
    restore, (state,) = made.__reduce__()
    del state[name]
    with pytest.raises(ValueError, match=f"another version of motorfit .* lacks {name}"):
        restore(state)
