"""`sweep` and `Sweep`: the results file equals that of the command line program byte for byte; interruptions, shards elsewhere."""

import json
import pathlib
import pickle
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import motorfit
from conftest import step

STUDY = """
recordings = ["line/*.csv", "lost.csv"]
methods = ["sm", "gwo"]
polish = ["lm", "none"]
population = [20]
generations = [20]
seeds = "1..3"
noise = ["none", "40dB"]
"""


def write_study(folder, text=STUDY, motors=3):
    """Writes a study and its recordings, of which one is not a valid recording; returns the path of the study."""
    (folder / "line").mkdir(parents=True)
    for n in range(motors):
        (folder / "line" / f"{n}.csv").write_text(step(seed=n).to_csv())
    (folder / "lost.csv").write_text("time_s,voltage_V,current_A,speed_rad_s\n0,0,0,0\n0.1,x,1,0\n")
    path = folder / "study.toml"
    path.write_text(text)
    return path


def test_limits_of_the_study_apply_unless_others_are_given(tmp_path):
    text = 'recordings = ["line/*.csv"]\nmethods = ["sm"]\npolish = ["lm"]\nlimits = {R = [0.9, 0.95]}\n'
    study = write_study(tmp_path, text, motors=2)
    assert motorfit.sweep(study, tmp_path / "out")["limits"] == {"R": [0.9, 0.95]}
    other = motorfit.sweep(study, tmp_path / "out", limits={"R": (2.0, 3.0)})
    assert other["limits"] == {"R": [2.0, 3.0]} and len(other["outside"]) == 2


def ids(folder, name="results-*.jsonl"):
    """Returns the sorted numbers of the runs in results files, without failures that are tried again."""
    lines = [line for path in folder.glob(name) for line in path.read_text().splitlines()]
    rows = [json.loads(line) for line in lines]
    return sorted(row["id"] for row in rows if "id" in row and (row["error"] or {}).get("kind") != "data")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    return write_study(tmp_path_factory.mktemp("study"))


@pytest.fixture(scope="module")
def expected(program, study, tmp_path_factory):
    """Returns the results file of the command line program."""
    out = tmp_path_factory.mktemp("expected") / "out"
    program("sweep", study, "--out", out, "--no-progress")
    return (out / "results.jsonl").read_bytes()


def test_the_bytes_are_those_of_the_command_line(study, expected, tmp_path):
    seen = []
    found = motorfit.sweep(study, tmp_path / "out", threads=2, progress=seen.append)
    assert found["results"].read_bytes() == expected
    assert (found["runs"], found["missing"], found["motors"]["count"]) == (96, 0, 4)
    # Only the invalid recording fails, with its file and line.
    assert found["failed"] == 24 and "lost.csv, line 3" in found["failures"][0]["message"]
    # Every other run has a level of trust.
    assert sum(found["trust"][level] for level in ("good", "check", "poor")) == 72
    assert seen[-1].done == seen[-1].total == 96 and seen[-1].failed == 24 and seen[-1].seconds > 0
    again = motorfit.sweep(study, tmp_path / "out", limits={"R": (0.9, 0.95)})
    assert again["results"].read_bytes() == expected and again["limits"] == {"R": [0.9, 0.95]}


def test_documents_are_those_of_the_command_line(program, study, tmp_path):
    out = tmp_path / "out"
    plan = motorfit.Sweep.plan(study, out)
    assert (plan.runs, plan.motors) == (96, ["0", "1", "2", "lost"])
    tally = plan.run(shard=(2, 3))
    printed = json.loads(program("sweep", "run", out, "--shard", "2/3", "--json", "--no-progress").stdout)
    assert set(tally) == set(printed) and tally["runs"] == printed["runs"] == 32
    assert tally["finished"] == 32 and tally["stop"] == "done"
    assert plan.status() == json.loads(program("sweep", "status", out, "--json").stdout)
    merged = plan.merge()
    assert merged.pop("results") == out / "results.jsonl"
    assert merged == json.loads(program("sweep", "merge", out, "--json").stdout)
    assert motorfit.Sweep.open(out).digest == plan.digest


def test_shards_can_be_run_elsewhere(study, expected, tmp_path):
    """A folder with the manifest, the recordings of a shard and its finished runs is enough to run the shard elsewhere."""
    here = motorfit.Sweep.plan(study, tmp_path / "here")
    here.run(shard=(3, 4))
    left = here.left(5)
    assert sum(left) == 72 + 6
    for index in range(1, 6):
        there = tmp_path / f"there-{index}"
        there.mkdir()
        (there / "manifest.json").write_bytes((here.folder / "manifest.json").read_bytes())
        finished = here.finished((index, 5))
        for name, lines in finished.items():
            (there / name).write_bytes(lines)
        moved = tmp_path / f"moved-{index}"
        for path in here.recordings((index, 5)):
            (moved / path).parent.mkdir(parents=True, exist_ok=True)
            (moved / path).write_bytes((here.origin / path).read_bytes())
        tally = motorfit.Sweep.open(there).run(shard=(index, 5), recordings=moved)
        assert tally["finished"] == left[index - 1]
        back = (there / f"results-{index}-of-5.jsonl").read_bytes()
        assert here.take((index, 5), back) == left[index - 1]
        # A second import adds only the failures, which are repeated in every run.
        assert here.take((index, 5), back) == tally["failed"]
    assert here.merge()["results"].read_bytes() == expected
    assert ids(here.folder) == [n for n in range(96) if n < 72]


