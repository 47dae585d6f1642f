"""The page as a reader uses it: files, columns, results, comparison, search, without a network, on a small screen."""

import gzip
import json
import re

import pytest
from conftest import EXAMPLE, PAGE, ROOT, choose, document, identify, missing, wait

# Columns that the page cannot understand by itself.
FOREIGN = ["a;b;c;d"] + [f"{n};{255 if n > 20 else 0};{(n - 20) * 9 if n > 20 else 0};{400 if n > 20 else 0}" for n in range(100)]
DUTY = ["n;x;y;z"]
for line in EXAMPLE.read_text().splitlines()[1:]:
    time, voltage, current, speed = (float(cell) for cell in line.split(","))
    DUTY.append(f"{1e3 * time:.6f};{voltage / 12 * 255:.9f};{1e3 * current:.9f};{speed * 60 / 6.283185307179586:.9f}")


def drop(page, name, text):
    transfer = page.evaluate_handle(
        "([name, text]) => { const data = new DataTransfer(); data.items.add(new File([text], name)); return data; }", [name, text]
    )
    page.dispatch_event("#drop", "dragover", {"dataTransfer": transfer})
    page.dispatch_event("#drop", "drop", {"dataTransfer": transfer})


def test_the_example_gives_values_with_errors(opened):
    page = opened()
    page.click("#example")
    wait(page, "identify")
    found = document(page)
    assert found["trust"]["level"] == "good"
    assert found["parameters"]["R"]["value"] == pytest.approx(0.921083, abs=1e-6)
    report = page.frame_locator("#report")
    assert "Trust: good" in report.locator("main").inner_text()
    # The report's own script works in the page: its panels can be zoomed.
    report.locator("button", has_text="Reset").first.wait_for()
    names = {"#save-report": "report.html", "#save-json": "result.json", "#save-curves": "curves.csv"}
    for link, name in names.items():
        with page.expect_download() as download:
            page.click(link)
        assert download.value.suggested_filename == name
        assert download.value.path().stat().st_size > 1000
    assert "motorfit identify m2-step.csv" in page.evaluate("document.getElementById('report').srcdoc")


def test_a_dropped_file_is_read_and_its_columns_are_shown(opened):
    page = opened()
    drop(page, "dropped.csv", EXAMPLE.read_text())
    wait(page, "inspect")
    assert "dropped.csv" in page.inner_text("#list")
    page.click("#columns summary")
    rows = page.locator("#tables tbody tr")
    assert rows.count() == 4
    assert rows.nth(3).locator("select").first.input_value() == "speed"
    assert rows.nth(3).locator("select").nth(1).input_value() == "rad/s"


def test_columns_are_chosen_with_menus(opened):
    page = opened()
    choose(page, ("log.csv", "\n".join(DUTY).encode()), done=None)
    assert page.locator("#columns").get_attribute("open") is not None, "the menus are shown where columns are missing"
    for row, (quantity, unit, scaling) in enumerate([("time", "ms", ""), ("voltage", "V", "*12/255"), ("current", "mA", ""), ("speed", "rpm", "")]):
        cells = page.locator("#tables tbody tr").nth(row)
        cells.locator("select").first.select_option(quantity)
        cells = page.locator("#tables tbody tr").nth(row)
        cells.locator("select").nth(1).select_option(unit)
        if scaling:
            cells = page.locator("#tables tbody tr").nth(row)
            cells.locator("input").fill(scaling)
            cells.locator("input").press("Tab")
    wait(page, "inspect")
    assert page.input_value("#columns-text") == "time=#1:ms,voltage=#2*12/255:V,current=#3:mA,speed=#4:rpm"
    identify(page)
    assert document(page)["parameters"]["R"]["value"] == pytest.approx(0.921083, abs=1e-5)
    assert "--columns 'time=#1:ms" in page.evaluate("document.getElementById('report').srcdoc").replace("&#39;", "'")


def test_a_scaling_being_typed_stays_while_the_columns_are_read(opened):
    page = opened()
    choose(page, ("log.csv", "\n".join(DUTY).encode()), done=None)
    cells = page.locator("#tables tbody tr").nth(1)
    cells.locator("select").first.select_option("voltage")
    page.wait_for_function("document.getElementById('columns-text').value === 'voltage=#2:V'")
    # The unit is chosen and the scaling begun before the answer to the choice can arrive.
    page.evaluate("""() => {
        const row = document.querySelectorAll("#tables tbody tr")[1], input = row.querySelector("input"), unit = row.querySelectorAll("select")[1];
        document.getElementById("error").hidden = true;
        unit.value = "mV";
        unit.onchange();
        input.focus();
        input.value = "*12/255";
    }""")
    page.wait_for_selector("#error:not([hidden])", timeout=60_000)
    assert cells.locator("input").input_value() == "*12/255"
    page.evaluate("document.querySelectorAll('#tables tbody tr')[1].querySelector('input').onchange()")
    assert page.input_value("#columns-text") == "voltage=#2*12/255:mV"


