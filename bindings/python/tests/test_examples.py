"""Every example runs, and the estimates of those that search are near the true parameters."""

import importlib.util
import os
import pathlib
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
def test_it_runs(path):
    needed = NEEDS.get(path.stem.split("_")[0])
    if needed and importlib.util.find_spec(needed) is None:
        if os.environ.get("MOTORFIT_NO_SKIP"):
            pytest.fail(f"{needed} is not installed")
        pytest.skip(f"{needed} is not installed")
    pathlib.Path("/tmp/motorfit").mkdir(exist_ok=True)
    done = subprocess.run([sys.executable, path], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = {name: float(value) for name, value in re.findall(r"^([RLKBJ]) = (\S+)", done.stdout, re.MULTILINE)}
    if path.stem in WITHIN:
        assert set(found) == set(M2)
        for name, value in found.items():
            assert abs(value / M2[name] - 1) < WITHIN[path.stem], done.stdout
    if path.stem == "tqdm_progress":
        assert "300/300" in done.stderr and "cost=" in done.stderr
