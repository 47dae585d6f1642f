"""The package: stubs and docstrings agree with the compiled module; devices and version with the command line program."""

import ast
import importlib.resources
import inspect
import json
import re
import subprocess
import sys

import pytest

import motorfit
from conftest import ROOT
from motorfit import _motorfit


def test_stubs_name_every_public_item():
    tree = ast.parse(importlib.resources.files("motorfit").joinpath("_motorfit.pyi").read_text())
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    public = {name for name in dir(_motorfit) if not name.startswith("_")}
    assert functions <= public <= functions | set(classes)
    for name in public - functions:
        stub = {node.name for node in classes[name].body if isinstance(node, ast.FunctionDef)}
        there = {member for member in vars(getattr(_motorfit, name)) if not member.startswith("_")}
        assert there == {member for member in stub if not member.startswith("_")}, name
    assert set(motorfit.__all__) - {"__version__"} <= set(dir(motorfit))


def test_everything_public_is_documented():
    for name in motorfit.__all__:
        thing = getattr(motorfit, name)
        if name != "__version__":
            assert thing.__doc__, name
        if isinstance(thing, type):
            for member, value in vars(thing).items():
                assert member.startswith("_") or value.__doc__, f"{name}.{member}"


def test_stubs_agree_with_the_modules(tmp_path):
    """Compares names, signatures and defaults of the stubs with the modules, by mypy.stubtest."""
    # `__all__` of the compiled module, and the name of a caught exception.
    (tmp_path / "allowed").write_text("motorfit._motorfit.__all__\nmotorfit.dask.error\n")
    command = [sys.executable, "-m", "mypy.stubtest", "motorfit", "--allowlist", "allowed"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def settings_of(tree, name):
    """Returns the keys of a TypedDict of the stubs, including those of its bases."""
    classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
    own = [node.target.id for node in classes[name].body if isinstance(node, ast.AnnAssign)]
    bases = [base.id for base in classes[name].bases if base.id in classes]
    return [key for base in bases for key in settings_of(tree, base)] + own


def test_docstrings_name_every_setting():
    tree = ast.parse(importlib.resources.files("motorfit").joinpath("_motorfit.pyi").read_text())
    takes = {
        "identify": "_IdentifySettings",
        "Evaluator": "_ProblemSettings",
        "compare": "_CompareSettings",
        "read": "_ReadOptions",
        "refine": "_RefineSettings",
    }
    for name, settings in takes.items():
        text = getattr(motorfit, name).__doc__
        named = {key for line in re.findall(r"^([a-z_, ]+?)(?: :|$)", text, re.MULTILINE) for key in line.split(", ")}
        assert set(settings_of(tree, settings)) <= named, name
        given = {"refine": (None, None), "read": ("a.csv",)}.get(name, (None,))
        # The function accepts exactly the keywords of the stubs.
        with pytest.raises((TypeError, motorfit.MotorfitError)) as raised:
            getattr(motorfit, name)(*given, **{"nothing_at_all": 1})
        assert "nothing_at_all" in str(raised.value)
        for key in settings_of(tree, settings):
            with pytest.raises(Exception) as raised:
                getattr(motorfit, name)(*given, **{key: object()})
            assert "no keyword argument" not in str(raised.value), key


def test_signatures_show_defaults():
    for name in motorfit.__all__:
        thing = getattr(motorfit, name)
        if callable(thing) and not (isinstance(thing, type) and issubclass(thing, Exception)):
            try:
                assert "Ellipsis" not in str(inspect.signature(thing)) and "..." not in str(inspect.signature(thing)), name
            except ValueError:
                assert isinstance(thing, type), name


def test_devices_are_those_of_the_program(program):
    printed = json.loads(program("devices", "--json").stdout)
    assert motorfit.devices() == printed
    assert program("--version").stdout.split()[-1] == motorfit.__version__


@pytest.mark.parametrize(("document", "example"), [("README.md", "identify.py"), ("docs/python.md", "costs.py")])
def test_documents_show_the_examples_that_are_run(document, example):
    text = (ROOT / "bindings" / "python" / "examples" / example).read_text()
    assert f"```python\n{text}```" in (ROOT / document).read_text()
    assert len(text.splitlines()) <= 10