def choose_as_proposed(page):
    """Chooses a log whose hint has the columns to use, with a supply of 12 V, and applies them."""
    choose(page, ROOT / "examples/pwm-log.csv", done=None)
    page.click("#error button")
    wait(page, "inspect")


def menus(page):
    """The quantity, the unit and the scaling of each column."""
    rows = page.locator("#tables tbody tr")
    of = lambda row: (row.locator("select").first.input_value(), row.locator("select").nth(1).input_value(), row.locator("input").input_value())
    return [of(rows.nth(n)) for n in range(rows.count())]


def test_menus_follow_the_text_and_keep_what_they_cannot_show(opened):
    page = opened()
    choose(page, ("log.csv", "\n".join(["time_s,duty,current_mA,rpm,count", *(f"{n / 100},{n % 7},{n},{n * 2},{n}" for n in range(50))]).encode()), done=None)
    page.fill("#columns-text", "voltage=duty*12/7:V,position=cumsum(count)/100:turns,speed=-,current=current_mA*2:mA")
    page.press("#columns-text", "Tab")
    wait(page, "inspect")
    assert menus(page) == [("time", "s", ""), ("voltage", "V", "*12/7"), ("current", "mA", "*2"), ("", "", ""), ("", "", "")]
    page.evaluate("delete document.body.dataset.done")
    page.locator("#tables tbody tr").nth(2).locator("select").nth(1).select_option("A")
    wait(page, "inspect")
    wanted = "time=#1:s,voltage=#2*12/7:V,current=#3*2:A,position=cumsum(count)/100:turns,speed=-"
    assert page.input_value("#columns-text") == wanted


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(range(256)), ["picture.png"]),
        ("empty.csv", b"", ["empty.csv"]),
        ("notes.txt", b"Dear reader,\nthere are no numbers here.\n", ["notes.txt", "No column"]),
        ("cut.xlsx", b"PK\x03\x04" + bytes(50), ["cut.xlsx"]),
        ("bad.csv", b"time_s,voltage_V,current_A,speed_rad_s\n0,1,2,3\n0.1,1,oops,3\n0.2,1,2,3\n", ["bad.csv, line 3, column current_A", "oops"]),
        ("foreign.csv", "\n".join(FOREIGN).encode(), ["foreign.csv", "“columns”"]),
    ],
)
def test_wrong_files_are_explained(opened, name, data, words):
    page = opened()
    choose(page, (name, data), done=None)
    text = page.inner_text("#error")
    for word in words:
        assert word in text
    assert not re.search(r"--[a-z]", text), "flags of the program mean nothing here"
    assert page.locator("#error p").count() >= 3, "place, message and what to do"
    # The page goes on.
    page.get_by_role("button", name=f"Remove {name}").click()
    choose(page, EXAMPLE)
    assert page.is_hidden("#error")


def test_a_file_that_cannot_be_read_does_not_lose_the_others(opened):
    page = opened()
    transfer = page.evaluate_handle(
        """(text) => {
            const folder = new File([], "folder");
            folder.arrayBuffer = () => Promise.reject(new Error("it is a folder"));
            // A list of files has copies; the page takes its items as they are.
            return { folder, own: new File([text], "own.csv") };
        }""",
        EXAMPLE.read_text(),
    )
    page.evaluate(
        """({ folder, own }) => {
            const event = new Event("drop", { bubbles: true, cancelable: true });
            event.dataTransfer = { files: [folder, own] };
            document.getElementById("drop").dispatchEvent(event);
        }""",
        transfer,
    )
    page.wait_for_selector("#error:not([hidden])")
    assert "folder" in page.inner_text("#error")
    assert "own.csv" in page.inner_text("#list")
    identify(page)


