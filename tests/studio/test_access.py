"""Who is let in: everything else is refused before anything is served, said, and harms nothing."""

from __future__ import annotations

import hmac

import pytest
from tests.studio.conftest import Serving
from tests.studio.talking import UPGRADE, alive, answer, get, own, window
from websockets.exceptions import InvalidStatus

from truearm.engine.base.errors import InputError
from truearm.engine.base.parts import is_loopback
from truearm.studio import access as module
from truearm.studio.access import Access, listening_socket

TOKEN = "a-token-that-nobody-guesses"


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


def test_so_many_windows_are_open_and_no_more(serving: Serving, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_WINDOWS", 1)
    studio = serving()
    with window(studio), pytest.raises(InvalidStatus) as refused, window(studio):
        pass
    assert refused.value.response.status_code == 503


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
