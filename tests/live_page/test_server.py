"""The server of the live page: who gets a walk, who does not, and what ends."""

import http.client
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import warpchain
from warpchain.live_page.server import MOST_BYTES, MOST_CONNECTIONS, LiveServer

FIRST = {"links": 40, "start": "ellipse", "preset": "soft"}
LONG = {"links": 40, "start": "ellipse", "preset": "soft", "walk_limit": 1e5, "gravity": 0.0}
"""A walk that never ends by itself."""


@pytest.fixture(scope="module")
def server() -> Iterator[LiveServer]:
    """A server in this process."""
    server = LiveServer()
    threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
    yield server
    server.close()


def ask(server: LiveServer, path: str, content: Any, **headers: str | None) -> tuple[int, str]:
    """Status and text of the answer to a POST request; headers of None are left out."""
    body = content if isinstance(content, bytes) else json.dumps(content).encode()
    usual: dict[str, str | None] = {"Host": f"127.0.0.1:{server.server_port}", "X-Token": server.token}
    usual |= {"Content-Length": str(len(body))} | {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=60)
    connection.putrequest("POST", path, skip_host=True, skip_accept_encoding=True)
    for name, value in usual.items():
        if value is not None:
            connection.putheader(name, value)
    connection.endheaders(body)
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text


def messages(text: str) -> list[dict[str, Any]]:
    """Messages of an answer."""
    return [json.loads(line) for line in text.splitlines()]


def walking() -> set[threading.Thread]:
    """Threads of this process that answer requests to a server."""
    return {thread for thread in threading.enumerate() if thread.name.endswith("(process_request_thread)")}


def test_a_walk_is_that_of_the_library(server: LiveServer) -> None:
    """Frames come while it is computed, the distance is that of `warpchain.walk` to the bit, and so are the frames."""
    status, text = ask(server, "/walk", FIRST)
    told, walk = messages(text), warpchain.walk(**FIRST, frame_interval=4e-3)
    assert status == 200 and told[-1]["end"]["dx"] == walk.dx and told[-1]["end"]["status"] == "at_rest"
    first = next(each["first"] for each in told if "first" in each)
    more = [each["more"] for each in told if "more" in each]
    times = first["time"] + [time for each in more for time in each["time"]]
    joints = first["joints"] + [frame for each in more for frame in each["joints"]]
    assert more and times == (walk.frame_time * 1e6).round().astype(int).tolist() == told[-1]["whole"]["time"]
    assert (
        joints == told[-1]["whole"]["joints"] == (walk.frame_joints * 1e4).round().astype(int).reshape(-1, 80).tolist()
    )


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"X_Token": None}, 403),
        ({"X_Token": ""}, 403),
        ({"X_Token": "A" * 32}, 403),
        ({"X_Token": "\xff" * 32}, 403),
        ({"Host": "evil.example"}, 403),  # a name of somebody else that leads here
        ({"Host": "evil.example:{port}"}, 403),
        ({"Host": "127.0.0.1"}, 403),
        ({"Host": None}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Origin": "https://127.0.0.1:{port}"}, 403),
        ({"Origin": "http://127.0.0.1:1"}, 403),
        ({"Origin": "null"}, 403),
        ({"Content_Length": None}, 413),
        ({"Content_Length": "-1"}, 413),
        ({"Content_Length": "9" * 5000}, 413),
        ({"Content_Length": "1e3"}, 413),
        ({"Host": "localhost:{port}", "Origin": "http://localhost:{port}"}, 400),
        ({"Origin": "http://127.0.0.1:{port}"}, 400),
    ],
)
def test_who_gets_no_walk(headers: dict[str, str | None], status: int, server: LiveServer) -> None:
    """Without the token, from another site, by another name, without a size; 400 is for who is let in with no JSON."""
    filled = {name: value and value.format(port=server.server_port) for name, value in headers.items()}
    assert ask(server, "/walk", b"no JSON", **filled)[0] == status