def test_the_example_is_read_as_it_is_and_own_recordings_are_kept(opened):
    page = opened()
    choose(page, EXAMPLE)
    page.click("#columns summary")
    page.fill("#columns-text", "voltage=#2*2:V,current=#3:mA,speed=#4:rpm")
    page.press("#columns-text", "Tab")
    wait(page, "inspect")
    page.evaluate("delete document.body.dataset.done")
    page.click("#example")
    wait(page, "identify")
    assert document(page)["parameters"]["R"]["value"] == pytest.approx(0.921083, abs=1e-6)
    assert page.locator("#list li").count() == 2


def test_results_stand_side_by_side(opened):
    page = opened()
    choose(page, EXAMPLE)
    identify(page)
    assert page.is_hidden("#comparison")
    page.check("text=these:")
    page.check("[name=extension][value=coulomb]")
    identify(page)
    heads = page.locator("#comparison-table thead th")
    assert heads.count() == 2
    assert "with coulomb" in heads.nth(1).inner_text()
    table = page.inner_text("#comparison-table")
    assert "standard errors apart" in table
    assert "Tc" in table
    page.get_by_role("button", name="Remove m2-step.csv").last.click()
    assert page.is_hidden("#comparison")


def test_settings_are_in_the_address_and_recordings_are_not(opened):
    page = opened()
    choose(page, EXAMPLE)
    page.check("text=what the recordings call for")
    page.click("#more summary")
    page.fill("[name=crop]", "0.5:2")
    page.click("#columns summary")
    page.fill("#columns-text", "speed=#4:rad/s")
    page.press("#columns-text", "Tab")
    wait(page, "inspect")
    fragment = page.evaluate("location.hash")
    assert "with=auto" in fragment
    assert "crop=0.5%3A2" in fragment
    assert "columns" not in fragment
    again = opened(fragment=fragment)
    choose(again, EXAMPLE)
    assert again.is_checked("[name=extensions][value=auto]")
    identify(again)
    assert document(again)["records"][0]["samples"] < 3001


def test_a_search_is_watched_on_the_cpu_and_on_webgpu(opened):
    page = opened()
    choose(page, EXAMPLE)
    page.wait_for_selector("body[data-gpu]")
    if page.evaluate("document.body.dataset.gpu") == "":
        missing("this browser has no WebGPU adapter")
    page.fill("#search-generations", "40")
    costs = {}
    for device in ["cpu", "gpu"]:
        page.select_option("#search-device", device)
        page.click("#search-form button[type=submit]")
        page.wait_for_selector("body[data-searched]", timeout=60_000)
        costs[device] = float(page.evaluate("document.body.dataset.searched"))
        assert "Ended after 40 generations and 4000 evaluations" in page.inner_text("#search-status")
        assert page.locator("#planes canvas").count() == 4
    # The lowest cost is one in f64 on both; the ways there differ by rounding.
    assert costs["gpu"] == pytest.approx(costs["cpu"], rel=0.05)
    page.fill("#search-generations", "10000")
    page.click("#search-form button[type=submit]")
    page.click("#search-stop")
    page.wait_for_selector("body[data-searched]")
    assert "Stopped after" in page.inner_text("#search-status")


def test_a_search_takes_the_extensions_that_auto_selected(opened):
    page = opened()
    choose_as_proposed(page)
    page.check("text=what the recordings call for")
    identify(page)
    found = document(page)
    assert len(found["with"]) > 0
    page.fill("#search-generations", "5")
    page.click("#search-form button[type=submit]")
    page.wait_for_selector("body[data-searched]", timeout=60_000)
    named = page.inner_text("#search-status")
    assert all(f"{symbol} = " in named for symbol in found["parameters"] if not found["parameters"][symbol]["fixed"])


def test_costs_of_webgpu_are_within_the_bounds_of_f32(opened):
    page = opened()
    choose(page, EXAMPLE)
    page.wait_for_selector("body[data-gpu]")
    if page.evaluate("document.body.dataset.gpu") == "":
        missing("this browser has no WebGPU adapter")
    # Ten thousand candidates over four decades; the contract suite allows 2e-5 for costs in f32.
    rates = page.evaluate(
        """async () => {
            const script = document.querySelector("script[type=module]").src;
            const { Library } = await import(script.replace("app.js", "library.js"));
            const file = new File([await (await fetch(script.replace("app.js", "m2-step.csv"))).blob()], "m2-step.csv");
            const library = await new Promise((resolve) => { const own = new Library(() => resolve(own)); });
            const key = await library.add(file);
            return (await library.ask("measure", { keys: [key], settings: "{}", count: 10000, onGpu: true })).rates;
        }"""
    )
    assert rates["count"] == 10000
    assert 0 < rates["difference"] < 2e-5