def test_a_shard_reads_only_its_recordings(tmp_path):
    study = write_study(tmp_path / "study", 'recordings = "line/*.csv"\nmethods = "sm"', motors=17)
    plan = motorfit.Sweep.plan(study, tmp_path / "out")
    assert plan.recordings((2, 2)) == [f"line/{name}.csv" for name in sorted(map(str, range(17)))[1::2]]
    assert len(plan.recordings((3, 5))) == 3 and plan.left(5) == [4, 4, 3, 3, 3]


def test_foreign_or_damaged_results_are_rejected(study, tmp_path):
    plan = motorfit.Sweep.plan(study, tmp_path / "out")
    plan.run(shard=(1, 2))
    results = (plan.folder / "results-1-of-2.jsonl").read_bytes()
    other = motorfit.Sweep.plan(study, tmp_path / "other")
    for damaged in (b"", b"{}\n", results[:-1], results.replace(b'"seed":2', b'"seed":3')):
        with pytest.raises(motorfit.DataError):
            other.take((1, 2), damaged)
    with pytest.raises(motorfit.DataError, match="another study or shard"):
        other.take((2, 2), results)
    assert ids(other.folder) == [] and other.take((1, 2), results) == 48
    for shard in ((0, 1), (3, 2), (1, 0)):
        with pytest.raises(motorfit.UsageError, match="shard"):
            plan.run(shard=shard)
    with pytest.raises(motorfit.UsageError, match="threads"):
        plan.run(threads=0)


def test_an_interrupted_sweep_is_resumed(study, expected, tmp_path):
    out = tmp_path / "out"
    partly = motorfit.sweep(study, out, progress=lambda p: False)
    assert 0 < partly["missing"] < 96

    def failing(_):
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        motorfit.sweep(study, out, progress=failing)
    assert motorfit.sweep(study, out)["results"].read_bytes() == expected
    assert len(ids(out)) == len(set(ids(out))) == 72


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
def test_ctrl_c_keeps_finished_runs(tmp_path):
    study = write_study(tmp_path / "study", 'recordings = "line/*.csv"\nmethods = "gwo"\nseeds = "1..100000"', 1)
    out = tmp_path / "out"
    program = (
        "import motorfit\n"
        "tell = lambda p: print(p.done, flush=True) if p.done else None\n"
        f"try:\n    motorfit.sweep({str(study)!r}, {str(out)!r}, progress=tell)\n"
        "except KeyboardInterrupt:\n    print('interrupted')\n"
    )
    command = [sys.executable, "-c", program]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=pathlib.Path.home())
    first = int(child.stdout.readline())
    child.send_signal(signal.SIGINT)
    begun = time.monotonic()
    assert child.communicate(timeout=60)[0].endswith("interrupted\n") and time.monotonic() - begun < 10
    kept = ids(out)
    assert len(kept) == len(set(kept)) >= first > 0
    assert motorfit.Sweep.open(out).status()["done"] == len(kept)


def test_faults_are_exceptions(tmp_path):
    with pytest.raises(motorfit.DataError):
        motorfit.sweep(tmp_path / "none.toml", tmp_path / "out")
    (tmp_path / "odd.toml").write_text('recordings = ["*.csv"]\nmethod = "sm"')
    with pytest.raises(motorfit.UsageError, match="line 2: unknown key"):
        motorfit.sweep(tmp_path / "odd.toml")
    with pytest.raises(motorfit.UsageError, match="limits"):
        motorfit.sweep(tmp_path / "none.toml", limits={"R": (2, 1)})
    with pytest.raises(motorfit.DataError, match="no sweep"):
        motorfit.Sweep.open(tmp_path)


def test_threads_that_merge_at_once_do_not_get_in_each_others_way(study, expected, tmp_path):
    motorfit.sweep(study, tmp_path / "out")
    with ThreadPoolExecutor(8) as pool:
        merged = list(pool.map(lambda _: motorfit.Sweep.open(tmp_path / "out").merge()["results"], range(64)))
    assert {path.read_bytes() for path in merged} == {expected}
    assert not [path for path in (tmp_path / "out").iterdir() if path.name.startswith(".")]


def test_the_summary_is_a_dict_that_notebooks_show(study, tmp_path):
    """The document is that of the command line (see above); the same tables are shown as text and as HTML."""
    found = motorfit.sweep(study, tmp_path / "out")
    assert isinstance(found, motorfit.SweepSummary) and isinstance(found, dict)
    text = " ".join(ET.fromstring(found._repr_html_()).itertext())
    for shown in (text, found.summary()):
        assert "motors identified" in " ".join(shown.split()) and "Cost (" in shown
    assert "<svg" in found._repr_html_()
    again = pickle.loads(pickle.dumps(found))
    assert again == found and again._repr_html_() == found._repr_html_()
    columns = found.to_columns()
    has_result = np.array(columns["error"]) == ""
    assert columns["motor"] == ["0", "1", "2", "lost"] and has_result.tolist() == [True, True, True, False]
    assert has_result.sum() == found["motors"]["identified"] and (np.isfinite(columns["R"]) == has_result).all()
    assert "lost.csv" in columns["error"][3] and columns["trust"][3] == ""
    assert list(found.to_frame().columns) == list(columns) and len(again.to_frame()) == len(columns["motor"])
    plan = motorfit.Sweep.open(tmp_path / "out")
    assert f"{plan.runs} runs finished" in " ".join(ET.fromstring(plan._repr_html_()).itertext())
