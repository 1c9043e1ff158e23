"""Who may talk to the studio, and what it takes: everything else is refused, said, and harms nothing."""

from __future__ import annotations

import hmac
import json
import socket
import threading
import time
from contextlib import suppress
from typing import Any

import msgspec
import pytest
import viser
import websockets.asyncio.server
from tests.studio.conftest import Serving
from tests.studio.talking import CAMERA, answer, get, send, window
from websockets.exceptions import ConnectionClosed, InvalidStatus

from truearm.errors import InputError
from truearm.studio import gate as module
from truearm.studio.gate import Access, Gate, is_loopback, listening_socket, start_server
from truearm.studio.serving import Studio

TOKEN = "a-token-that-nobody-guesses"


def alive(studio: Studio) -> bool:
    """Return whether the page is still served and a window still works."""
    cookie = {} if studio.access.token is None else {"Cookie": f"{studio.access.cookie}={studio.access.token}"}
    status, _, body = get(studio, **cookie)
    with window(studio, headers=cookie) as line:
        send(line, **CAMERA)
        return status == 200 and b"<html" in body and len(line.recv(30)) > 100


def eventually(condition: Any, seconds: float = 30.0) -> bool:
    """Return whether a condition holds, now or soon."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.01)
    return True


def is_closed(line: Any) -> bool:
    """Return whether the other end closes a connection."""
    try:
        while True:
            line.recv(30)
    except ConnectionClosed:
        return True
    except TimeoutError:
        return False


def own(studio: Studio) -> str:
    return f"127.0.0.1:{studio.access.port}"


UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec_WebSocket_Version": "13",
}


def test_the_page_is_served_to_this_machine_with_headers_that_keep_it_to_itself(serving: Serving) -> None:
    studio = serving()
    status, headers, body = get(studio)
    assert status == 200
    assert b"<html" in body
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    assert headers["X-Frame-Options"] == "DENY"
    assert f"connect-src 'self' ws://{own(studio)} data: blob:" in headers["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert alive(studio)


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8080", "", "127.0.0.1@evil.example", "10.1.2.3", "127.0.0.1:x", "[::1"]
)
def test_a_rebound_name_of_this_machine_is_refused(serving: Serving, host: str) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    for headers in ({}, {**UPGRADE, "Origin": f"http://{host}"}):
        status, answered, body = get(studio, Host=host, **headers)
        assert status in (400, 403)
        assert b"<html" not in body
        assert answered["Referrer-Policy"] == "no-referrer"
    assert len(said) >= 1
    assert all(text.startswith("refused: ") for text in said)
    assert alive(studio)


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", None, "http://127.0.0.1:1", "https://127.0.0.1", "file://"]
)
def test_a_page_of_another_origin_is_refused_before_its_connection_is_accepted(
    serving: Serving, origin: str | None
) -> None:
    studio = serving()
    with pytest.raises(InvalidStatus) as refused, window(studio, origin=origin):
        pass
    assert refused.value.response.status_code == 403
    assert alive(studio)


def test_two_headers_of_one_name_are_refused(serving: Serving) -> None:
    studio = serving()
    for twice in (f"Host: {own(studio)}\nHost: evil.example\n", "", f"Host: {own(studio)}\nOrigin: a\nOrigin: b\n"):
        assert answer(studio, f"GET / HTTP/1.1\n{twice}\n").startswith(b"HTTP/1.1 400")
    assert alive(studio)


@pytest.mark.parametrize("brought", [None, "qqqq", TOKEN[:-1], TOKEN + "x", "\u00e4", "%s"])
def test_without_the_token_nothing_is_served_and_no_connection_accepted(serving: Serving, brought: str | None) -> None:
    said: list[str] = []
    studio = serving(token=TOKEN, say=said.append)
    cookie = {} if brought is None else {"Cookie": f"{studio.access.cookie}={brought}"}
    status, _, body = get(studio, **cookie)
    assert status == 401
    assert b"<html" not in body
    status, _, _ = get(studio, Origin=f"http://{own(studio)}", **UPGRADE, **cookie)
    assert status == 401
    if brought is not None and brought.isascii():
        status, answered, _ = get(studio, f"/?token={brought}")
        assert status == 401
        assert "Set-Cookie" not in answered
    assert said
    assert not any(TOKEN[:-1] in text or (brought and brought in text) for text in said)


def test_the_token_of_the_address_becomes_a_cookie_that_scripts_and_other_sites_do_not_have(serving: Serving) -> None:
    studio = serving(token=TOKEN)
    assert studio.access.entrance == f"http://{own(studio)}/?token={TOKEN}"
    status, headers, body = get(studio, f"/?token={TOKEN}")
    assert status == 200
    name, *flags = headers["Set-Cookie"].split("; ")
    assert name == f"{studio.access.cookie}={TOKEN}"
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} == set(flags)
    assert TOKEN.encode() not in body
    assert headers["Referrer-Policy"] == "no-referrer"
    assert alive(studio)


def test_tokens_are_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    compared: list[tuple[bytes, bytes]] = []

    def compare(one: bytes, other: bytes) -> bool:
        compared.append((one, other))
        return one == other

    monkeypatch.setattr(hmac, "compare_digest", compare)
    access = Access("127.0.0.1", 1, TOKEN, frozenset())
    assert [access.admits(one) for one in (TOKEN, None, "x", "\udcff")] == [True, False, False, False]
    assert len(compared) == 4


@pytest.mark.parametrize(
    "path", ["/?websocket=ws://evil.example", "/?playbackPath=http://evil.example/a", "/?", "/?token=x", "//?a#b"]
)
def test_an_address_that_names_another_server_is_refused(serving: Serving, path: str) -> None:
    studio = serving()
    status, _, body = get(studio, path)
    assert (status, b"<html" in body) == ((200, True) if path == "/?" else (404, False))


@pytest.mark.parametrize(
    "path",
    [
        "/../../../../etc/passwd",
        "/..%2f..%2f..%2fetc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/..\\..\\x",
        "/%00",
        "/a\x01b",
    ],
)
def test_paths_lead_nowhere(serving: Serving, path: str) -> None:
    studio = serving()
    assert b"root:" not in answer(studio, f"GET {path} HTTP/1.1\nHost: {own(studio)}\n\n")
    assert alive(studio)


@pytest.mark.parametrize(
    "request_bytes",
    [
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000000000\r\n\r\n" + b"x" * 100_000,
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1000000000\r\n\r\n" + b"x" * 100_000,
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"x" * 1_000_000 + b"\r\n\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(300),
        b"\r\n\r\n",
        bytes(range(256)) * 100 + b"\r\n\r\n",
    ],
)
def test_what_is_no_request_of_a_page_is_refused(serving: Serving, request_bytes: bytes) -> None:
    studio = serving()
    assert b"<html" not in answer(studio, request_bytes, 1.0)
    assert alive(studio)


def frame(first: int, length: bytes, content: bytes = b"") -> bytes:
    """Return a frame of the web socket protocol, masked with zeros."""
    return bytes([first]) + length + bytes(4) + content


@pytest.mark.parametrize(
    "sent",
    [
        frame(0x82, b"\xff" + (10**9).to_bytes(8, "big"), bytes(200_000)),  # 1 GB announced, sent in part
        frame(0x82, b"\xff" + (2**63 + 5).to_bytes(8, "big")),
        frame(0xF2, b"\x81", b"x"),
        frame(0x83, b"\x81", b"x"),
        b"\x82\x01x",  # not masked
        frame(0x81, b"\x82", b"\xff\xfe"),
        frame(0x89, b"\xfe\xff\xff", bytes(65535)),
    ],
)
def test_malformed_frames_close_their_connection_alone(serving: Serving, sent: bytes) -> None:
    studio = serving()
    lines = "".join(f"{name.replace('_', '-')}: {value}\r\n" for name, value in UPGRADE.items())
    request = f"GET / HTTP/1.1\r\nHost: {own(studio)}\r\nOrigin: http://{own(studio)}\r\n{lines}"
    request += f"Sec-WebSocket-Protocol: viser-v{viser.__version__}\r\n\r\n"
    with window(studio) as other:
        send(other, **CAMERA)
        with socket.create_connection(("127.0.0.1", studio.access.port), timeout=2) as raw:
            raw.sendall(request.encode())
            assert raw.recv(12) == b"HTTP/1.1 101"
            with suppress(ConnectionError, TimeoutError):
                raw.sendall(sent)
                while raw.recv(1 << 16):
                    pass
        send(other, **CAMERA)
        assert len(other.recv(5)) > 0
    assert alive(studio)


@pytest.mark.parametrize(
    "sent",
    [
        "a text",
        b"",
        b"\xc1",
        msgspec.msgpack.encode([1, 2]),
        msgspec.msgpack.encode({"no": "type"}),
        msgspec.msgpack.encode({"type": "ViewerCameraMessage"}),
        msgspec.msgpack.encode({**CAMERA, "more": 1}),
        msgspec.msgpack.encode({**CAMERA, 5: 1}),
        b"\x91" * 200_000,
    ],
)
def test_malformed_messages_close_their_connection_alone(serving: Serving, sent: bytes | str) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    with window(studio) as line:
        line.send(sent)
        assert is_closed(line)
    assert any(text.startswith("refused: a ") for text in said)
    assert alive(studio)


@pytest.mark.parametrize("kind", ["ShareUrlRequest", "RunJavascriptMessage", "ResetGuiMessage", "Nonsense", "type"])
def test_messages_that_no_window_sends_are_dropped(serving: Serving, kind: str) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    with window(studio) as line:
        send(line, **CAMERA)
        send(line, type=kind)
        assert eventually(lambda: any(kind in text for text in said))
        send(line, **CAMERA)
    assert alive(studio)


def working(studio: Studio, line: Any) -> None:
    """Let a window be the one that works."""
    send(line, **CAMERA)
    assert eventually(lambda: len(studio.window.server.get_clients()) > 0)
    assert eventually(lambda: studio.window.gate._working is not None)  # which is said a little later


def element(studio: Studio, label: str) -> str:
    """Return the name by which messages call an element."""
    handles = studio.window.gui._gui_input_handle_from_uuid
    return next(name for name, handle in handles.items() if getattr(handle, "label", None) == label)


def test_only_the_value_of_an_element_can_be_changed(serving: Serving) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    robot = element(studio, "Robot")
    with window(studio) as line:
        working(studio, line)
        send(line, type="GuiUpdateMessage", uuid=robot, updates={"removed": True, "update_cb": []})
        assert eventually(lambda: any("otherwise" in text for text in said))
        send(line, type="GuiUpdateMessage", uuid=robot, updates={"value": "kr5"})
        assert eventually(lambda: studio.window.project.settings.robot == "kr5")

        def shown_value() -> Any:
            return studio.window.gui._gui_input_handle_from_uuid[robot].value

        for count, value in enumerate(("../../etc/passwd", "/etc/passwd", "C:\\x", "a\nb"), 1):
            send(line, type="GuiUpdateMessage", uuid=robot, updates={"value": value})
            assert eventually(lambda wanted=count: studio.window._notices.content.count("no place") == wanted)
            assert eventually(lambda: shown_value() == "kr5")  # what was refused is taken back before one types again
        send(line, type="GuiUpdateMessage", uuid=robot, updates={"value": "<script>alert(1)</script>"})
        assert eventually(lambda: "script" in studio.window.project.settings.robot)
    shown = [getattr(one, "content", "") for one in studio.window.gui._gui_input_handle_from_uuid.values()]
    assert "<script>" not in studio.window._notices.content + "".join(shown)
    assert alive(studio)


def upload(line: Any, uuid: str, name: str, content: bytes, size: int, parts: int = 1) -> None:
    send(
        line,
        type="FileTransferStartUpload",
        source_component_uuid=uuid,
        transfer_uuid=name,
        filename=name,
        mime_type="text/csv",
        part_count=parts,
        size_bytes=size,
    )
    for number in range(parts):
        with suppress(ConnectionClosed):  # by the other end, which has seen enough
            send(
                line,
                type="FileTransferPart",
                source_component_uuid=uuid,
                transfer_uuid=name,
                part_index=number,
                content=content,
            )


def test_uploads_are_taken_in_and_those_too_large_are_refused_before_they_come(serving: Serving) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    button = element(studio, "Take a file into the project")
    with window(studio) as line:
        working(studio, line)
        upload(line, button, "a.csv", b"one,two\n", 8)
        assert eventually(lambda: (studio.window.project.folder / "a.csv").exists())
        upload(line, button, "huge.csv", bytes(100_000), 10**9, 2)
        assert eventually(lambda: any("too large to be taken in: 1000000000 bytes" in text for text in said))
        for name in ("../b.csv", "/tmp/b.csv", "..\\b.csv", ".hidden", "truearm-studio.yaml", "a\nb.csv", "b/c.csv"):
            upload(line, button, name, b"x", 1)
        assert eventually(lambda: studio.window._notices.content.count("Error (refused)") == 7)
        states = studio.window.gui._current_file_upload_states
        assert states == {}
    there = sorted(path.name for path in studio.window.project.folder.iterdir())
    assert there == ["a.csv", "truearm-studio.yaml"]
    assert not list(studio.window.project.folder.parent.glob("b.csv"))
    assert alive(studio)


def test_more_of_a_file_than_was_announced_closes_the_connection(serving: Serving) -> None:
    said: list[str] = []
    studio = serving(say=said.append)
    button = element(studio, "Take a file into the project")
    with window(studio) as line:
        working(studio, line)
        upload(line, button, "lie.csv", bytes(200_000), 100, 3)
        assert is_closed(line)
    assert any("more of a file than was announced" in text for text in said)
    assert not (studio.window.project.folder / "lie.csv").exists()
    assert eventually(lambda: not studio.window.gui._current_file_upload_states)
    assert alive(studio)


def test_a_second_window_reads_until_it_takes_over(serving: Serving) -> None:
    studio = serving()
    robot = element(studio, "Robot")
    with window(studio) as first, window(studio) as second:
        working(studio, first)
        send(second, **CAMERA)
        assert eventually(lambda: len(studio.window._banners) == 1)
        (offer,) = studio.window.gate.offers
        send(second, type="GuiUpdateMessage", uuid=robot, updates={"value": "kr5"})
        send(second, type="GuiUpdateMessage", uuid=offer, updates={"value": True})
        assert eventually(lambda: offer not in studio.window.gate.offers)
        assert studio.window.project.settings.robot == "irb120"
        assert eventually(lambda: len(studio.window._banners) == 1)  # now the first one reads
        send(first, type="GuiUpdateMessage", uuid=robot, updates={"value": "ur5"})
        send(second, type="GuiUpdateMessage", uuid=robot, updates={"value": "ur10"})
        assert eventually(lambda: studio.window.project.settings.robot == "ur10")


def test_so_many_windows_are_open_and_no_more(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WINDOWS", 1)
    studio = serving()
    with window(studio), pytest.raises(InvalidStatus) as refused, window(studio):
        pass
    assert refused.value.response.status_code == 503


def test_the_same_refusal_is_said_once_in_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    gate = Gate(Access("127.0.0.1", 1, None, frozenset()), said.append)
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    for moment in (0.0, 0.5, 1.5):
        now[0] = moment
        gate._tell("refused: it")
    assert said == ["refused: it"] * 2


# -- what is relied on of viser ------------------------------------------------------------------------------


def test_viser_listens_by_the_one_function_that_is_replaced_and_it_is_put_back(serving: Serving) -> None:
    listen = websockets.asyncio.server.serve
    studio = serving()
    assert websockets.asyncio.server.serve is listen
    (connection,) = [type(one) for one in _connections(studio)]
    assert connection.__name__ == "Watched"


def _connections(studio: Studio) -> list[Any]:
    with window(studio) as line:
        working(studio, line)
        return list(studio.window.server._websock_server._live_connections.values())


def test_a_viser_that_listens_otherwise_serves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    class Other:
        def __init__(self, **_: Any) -> None:
            self.stopped = False

        def get_port(self) -> int:
            return 1

        def stop(self) -> None:
            self.stopped = True

    monkeypatch.setattr(viser, "ViserServer", Other)
    with listening_socket("127.0.0.1", 0) as bound, pytest.raises(RuntimeError, match="does not listen"):
        start_server(Gate(Access("127.0.0.1", 0, None, frozenset())), bound, "x")


def test_the_port_is_not_moved_by_an_environment_variable(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "1")
    studio = serving()
    assert studio.window.server.get_port() == studio.access.port
    assert get(studio)[0] == 200


def test_messages_of_windows_have_the_fields_that_are_looked_at() -> None:
    from viser import _messages

    fields = {
        "GuiUpdateMessage": {"uuid", "updates"},
        "FileTransferStartUpload": {"transfer_uuid", "size_bytes", "part_count"},
        "FileTransferPart": {"transfer_uuid", "content"},
    }
    for kind, names in fields.items():
        assert names <= set(getattr(_messages, kind).__dataclass_fields__)
    for kind in module._LOOKING | module._WORKING:
        assert hasattr(_messages, kind)
    assert json.dumps(sorted(module._LOOKING & module._WORKING)) == "[]"


# -- where it listens ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("host", "is_one"), [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False)]
)
def test_loopback(host: str, is_one: bool) -> None:
    assert is_loopback(host) is is_one


def test_a_port_in_use_is_refused_and_a_free_one_named() -> None:
    with listening_socket("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match="another program listens on this port") as refused:
            listening_socket("127.0.0.1", port)
    free = int(str(refused.value.cure).split("port=")[1].split("`")[0])
    assert free != port
    listening_socket("127.0.0.1", free).close()


@pytest.mark.parametrize("host", ["192.0.2.1", "no.such.host.invalid", "not an address"])
def test_a_host_of_another_machine_is_refused(host: str) -> None:
    with pytest.raises(InputError, match="no address of this machine"):
        listening_socket(host, 0)


def test_beyond_loopback_a_token_is_made_and_numbers_and_own_names_are_known(serving: Serving) -> None:
    studio = serving(host="0.0.0.0")
    assert studio.access.token is not None
    assert len(studio.access.token) >= 32
    assert studio.access.knows("10.1.2.3")
    assert not studio.access.knows("evil.example")
    assert get(studio)[0] == 401
    assert alive(studio)


def test_many_windows_at_once_are_served(serving: Serving) -> None:
    studio = serving()
    seen: list[int] = []

    def one() -> None:
        with window(studio) as line:
            send(line, **CAMERA)
            seen.append(len(line.recv(5)))

    threads = [threading.Thread(target=one) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(seen) == 8


def test_every_list_offers_texts_that_are_not_empty_as_others_would_stop_the_page(serving: Serving) -> None:
    handles = serving().window.gui._gui_input_handle_from_uuid.values()
    lists = [handle.options for handle in handles if hasattr(handle, "options")]
    assert len(lists) > 8
    assert all(isinstance(option, str) and option for options in lists for option in options)