def test_the_page_works_without_webgpu(opened):
    script = next(PAGE.glob("*/gpu.js")).read_text().replace("navigator.gpu", "undefined")
    without = lambda page: page.context.route("**/gpu.js", lambda route: route.fulfill(content_type="text/javascript", body=script))
    page = opened(before=without, service_workers="block", may_fail=True)
    choose(page, EXAMPLE)
    page.wait_for_selector("body[data-gpu]")
    assert page.evaluate("document.body.dataset.gpu") == ""
    assert "this browser has no WebGPU" in page.inner_text("#gpu-text")
    page.click("#search-form button[type=submit]")
    page.wait_for_selector("body[data-searched]", timeout=60_000)


def test_what_runs_can_be_stopped(opened):
    page = opened()
    rows = EXAMPLE.read_text().splitlines()
    long = [rows[0]] + [f"{n / 1000},{row.split(',', 1)[1]}" for n, row in enumerate(rows[1:] * 60)]
    choose(page, ("long.csv", "\n".join(long).encode()))
    page.check("text=what the recordings call for")
    page.click("#form button[type=submit]")
    page.click("#stop")
    page.wait_for_selector("#error:not([hidden])")
    assert "Stopped" in page.inner_text("#error")
    page.get_by_role("button", name="Remove long.csv").click()
    choose(page, EXAMPLE)
    identify(page)


def test_a_library_that_cannot_be_loaded_is_named(opened):
    broken = lambda page: page.context.route("**/*.wasm", lambda route: route.abort())
    page = opened(before=broken, service_workers="block", may_fail=True, is_ready=False)
    page.wait_for_selector("#error:not([hidden])")
    assert "The library cannot be loaded" in page.inner_text("#error")


def test_the_recommended_next_step_is_one_click(opened):
    page = opened()
    choose_as_proposed(page)
    assert page.input_value("#columns-text") == "time=ms:ms,voltage=pwm*12/255:V,speed=rpm:rpm,current=mA:mA"
    identify(page)
    assert document(page)["trust"]["level"] != "good"
    page.evaluate("delete document.body.dataset.done")
    page.click("#next button")
    wait(page, "identify")
    assert page.is_checked("[name=extensions][value=auto]")
    assert page.locator("#comparison-table thead th").count() == 2


def test_it_works_without_a_network_after_the_first_load(opened):
    page = opened(may_fail=True)
    page.wait_for_selector("#offline:not(:empty)")
    page.context.set_offline(True)
    page.reload()
    page.wait_for_selector("body[data-ready]")
    page.click("#example")
    wait(page, "identify")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nothing_is_cut_off_on_a_small_screen(opened, scheme):
    page = opened(color_scheme=scheme)
    page.set_viewport_size({"width": 360, "height": 740})
    page.click("#example")
    wait(page, "identify")
    identify(page)
    page.click("#columns summary")
    page.click("#more summary")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    assert page.evaluate("document.getElementById('report').contentDocument.documentElement.scrollWidth") <= 360


def test_every_control_has_a_name_and_can_be_reached_by_keys(opened):
    page = opened()
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    page.keyboard.press("Enter")
    wait(page, "identify")
    page.click("#columns summary")
    page.click("#more summary")
    page.click("#search-form button[type=submit]")
    page.wait_for_selector("body[data-searched]", timeout=60_000)
    nameless = page.evaluate(
        """[...document.querySelectorAll("input, select, button, a, canvas, iframe")].filter((node) => {
            const label = node.labels?.[0]?.textContent ?? node.getAttribute("aria-label") ?? node.title ?? "";
            return !(label.trim() || node.textContent.trim() || node.title);
        }).map((node) => node.outerHTML)"""
    )
    assert nameless == []
    headings = page.evaluate("[...document.querySelectorAll('h1, h2, h3')].map((node) => Number(node.tagName[1]))")
    assert all(later - earlier <= 1 for earlier, later in zip(headings, headings[1:]))
    unreachable = page.evaluate("[...document.querySelectorAll('a, button, input, select')].filter((node) => node.tabIndex < 0).length")
    assert unreachable == 0


def test_sizes():
    """What a visitor loads, compressed."""
    wasm = next(PAGE.glob("*/*.wasm.gz")).stat().st_size
    scripts = sum(len(gzip.compress(path.read_bytes(), 9)) for path in PAGE.glob("**/*.js"))
    assert wasm <= 2_000_000, f"{wasm} bytes of WebAssembly"
    assert scripts <= 60_000, f"{scripts} bytes of scripts"


