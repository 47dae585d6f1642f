"""`motorfit view`: the page from the program, on the loopback address alone."""

import http.client
import os
import signal
import socket
import subprocess
import time
import urllib.parse

import pytest
from conftest import EXAMPLE, ROOT, document, identify, missing, wait

REFUSED = [
    ("GET", "/", {}, 404),
    ("GET", "/wrong/recordings/0", {}, 404),
    ("GET", "{own}recordings/1", {}, 404),
    ("GET", "{own}recordings/-1", {}, 404),
    ("GET", "{own}../../etc/passwd", {}, 404),
    ("GET", "{own}%2e%2e/%2e%2e/etc/passwd", {}, 404),
    ("GET", "{own}", {"Host": "example.org"}, 403),
    ("GET", "{own}recordings/0", {"Host": "localhost.example.org:80"}, 403),
    ("POST", "{own}recordings/0", {}, 405),
    ("PUT", "{own}recordings/0", {}, 405),
    ("DELETE", "{own}", {}, 405),
]


@pytest.fixture
def start():
    """A function that starts the program with files, and returns it with its address."""
    programs = []

    def start(*files):
        program = os.environ.get("MOTORFIT_PROGRAM")
        if not program:
            missing("MOTORFIT_PROGRAM names no program")
        # A shell starts programs in the background with Ctrl-C ignored, and the tests may run there.
        heard = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
        command = [program, "view", *files, "--no-open"]
        started = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heard)
        programs.append(started)
        address = started.stdout.readline().strip()
        if not address:
            text = started.stderr.read()
            if "without the page" in text:
                missing("the program was built without the page")
            pytest.fail(text)
        return started, address

    yield start
    for program in programs:
        program.kill()
        program.wait()


@pytest.fixture
def view(start):
    return start(EXAMPLE)


def test_the_page_opens_the_recordings_that_were_named(view, opened):
    _, address = view
    page = opened(at=address)
    wait(page, "inspect")
    assert "m2-step.csv" in page.inner_text("#list")
    identify(page)
    assert document(page)["parameters"]["R"]["value"] == pytest.approx(0.921083, abs=1e-6)


def test_a_model_among_the_files_is_the_machine(start, opened):
    _, address = start(EXAMPLE, ROOT / "crates/model/src/library/dc-motor.toml")
    page = opened(at=address)
    wait(page, "check")
    assert page.locator("#list li").count() == 1
    assert page.input_value("#machine") == "machine.toml"
    identify(page)
    assert document(page)["parameters"]["R"]["value"] == pytest.approx(0.921083, abs=1e-5)


def test_nothing_else_is_handed_out(view):
    _, address = view
    own = urllib.parse.urlsplit(address)
    assert own.hostname == "127.0.0.1"
    assert len(own.path) == 34
    for method, path, headers, code in REFUSED:
        connection = http.client.HTTPConnection(own.hostname, own.port, timeout=10)
        connection.request(method, path.replace("{own}", own.path), headers=headers)
        answer = connection.getresponse()
        assert (answer.status, method, path) == (code, method, path)
        assert b"root:" not in answer.read()
    connection = http.client.HTTPConnection(own.hostname, own.port, timeout=10)
    connection.request("GET", own.path + "recordings/0")
    answer = connection.getresponse()
    assert answer.read() == EXAMPLE.read_bytes()
    assert answer.getheader("Access-Control-Allow-Origin") is None
    assert answer.getheader("Cross-Origin-Resource-Policy") == "same-origin"


def test_idle_connections_and_garbage_do_not_stop_it(view):
    _, address = view
    own = urllib.parse.urlsplit(address)
    idle = [socket.create_connection((own.hostname, own.port)) for _ in range(40)]
    for text in [b"\x16\x03\x01garbage\r\n\r\n", b"GET / HTTP/9\r\n\r\n", b"A" * 40_000]:
        with socket.create_connection((own.hostname, own.port), timeout=10) as client:
            client.sendall(text)
            client.shutdown(socket.SHUT_WR)
            assert client.recv(12) == b"HTTP/1.1 400"
    for _ in range(20):
        connection = http.client.HTTPConnection(own.hostname, own.port, timeout=5)
        connection.request("HEAD", own.path + "recordings/0")
        answer = connection.getresponse()
        assert (answer.status, answer.getheader("Content-Length"), answer.read()) == (200, str(EXAMPLE.stat().st_size), b"")
    for connection in idle:
        connection.close()


def test_the_command_line_of_the_browser_has_no_lasting_address(tmp_path):
    program = os.environ.get("MOTORFIT_PROGRAM")
    if not program:
        missing("MOTORFIT_PROGRAM names no program")
    opener = tmp_path / "xdg-open"
    opener.write_text(f'#!/bin/sh\nprintf %s "$1" > {tmp_path}/seen\n')
    opener.chmod(0o755)
    env = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    started = subprocess.Popen([program, "view"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env)
    try:
        address = urllib.parse.urlsplit(started.stdout.readline().strip())
        if not address.path:
            missing(started.stderr.read())
        for _ in range(100):
            if (tmp_path / "seen").exists() and (tmp_path / "seen").read_text():
                break
            time.sleep(0.05)
        ticket = urllib.parse.urlsplit((tmp_path / "seen").read_text())
        assert ticket.path != address.path
        codes = []
        for _ in range(2):
            connection = http.client.HTTPConnection(ticket.hostname, ticket.port, timeout=10)
            connection.request("GET", ticket.path)
            answer = connection.getresponse()
            codes.append((answer.status, answer.getheader("Location")))
        assert codes == [(303, address.path), (404, None)]
    finally:
        started.kill()
        started.wait()


def test_ctrl_c_ends_it(view):
    started, _ = view
    started.send_signal(signal.SIGINT)
    assert started.wait(timeout=10) == 0


def test_a_recording_that_is_not_there_is_named_at_once():
    program = os.environ.get("MOTORFIT_PROGRAM")
    if not program:
        missing("MOTORFIT_PROGRAM names no program")
    done = subprocess.run([program, "view", "none.csv", "--no-open"], capture_output=True, text=True, timeout=10)
    if "without the page" in done.stderr:
        missing("the program was built without the page")
    assert done.returncode == 3
    assert "none.csv" in done.stderr
