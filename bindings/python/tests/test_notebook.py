"""The notebook of the examples runs in a kernel, in at most five cells, and shows results as HTML that follows dark notebooks.

It does not prove how a browser draws them.
"""

import json
import os
import re
import xml.etree.ElementTree as ET

import nbclient
import nbformat
import pytest

import motorfit
from conftest import M2, ROOT, step

NOTEBOOK = ROOT / "bindings" / "python" / "examples" / "motor.ipynb"


@pytest.fixture(scope="module")
def executed(tmp_path_factory):
    """Returns the executed code cells of the notebook; files are written to a new folder."""
    out = tmp_path_factory.mktemp("notebook") / "out"
    notebook = nbformat.reads(NOTEBOOK.read_text().replace("/tmp/motorfit", str(out)), as_version=4)
    kernel = {"JUPYTER_RUNTIME_DIR": str(tmp_path_factory.mktemp("runtime")), "IPYTHONDIR": str(tmp_path_factory.mktemp("ipython"))}
    before = {name: os.environ.get(name) for name in kernel}
    os.environ.update(kernel)
    try:
        nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(ROOT)}}).execute()
    finally:
        for name, value in before.items():
            os.environ.pop(name) if value is None else os.environ.update({name: value})
    assert (out / "motor.svg").read_text().startswith("<svg")
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def html_of(cell):
    return "".join(output.data.get("text/html", "") for output in cell.outputs if output.output_type == "execute_result")


def test_the_task_takes_five_cells_at_most(executed):
    assert 3 <= len(executed) <= 5
    assert not any(output.output_type == "error" for cell in executed for output in cell.outputs)
    # The file in the project has no results.
    assert all(not cell.get("outputs") for cell in json.loads(NOTEBOOK.read_text())["cells"])


def test_the_result_is_shown_with_values_fit_trust_and_a_plot(executed):
    shown = html_of(executed[1])
    tree = ET.fromstring(shown)
    text = " ".join(tree.itertext())
    assert "Trust:" in text and "standard error" in text and "fit [%]" in text and "resistance" in text
    assert shown.count("<figure") == 1 and "<svg" in html_of(executed[0])
    first = next(row for row in tree.iter("tr") if "R, resistance" in "".join(row.itertext()))
    assert abs(float(first[1].text) / M2["R"] - 1) < 0.02


def small_comparison():
    return motorfit.compare(runs=2, generations=3, population=8, methods="gwo,sm")


SHOWN = {
    "record": step,
    "figure": lambda: step().plot(),
    "identification": lambda: motorfit.identify(step()),
    "comparison": small_comparison,
}


@pytest.mark.parametrize("kind", SHOWN)
def test_html_takes_the_colours_of_the_notebook(kind):
    shown = SHOWN[kind]()._repr_html_()
    tree = ET.fromstring(shown)
    style = "".join(tree.find("style").itertext())
    assert "currentColor" in style and "prefers-color-scheme" not in style
    # The style applies to this output alone, and gives the text no colour of its own.
    rules = re.findall(r"([^{}]+)\{([^{}]*)\}", style)
    assert all(part.strip().startswith(".motorfit") for selector, _ in rules for part in selector.split(","))
    # Of equal selectors the last rule counts: the text of tables and drawings has the colour around it, curves have colours for both.
    declared = {}
    for selectors, body in rules:
        for selector in selectors.split(","):
            for line in filter(None, (line.strip() for line in body.split(";"))):
                declared[" ".join(selector.split()), line.split(":")[0]] = line.split(":", 1)[1].strip()
    colours = {selector: value for (selector, name), value in declared.items() if name == "color"}
    drawn = {selector for selector in colours if re.search(r"\.plot .*\.(c\d|limit)$", selector)}
    assert len(drawn) >= 9 and {colours[selector] for selector in set(colours) - drawn} == {"inherit"}
    fills = {value for (selector, name), value in declared.items() if name == "fill" and re.search(r" text(\.\w+)?$", selector)}
    assert fills == {"currentColor"}
    # Everything black or white in the drawing is covered by a rule.
    for drawn in (one for one in tree.iter() if one.tag.endswith("}svg")):
        colours = {value.lower() for one in drawn.iter() for key, value in one.attrib.items() if key in ("fill", "stroke")}
        for colour in colours & {"white", "#ffffff", "black", "#000000", "#cccccc"}:
            assert f'"{colour}"' in style, colour


def test_warnings_stand_in_the_html():
    record = step()
    found = motorfit.identify(motorfit.Record(record.time, voltage=record.voltage, speed=record.speed))
    text = "".join(ET.fromstring(found._repr_html_()).itertext())
    assert found.warnings and all(warning.message in text for warning in found.warnings)
    assert all(warning.message.split()[0] in found.summary() for warning in found.warnings)