def test_the_token_of_the_page(server: LiveServer) -> None:
    """The page comes with its token only; its policy permits one script, and nothing from elsewhere."""

    def get(path: str, host: str = "127.0.0.1") -> tuple[int, str, str]:
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
        connection.request("GET", path, headers={"Host": f"{host}:{server.server_port}"})
        answer = connection.getresponse()
        return answer.status, answer.read().decode(), answer.headers.get("Content-Security-Policy", "")

    assert get("/")[0] == get("/?token=")[0] == get(f"/?token={server.token[:-1]}")[0] == 403
    assert get(f"/?token={server.token}", "evil.example")[0] == 403
    assert get(f"/etc/passwd?token={server.token}")[0] == get(f"/../?token={server.token}")[0] == 404
    status, page, policy = get(f"/?token={server.token}")
    assert status == 200 and "default-src 'none'" in policy and server.token not in page and "{{" not in page
    nonce = policy.partition("'nonce-")[2].partition("'")[0]
    assert page.count(f'nonce="{nonce}"') == 2 and get(f"/?token={server.token}")[1] != page


@pytest.mark.parametrize(
    ("content", "status"),
    [
        (b"1" * 10**6, 413),
        (b'{"links": [' + b"[" * 60_000, 400),
        (b'{"links": ' + b"9" * 60_000 + b"}", 400),
        (b"\xff\xfe", 400),
        (b"[1]", 400),
        (b"", 400),
        (b"{" + b'"a":' * 9000, 400),
    ],
)
def test_what_is_no_request(content: bytes, status: int, server: LiveServer) -> None:
    """Too many bytes, or no mapping in JSON: refused, and the server goes on."""
    if status == 413:  # which is answered before the content is read
        with socket.create_connection(("127.0.0.1", server.server_port), timeout=10) as line:
            head = f"POST /walk HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\nX-Token: {server.token}\r\n"
            line.sendall(f"{head}Content-Length: {len(content)}\r\n\r\n".encode() + content[:1000])
            assert b" 413 " in line.recv(100)
    else:
        assert ask(server, "/walk", content)[0] == status
    assert messages(ask(server, "/walk", {"links": 31})[1])[-1]["error"].startswith(
        "scene.links: expected an even number, got 31"
    )


@pytest.mark.parametrize(
    ("asked", "told"),
    [
        ({"links": 31}, "scene.links: expected an even number, got 31"),
        ({"links": 10**9}, "scene.links: expected at most 400 on a live page, got 1000000000"),
        ({"links": "many"}, "scene.links: expected an integer, got 'many'"),
        ({"frequency": -1}, "scene.frequency: expected at least 0 Hz, got -1"),
        ({"floor_friction": 1e309}, "parameters.floor_friction: "),
        ({"sloep": 1}, "'sloep': unknown name; did you mean scene.slope?"),
        ({"setup": 1}, "'setup': unknown name"),
        ({"frame_interval": 1e-6}, "'frame_interval': unknown name"),
        ({"on_progress": 1}, "'on_progress': unknown name"),
        ({"device": "cuda"}, "options.device: not possible on a live page"),
        ({"record_interval": 1e-6}, "options.record_interval: not possible on a live page"),
        ({"preset": "none"}, "preset: "),
        ({"preset": {}}, "preset: "),
        ({"seed": -1}, "seed: "),
        ({"slope": 10, "floor": [[0, 0], [1, 0]]}, "scene.slope: not possible with a profile"),
        ({"index": 3, "preset": None}, "index: no sweep is open"),
        ({"push": []}, "push: "),
        ({"push": [[0.1, 0, 0.1]]}, "push[0]"),
        ({"push": [[0.1, 99, 0.1, 0]]}, "push: expected a link of 0 to 39, got 99"),
        ({"push": [[99.0, 0, 0.1, 0]]}, "t: expected 0 to "),
        ({"push": "x"}, "push: "),
    ],
)
def test_refusals_are_those_of_the_package(asked: dict[str, Any], told: str, server: LiveServer) -> None:
    """One line that begins with the field, so that the page can show it beside the slider."""
    status, text = ask(server, "/walk", FIRST | asked)
    assert status in (200, 400)
    line = messages(text)[-1]["error"] if status == 200 else text
    assert line.startswith(told), line


