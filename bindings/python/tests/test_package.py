"""The package as a whole: stubs that say what is there, devices, versions."""

import ast
import importlib.resources
import json

import motorfit
from conftest import ROOT
from motorfit import _motorfit


def test_stubs_name_all_there_is():
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


def test_devices_are_those_of_the_program(program):
    printed = json.loads(program("devices", "--json").stdout)
    assert motorfit.devices() == printed
    assert program("--version").stdout.split()[-1] == motorfit.__version__


def test_the_readme_shows_the_example_that_is_run():
    example = (ROOT / "bindings" / "python" / "examples" / "identify.py").read_text()
    assert f"```python\n{example}```" in (ROOT / "README.md").read_text()
    assert len(example.splitlines()) <= 10