def test_names_of_files_follow_their_content():
    index = (PAGE / "index.html").read_text()
    folder = next(PAGE.glob("*/app.js")).parent
    assert re.fullmatch(r"[0-9a-f]{16}", folder.name)
    assert f'src="{folder.name}/app.js"' in index
    worker = (PAGE / "service-worker.js").read_text()
    kept = json.loads(re.search(r"FILES = (\[.*\])", worker).group(1))
    assert {path for path in kept if path != "./"} == {f"{folder.name}/{path.name}" for path in folder.iterdir() if path.suffix != ".gz"}
    assert "default-src 'none'" in index
    assert not re.search(r"https?://", index), "no other origin"


def test_a_built_in_model_gives_the_values_of_the_motor(opened):
    page = opened()
    page.click("#example")
    wait(page, "identify")
    page.select_option("#machine", "dc-motor")
    wait(page, "check")
    assert page.inner_text("#result-title") == "The model as it was understood"
    assert "Equations" in page.frame_locator("#report").locator("main").inner_text()
    assert "3001 samples" in page.frame_locator("#report").locator("main").inner_text()
    assert page.locator("#search").is_hidden()
    page.click("#columns summary")
    assert page.locator("#tables select").count() == 0
    assert "v [V]" in page.inner_text("#signals")
    identify(page)
    found = document(page)
    assert found["parameters"]["R"]["value"] == pytest.approx(0.921083, abs=1e-5)
    assert "motorfit identify m2-step.csv --model dc-motor" in page.evaluate("document.getElementById('report').srcdoc")
    heads = page.locator("#comparison-table thead th")
    assert "linear motor" in heads.nth(0).inner_text()
    assert "dc-motor" in heads.nth(1).inner_text()
    # Inspect identifies each recording by itself.
    page.evaluate("delete document.body.dataset.done")
    page.click("#inspect")
    wait(page, "inspect")
    # Back to the motor: menus and the search are there again.
    page.evaluate("delete document.body.dataset.done")
    page.select_option("#machine", "")
    wait(page, "inspect")
    assert page.locator("#search").is_visible()
    assert page.locator("#tables select").count() > 0


FAN = """format = 1
name = "Motor with a fan"
[inputs]
v = { unit = "V", column = "voltage" }
[parameters]
a = { unit = "1/s", min = 0.1, max = 1000, log = true }
b = { unit = "rad/s^2/V", min = 0.1, max = 10000, log = true }
c = { unit = "1/rad", min = 0, max = 1, neutral = 0, term = "fan" }
[states]
w = { unit = "rad/s", d = "b*v - a*w - c*w*abs(w)", initial = "measured" }
[outputs]
w = { value = "w", unit = "rad/s", column = "speed" }
"""


def test_a_model_is_dropped_mended_and_identified_with_its_terms(opened):
    page = opened()
    drop(page, "fan.toml", FAN.replace("a*w -", "q*w -"))
    page.wait_for_selector("#error:not([hidden])")
    assert "fan.toml, line 10, column" in page.inner_text("#error .place")
    assert '"q" is not known' in page.inner_text("#error")
    # Without a recording the text is read already.
    page.fill("#text", FAN)
    page.click("#apply")
    wait(page, "check")
    assert "Motor with a fan" in page.frame_locator("#report").locator("main").inner_text()
    with page.expect_download() as download:
        page.click("#save-text")
    assert download.value.suggested_filename == "fan.toml"
    choose(page, EXAMPLE, done="check")
    page.check("input[name=extensions][value=these]")
    names = page.locator("#extension-list label").all_inner_texts()
    assert [name.strip() for name in names][:2] == ["fan", "dead-time"]
    page.check("#extension-list input[value=fan]")
    identify(page)
    found = document(page)
    assert found["with"] == ["fan"]
    assert set(found["parameters"]) == {"a", "b", "c"}
    assert "--model fan.toml" in page.evaluate("document.getElementById('report').srcdoc")
    assert "--with fan" in page.evaluate("document.getElementById('report').srcdoc")
    # The choice of a machine forgets settings that mean nothing for it.
    page.evaluate("delete document.body.dataset.done")
    page.select_option("#machine", "")
    wait(page, "inspect")
    assert page.is_checked("input[name=extensions][value='']")
    assert any("coulomb" in name for name in page.locator("#extension-list label").all_inner_texts())
