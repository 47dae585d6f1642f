"""Fixtures: the built page on a local server, and a browser that is driven by Playwright."""

import functools
import http.server
import json
import os
import pathlib
import shutil
import threading

import pytest
from playwright.sync_api import sync_playwright

ROOT = pathlib.Path(__file__).parents[2]
PAGE = pathlib.Path(os.environ.get("MOTORFIT_PAGE", ROOT / "dist/web")).resolve()
EXAMPLE = ROOT / "examples/m2-step.csv"


def missing(what: str) -> None:
    """Skips a test that lacks something, or fails it where skips are failures."""
    if os.environ.get("MOTORFIT_NO_SKIP"):
        pytest.fail(what)
    pytest.skip(what)


class Handler(http.server.SimpleHTTPRequestHandler):
    extensions_map = {**http.server.SimpleHTTPRequestHandler.extensions_map, ".wasm": "application/wasm", ".js": "text/javascript"}

    def log_message(self, *_):
        pass


@pytest.fixture(scope="session")
def address():
    """The address of the page as a static host serves it."""
    if not (PAGE / "index.html").exists():
        missing(f"{PAGE} has no page; run web/build")
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=str(PAGE)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()


@pytest.fixture(scope="session")
def browser():
    found = next((path for name in ["chromium", "chromium-browser", "google-chrome"] if (path := shutil.which(name))), None)
    if not found:
        missing("there is no Chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=["--enable-unsafe-webgpu"], chromium_sandbox=os.geteuid() != 0)
        yield browser
        browser.close()


@pytest.fixture
def opened(browser, address):
    """A function that opens the page. At the end of a test no message was logged and no foreign origin was asked."""
    contexts, faults = [], []

    def open_page(at=address, may_fail=False, fragment="", before=lambda page: None, is_ready=True, **options):
        context = browser.new_context(viewport={"width": 1100, "height": 900}, **options)
        contexts.append(context)
        page = context.new_page()
        if not may_fail:
            page.on("console", lambda message: faults.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: faults.append(f"error: {error}"))
        origin = "/".join(at.split("/")[:3])
        local = (origin, "blob:", "data:", "about:")
        page.on("request", lambda request: None if request.url.startswith(local) else faults.append(f"asked for {request.url}"))
        before(page)
        page.goto(at + fragment)
        if is_ready:
            page.wait_for_selector("body[data-ready]")
        return page

    yield open_page
    for context in contexts:
        context.close()
    assert faults == []


def choose(page, *files, done="inspect"):
    """Chooses files: paths, or pairs of a name and bytes. Waits for the result, or for an error if `done` is None."""
    page.evaluate("delete document.body.dataset.done")
    payloads = [{"name": file[0], "mimeType": "", "buffer": file[1]} if isinstance(file, tuple) else str(file) for file in files]
    page.set_input_files("#files", payloads)
    wait(page, done)


def wait(page, done):
    page.wait_for_selector(f"body[data-done={done}]" if done else "#error:not([hidden])", timeout=60_000)


def identify(page, done="identify"):
    page.evaluate("delete document.body.dataset.done")
    page.click("#form button[type=submit]")
    wait(page, done)


def document(page):
    """The JSON document that the page offers."""
    with page.expect_download() as download:
        page.click("#save-json")
    return json.loads(pathlib.Path(download.value.path()).read_text(encoding="utf-8"))
