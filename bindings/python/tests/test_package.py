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


def keywords_of(thing):
    """Returns the keyword arguments that a function or class shows to `inspect`, and so to completion."""
    return [p.name for p in inspect.signature(thing).parameters.values() if p.kind is p.KEYWORD_ONLY]


WITH_SETTINGS = {
    "identify": motorfit.identify,
    "Evaluator": motorfit.Evaluator,
    "compare": motorfit.compare,
    "Model.compare": motorfit.Model("dc-motor").compare,
    "refine": motorfit.refine,
    "read": motorfit.read,
    "Record.from_file": motorfit.Record.from_file,
    "Record.from_columns": motorfit.Record.from_columns,
}


@pytest.mark.parametrize("name", WITH_SETTINGS)
def test_keywords_are_those_that_are_accepted_and_documented(name):
    """stubtest compares signatures with the stubs, and tests/project/reference.rs both with the table of settings."""
    thing = WITH_SETTINGS[name]
    named = {key for line in re.findall(r"^([a-z_, ]+?)(?: :|$)", thing.__doc__, re.MULTILINE) for key in line.split(", ")}
    assert not any(p.kind is p.VAR_KEYWORD for p in inspect.signature(thing).parameters.values())
    assert len(keywords_of(thing)) >= 4 and set(keywords_of(thing)) <= named
    given = {"refine": (None, None), "read": ("a.csv",), "Record.from_file": ("a.csv",)}.get(name, (None,))
    with pytest.raises((TypeError, motorfit.MotorfitError), match="nothing_at_all"):
        thing(*given, **{"nothing_at_all": 1})
    for key in keywords_of(thing):
        with pytest.raises(Exception) as raised:
            thing(*given, **{key: object()})
        assert "no keyword argument" not in str(raised.value), key


def test_the_defaults_shown_are_those_applied(record):
    """The result with every default given is the result without arguments."""
    shown = {p.name: p.default for p in inspect.signature(motorfit.identify).parameters.values() if p.default is not p.empty}
    same = [motorfit.identify(record, method="gwo", generations=5, **more).cost for more in ({}, {
        key: value for key, value in shown.items() if key not in ("method", "generations")})]
    assert same[0] == same[1]
    columns = record.to_columns()
    shown = {p.name: p.default for p in inspect.signature(motorfit.Record.from_columns).parameters.values()}
    assert motorfit.Record.from_columns(columns, **{k: v for k, v in shown.items() if k != "frame"}) == motorfit.Record.from_columns(columns)
    shown = {p.name: p.default for p in inspect.signature(motorfit.compare).parameters.values()}
    budget = {"runs": 2, "generations": 3, "population": 8}
    costs = [motorfit.compare(**more, **budget).blocks[0].costs["gwo"].tolist() for more in ({}, {
        key: value for key, value in shown.items() if key not in budget})]
    assert costs[0] == costs[1]


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
