"""Results of a suite are read by the tool of IOHprofiler."""

import csv

import pytest


def test_runs_are_opened_by_iohinspector(program, tmp_path):
    import iohinspector

    out = tmp_path / "suite"
    done = program("compare", "--suite", "motors", "--methods", "de,multistart", "--budgets", "400", "--runs", "3", "--out", out)
    assert done.returncode == 0, done.stderr
    manager = iohinspector.DataManager()
    manager.add_folder(str(out / "ioh"))
    overview = manager.overview
    assert len(overview) == 33 * 2 * 3
    assert set(overview["algorithm_name"]) == {"de", "multistart"}
    assert set(overview["suite"]) == {"motorfit-motors-v1"}
    with open(out / "runs.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    # Each run ends at the gap of the CSV file, and reaches 1e-2 after the same evaluations.
    for name, method in [("m2-step-40db", "multistart"), ("servo-dead-time", "de")]:
        chosen = manager.select(algorithms=[method])
        data = chosen.load(monotonic=True, include_meta_data=True)
        data = data.filter(data["function_name"] == name)
        expected = [row for row in rows if row["problem"] == name and row["method"] == method]
        assert len(expected) == 3
        for number, row in enumerate(expected, 1):
            run = data.filter(data["run_id"] == number)
            assert run["raw_y"].min() == pytest.approx(max(float(row["gap"]), 0.0), rel=1e-12, abs=1e-15)
            hit = run.filter(run["raw_y"] <= 1e-2)["evaluations"]
            assert (hit.min() if len(hit) else None) == (int(row["to_1e-2"]) if row["to_1e-2"] else None)