def test_whoever_leaves_ends_the_walk(server: LiveServer) -> None:
    """Ten requests a second, each given up for the next one: all their walks end, and the next one is answered."""
    before = walking()  # requests of earlier tests, which may end meanwhile
    for number in range(10):
        line = socket.create_connection(("127.0.0.1", server.server_port), timeout=60)
        body = json.dumps(LONG | {"frequency": 10 + number}).encode()
        head = f"POST /walk HTTP/1.1\r\nHost: 127.0.0.1:{server.server_port}\r\nX-Token: {server.token}\r\n"
        line.sendall(f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body)
        time.sleep(0.1)
        line.close()
    began = time.monotonic()
    assert messages(ask(server, "/walk", FIRST)[1])[-1]["end"]["status"] == "at_rest"
    while walking() - before and time.monotonic() < began + 20:
        time.sleep(0.05)
    assert not walking() - before


def test_several_tabs(server: LiveServer) -> None:
    """Requests at the same time, more than walks are computed at once, each get their own walk and its pushes."""
    asked = [FIRST | {"floor_friction": 0.2 + number / 20, "push": [[0.1, 6, 0.02, 0.01]]} for number in range(6)]
    alone = [messages(ask(server, "/walk", each)[1])[-1]["end"]["dx"] for each in asked]
    with ThreadPoolExecutor(len(asked)) as threads:
        answers = [*threads.map(lambda each: ask(server, "/walk", each)[1], asked)]
    assert [messages(text)[-1]["end"]["dx"] for text in answers] == alone and len({*alone}) == 6


@pytest.mark.parametrize(
    "request_line",
    [
        "PUT /walk HTTP/1.1",
        "OPTIONS /walk HTTP/1.1",
        "TRACE / HTTP/1.1",
        "GET " + "/" * 70_000 + " HTTP/1.1",
        "GET http://evil.example/ HTTP/1.1",
        "nonsense",
    ],
)
def test_what_is_not_http(request_line: str, server: LiveServer) -> None:
    """Other methods, endless addresses and other sites' addresses get an error and no token, and the server goes on."""
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=10) as line:
        with suppress(ConnectionError):  # it may answer before it has read everything
            line.sendall(f"{request_line}\r\nHost: 127.0.0.1:{server.server_port}\r\n\r\n".encode())
        answer = b""
        with suppress(ConnectionError):
            while piece := line.recv(65536):
                answer += piece
    assert b" 200 " not in answer and server.token.encode() not in answer
    assert ask(server, "/walk", {"links": 31})[0] == 200


def test_a_walk_without_end_is_ended(server: LiveServer, monkeypatch: pytest.MonkeyPatch) -> None:
    """After its time, or with too many frames, one line says what to give less of."""
    monkeypatch.setattr("warpchain.live_page.asked_walks.MOST_SECONDS", 0.5)
    assert "scene.walk_limit: " in ask(server, "/walk", LONG)[1]
    monkeypatch.setattr("warpchain.live_page.asked_walks.MOST_SECONDS", 60.0)
    monkeypatch.setattr("warpchain.live_page.asked_walks.MOST_NUMBERS", 4000)
    assert "scene.walk_limit: " in ask(server, "/walk", LONG)[1]


def test_many_silent_connections(server: LiveServer) -> None:
    """More connections than the server takes are closed at once; when the others leave, it goes on."""
    lines = [socket.create_connection(("127.0.0.1", server.server_port)) for _ in range(MOST_CONNECTIONS + 5)]
    time.sleep(0.5)
    lines[-1].settimeout(5)
    assert lines[-1].recv(1) == b""
    for line in lines:
        line.close()
    time.sleep(0.5)
    assert ask(server, "/walk", {"links": 31})[0] == 200


