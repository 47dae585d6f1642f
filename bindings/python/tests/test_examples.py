"""Every example runs and has correct types, and the estimates of those that search are near the true parameters."""

import importlib.util
import os
import re
import subprocess
import sys

import pytest

from conftest import M2, ROOT

EXAMPLES = sorted((ROOT / "bindings" / "python" / "examples").glob("*.py"))
NEEDS = {"scipy": "scipy", "pymoo": "pymoo", "mealpy": "mealpy", "pandas": "pandas", "matplotlib": "matplotlib", "tqdm": "tqdm"}
#: Largest relative error of the parameters; the searches reach these with their budgets over the seeds tried.
WITHIN = {"identify": 0.01, "scipy_differential_evolution": 0.01, "pymoo_search": 0.3, "mealpy_gwo": 0.3,
          "tqdm_progress": 0.01}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_it_runs(path, tmp_path):
    needed = NEEDS.get(path.stem.split("_")[0])
    if needed and importlib.util.find_spec(needed) is None:
        if os.environ.get("MOTORFIT_NO_SKIP"):
            pytest.fail(f"{needed} is not installed")
        pytest.skip(f"{needed} is not installed")
    # A copy writes to a folder that does not exist yet, which the example creates.
    copy = tmp_path / path.name
    copy.write_text(path.read_text().replace("/tmp/motorfit", str(tmp_path / "out")))
    done = subprocess.run([sys.executable, copy], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out").exists() == ("/tmp/motorfit" in path.read_text())
    found = {name: float(value) for name, value in re.findall(r"^([RLKBJ]) = (\S+)", done.stdout, re.MULTILINE)}
    if path.stem in WITHIN:
        assert set(found) == set(M2)
        for name, value in found.items():
            assert abs(value / M2[name] - 1) < WITHIN[path.stem], done.stdout
    if path.stem == "tqdm_progress":
        assert "300/300" in done.stderr and "cost=" in done.stderr


def test_types_of_the_examples_are_correct():
    """mypy in strict mode: keywords, literal values and results have types. Libraries without types are imported as Any."""
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", ROOT / "bindings/python/pyproject.toml", *EXAMPLES]
    # Modules of one name, `__main__`, would conflict in one run without this.
    done = subprocess.run([*command, "--scripts-are-modules"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ('motorfit.identify("a.csv", method="simplex")', "arg-type"),
        ('motorfit.identify("a.csv", metod="gwo")', "call-arg"),
        ("motorfit.identify(3)", "arg-type"),
        ('motorfit.read("a.csv", gaps="ignore")', "arg-type"),
        ('motorfit.identify("a.csv").parameters["R"].upper()', "attr-defined"),
    ],
)
def test_mypy_reports_wrong_calls(tmp_path, line, error):
    path = tmp_path / "wrong.py"
    path.write_text(f"import motorfit\n\n{line}\n")
    done = subprocess.run([sys.executable, "-m", "mypy", "--strict", path], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and f"[{error}]" in done.stdout, done.stdout
