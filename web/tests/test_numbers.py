"""Parameters, standard errors and findings of the page against those of the program, on twenty recordings."""

import json
import os
import pathlib
import subprocess

import pytest
from conftest import ROOT, missing

SHARED = os.environ.get("MOTORFIT_RECORDINGS")
MILLIS = "time=millis:ms,voltage=pwm*12/255:V,speed=rpm:rpm"
WAAM = "time=Tempo:s,current=Corrente:mA,speed=Velocidade:rad/s,voltage=Degrau:6.66745..7.79294"
ODRIVE = "time=timestep (8Hz):8kHz"
BAM = "time=timestamp:s,speed=speed:rad/s,voltage=int16(load)/885*input_volts*torque_enable:V,load_torque=mass*9.81*length*sin(position)"
# Recordings with their settings; the first two are examples of the project.
RECORDINGS = [
    ("examples/m2-step.csv", {}),
    ("examples/pwm-log.csv", {"columns": "time=ms:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA"}),
    ("newcomer-logs/a_natural.csv", {"columns": f"{MILLIS},current=current_mA:mA"}),
    ("newcomer-logs/b_german.csv", {"columns": "voltage=PWM (0-255)*12/255:V"}),
    ("newcomer-logs/c_spanish.csv", {"columns": "time=tiempo:ms,voltage=ciclo*12/255:V,speed=velocidad:rpm,current=corriente:mA"}),
    ("newcomer-logs/d_nocurrent.csv", {"columns": MILLIS}),
    ("newcomer-logs/e_garbage.csv", {"columns": f"{MILLIS},current=current_mA:mA", "bad_rows": "skip"}),
    ("newcomer-logs/f_volts.csv", {"with": ["coulomb"]}),
    ("newcomer-logs/g_noheader.csv", {"columns": "time=#1:ms,voltage=#2*12/255:V,speed=#3:rpm,current=#4:mA"}),
    ("newcomer-logs/h_serial.txt", {"columns": "time=t:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA"}),
    ("waam-ufjf-ensaio-frequencia/Feb-09-2022--14-40-31.csv", {"columns": WAAM}),
    ("waam-ufjf-ensaio-frequencia/Jan-15-2022--19-08-52.csv", {"columns": WAAM, "with": ["sensor-average"]}),
    ("tutla53-dc-motor/log_20260601161601.csv", {"columns": "voltage=Commanded_PWM*12/7200:V"}),
    ("tutla53-dc-motor/log_20260601161754.csv", {"columns": "voltage=Commanded_PWM*12/7200:V", "with": ["coulomb"]}),
    ("tutla53-dc-motor/log_20260601161912.csv", {"columns": "voltage=Commanded_PWM*12/7200:V"}),
    ("labmrd-odrive/chirp1.csv", {"columns": ODRIVE}),
    ("labmrd-odrive/noise1.csv", {"columns": ODRIVE, "with": ["coulomb"]}),
    ("labmrd-odrive/step1.csv", {"columns": ODRIVE}),
    ("rhoban-bam-xl330/2026-01-15_10h28m10.json", {"columns": BAM, "with": ["coulomb"]}),
    ("newcomer-logs/k_good.csv", {}),
]

RUN = """async ({ name, bytes, settings }) => {
    const script = document.querySelector("script[type=module]").src;
    const { Library } = await import(script.replace("app.js", "library.js"));
    globalThis.numbers ??= new Promise((resolve) => { const own = new Library(() => resolve(own)); });
    const library = await numbers;
    const data = Uint8Array.from(atob(bytes), (letter) => letter.charCodeAt(0));
    const key = await library.add(new File([data], name));
    const answer = await library.ask("identify", { keys: [key], settings: JSON.stringify(settings) });
    await library.remove(key);
    return { error: answer.error, document: answer.document };
}"""


@pytest.fixture(scope="module")
def page(browser, address):
    page = browser.new_page()
    page.goto(address)
    page.wait_for_selector("body[data-ready]")
    yield page
    page.close()


@pytest.fixture(scope="module")
def program():
    path = os.environ.get("MOTORFIT_PROGRAM")
    if not path:
        missing("MOTORFIT_PROGRAM names no program")
    return path


def flags(settings):
    for name, value in settings.items():
        yield f"--{name.replace('_', '-')}"
        yield ",".join(value) if isinstance(value, list) else value


@pytest.mark.parametrize(("name", "settings"), RECORDINGS, ids=[name for name, _ in RECORDINGS])
def test_the_page_has_the_numbers_of_the_program(page, program, name, settings):
    import base64

    path = ROOT / name
    if not name.startswith("examples/"):
        if not SHARED:
            missing("MOTORFIT_RECORDINGS names no folder")
        path = pathlib.Path(SHARED) / name
    own = page.evaluate(RUN, {"name": path.name, "bytes": base64.b64encode(path.read_bytes()).decode(), "settings": settings})
    done = subprocess.run([program, "identify", path, "--json", *flags(settings)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    native = json.loads(done.stdout)
    if "error" in native:
        assert own.get("error"), f"the program says {native['error']['message']}"
        assert own["error"]["line"] == native["error"]["line"]
        assert own["error"]["kind"] == native["error"]["kind"]
        return
    assert not own.get("error"), own.get("error")
    found = own["document"]
    assert found["trust"]["level"] == native["trust"]["level"]
    codes = lambda document: sorted(warning["code"] for kind in ["warnings", "remarks"] for warning in document[kind])
    assert codes(found) == codes(native)
    assert [reason["code"] for reason in found["trust"]["reasons"]] == [reason["code"] for reason in native["trust"]["reasons"]]
    assert set(found["parameters"]) == set(native["parameters"])
    for symbol, wanted in native["parameters"].items():
        value, error = found["parameters"][symbol]["value"], wanted["std_error"]
        if wanted["value"] is None:
            assert value is None
            continue
        # The fits end where the cost no longer changes, so that values differ by a small part of their errors; without fused
        # multiplications and additions sums differ in the last digits.
        assert abs(value - wanted["value"]) <= 1e-3 * (error or 0) + 1e-9 * abs(wanted["value"]), symbol
        if error is not None:
            assert found["parameters"][symbol]["std_error"] == pytest.approx(error, rel=1e-3), symbol