@pytest.mark.parametrize(
    "head", ["GET /", "POST /walk HTTP/1.1\r\nHost: {}\r\nX-Token: {}\r\nContent-Length: 9999\r\n\r\n"]
)
def test_a_request_that_trickles_in_is_given_up(server: LiveServer, monkeypatch: pytest.MonkeyPatch, head: str) -> None:
    """However often another byte of it comes, head or body: its time is one of the whole."""
    monkeypatch.setattr("warpchain.live_page.server.HASTE", 0.4)
    with socket.create_connection(("127.0.0.1", server.server_port)) as line:
        began = time.monotonic()
        line.settimeout(0.05)
        line.sendall(head.format(f"127.0.0.1:{server.server_port}", server.token).encode())
        with suppress(ConnectionError):  # it is reset or ends
            while time.monotonic() - began < 5:
                line.sendall(b"1")
                with suppress(TimeoutError):
                    if not line.recv(4096):
                        break
        assert time.monotonic() - began < 3
    assert ask(server, "/walk", {"links": 31})[0] == 200


def test_samples_are_those_of_the_library(server: LiveServer) -> None:
    """A sample is the walk of `warpchain.walk` with its seed, without frames; a seed that is none is refused."""
    for setup, seed in ((FIRST, 3), (FIRST | {"floor_friction": 0.6}, 4)):
        told = messages(ask(server, "/sample", setup | {"seed": seed})[1])
        walk = warpchain.walk(**setup, seed=seed)
        assert [*told[-1]] == ["end", "path"] and told[-1]["end"]["dx"] == walk.dx and len(told) == 1
        assert 100 < len(told[-1]["path"]) <= 400
        assert told[-1]["path"][0] == (walk.center[0] * 1e4).round().astype(int).tolist()
    for wrong, word in (
        ({"seed": -1}, "seed"),
        ({"seed": "x"}, "seed"),
        ({"links": 31}, "scene.links"),
        ({"index": 0}, "index"),
    ):
        assert messages(ask(server, "/sample", FIRST | {"seed": 0} | wrong)[1])[-1]["error"].startswith(f"{word}: ")


def test_what_is_pushed_goes_on_from_its_state(server: LiveServer) -> None:
    """A push is an impulse on the state of the walk at that time, once and twice."""
    walk, pushes = warpchain.walk(**FIRST), [[0.1, 6, 0.02, 0.01], [0.2, 7, 0.0, 0.05]]
    for count, (moment, link, *impulse) in enumerate(pushes, 1):
        state = walk.state(moment)
        mass = [walk.setup.parameters.inner_mass, walk.setup.parameters.outer_mass][link % 2]
        velocity = state.velocity.copy()
        velocity[link, :2] += [part / mass for part in impulse]
        walk = warpchain.walk(start=replace(state, velocity=velocity))
        told = messages(ask(server, "/walk", FIRST | {"push": pushes[:count]})[1])
        assert told[-1]["end"]["dx"] == walk.dx


@pytest.mark.skipif(sys.platform == "win32", reason="other signals")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_no_process_stays(number: signal.Signals, tmp_path: Path) -> None:
    """Ctrl-C and SIGTERM end the command within two seconds, also while walks are computed, and free its port."""
    command = [sys.executable, "-m", "warpchain", "live", "--no-browser"]
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        cwd=tmp_path,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    ) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        port, token = int(url.split(":")[2].split("/")[0]), url.partition("token=")[2]
        line = socket.create_connection(("127.0.0.1", port), timeout=60)
        body = json.dumps(LONG).encode()
        head = (
            f"POST /walk HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Token: {token}\r\nContent-Length: {len(body)}\r\n\r\n"
        )
        line.sendall(head.encode() + body)
        while b"first" not in line.recv(65536):  # the walk is under way
            pass
        began = time.monotonic()
        process.send_signal(number)
        _, told = process.communicate(timeout=20)
        assert time.monotonic() - began < 2.0
    assert (process.returncode, told) == ((130, "interrupted\n") if number == signal.SIGINT else (-signal.SIGTERM, ""))
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.1", port), timeout=2)


def test_the_page_is_small(server: LiveServer) -> None:
    """It is less than 100 kB, and a request of the greatest floor is taken."""
    assert len(server.page.encode()) < 100_000
    floor = [[k / 97, 0.001 * (k % 2)] for k in range(256)]
    assert len(json.dumps(FIRST | {"floor": floor})) < MOST_BYTES
