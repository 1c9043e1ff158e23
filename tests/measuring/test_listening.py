"""Lines over TCP: nothing without the token, nothing too long or too fast, and an answer for each."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from truearm.engine.base.errors import InputError
from truearm.measuring.campaign import Campaign
from truearm.measuring.session import Quality, Session
from truearm.measuring.sources import HOST, LONGEST_LINE, MOST_CONNECTIONS, MOST_LINES, Listener

TOKEN = "a-token-of-the-tests"


class Port:
    """A campaign that listens, and a program that talks to it, in one thread."""

    def __init__(self, folder: Path) -> None:
        self.listener = Listener(0, TOKEN, clock=lambda: 5.0)
        session = Session(("P1", "P 2"), ("a", "b"), (), 10, Quality(deviation=5e-5))
        self.campaign = Campaign(session, self.listener, folder)
        self.streams: list[socket.socket] = []

    def connect(self, greeting: str | None = f"token {TOKEN}") -> socket.socket:
        stream = socket.create_connection((HOST, self.listener.port), timeout=5.0)
        self.streams.append(stream)
        if greeting is not None:
            stream.sendall(f"{greeting}\n".encode())
        self.turn()
        return stream

    def turn(self) -> None:
        for _ in range(4):
            self.campaign.step(0.02)

    def say(self, stream: socket.socket, line: str) -> str:
        stream.sendall(f"{line}\n".encode())
        self.turn()
        return heard(stream)

    @property
    def codes(self) -> list[str]:
        return [notice.code for notice in self.listener.notices]

    def close(self) -> None:
        for stream in self.streams:
            stream.close()
        self.campaign.close()


def heard(stream: socket.socket) -> str:
    stream.settimeout(2.0)
    try:
        return stream.recv(4096).decode()
    except ConnectionResetError:
        return ""


@pytest.fixture
def port(tmp_path: Path) -> Iterator[Port]:
    result = Port(tmp_path)
    yield result
    result.close()


def test_a_program_with_the_token_is_told_what_became_of_each_line(port: Port) -> None:
    stream = port.connect()
    assert heard(stream) == "ok; next P1 a\n"
    words = port.say(stream, "reading a 1.5 2 3 mm samples=20 deviation=0.01 sigma=0.02 time=12.5")
    assert words == "kept 1; next P1 b\n"
    assert port.say(stream, "reading b 0.001 2 3 m at=P1 deviation=0.0001") == (
        "aside 2 scatter 0.1000 mm, up to 0.0500 mm is allowed; next P1 b\n"
    )
    assert port.say(stream, "left P1 b behind the arm") == "left 3; next 'P 2' a\n"
    assert port.say(stream, 'reading a 1 2 4 um "at=P 2" q=1,0,0,0') == "kept 4; next 'P 2' b\n"
    assert port.say(stream, "reading b 1 2 5 in breaks=1") == "aside 5 beam-break; next 'P 2' b\n"
    assert port.say(stream, "reading b 1 2 5 in") == "kept 6; nothing is left\n"
    assert port.campaign.session.done
    first = port.campaign.session.entries[0].reading
    assert first is not None
    assert (first.position * 1e3).tolist() == pytest.approx([1.5, 2.0, 3.0])
    assert (first.time, first.samples) == (12.5, 20)
    assert first.sigma == pytest.approx(2e-5)
    assert TOKEN not in (port.campaign.log.path).read_text()


REFUSED = {
    "reading a 1 2 3": "three coordinates and their unit",
    "reading a 1 2 3 furlong": "unit of length",
    "reading a 1 nan 3 mm": "number belongs here",
    "reading a 1 1e999 3 mm": "number belongs here",
    "reading a 1 2 1e30 mm": "too large to be plausible",
    "reading a 1 2 3 mm colour=red": "cannot stand here",
    "reading a 1 2 3 mm samples=2 samples=3": "cannot stand here",
    "reading a 1 2 3 mm samples=-1": "count belongs here",
    "reading a 1 2 3 mm deviation=-1": "number belongs here",
    "reading a 1 2 3 mm q=1,1,0,0": "length 1",
    "reading a 1 2 3 mm q=1,0": "length 1",
    "left P1": "by its configuration and its name",
    "left P7 a": "no such configuration",
    "erase everything": "no such line",
    'reading "a 1 2 3 mm': "no such line",
}


def test_a_line_that_cannot_be_taken_is_refused_and_counted(port: Port) -> None:
    stream = port.connect()
    heard(stream)
    for line, word in REFUSED.items():
        words = port.say(stream, line)
        assert words.startswith("refused "), line
        assert word in words
        assert len(words) <= LONGEST_LINE + 1
        assert port.codes == ["lines-refused"]
        assert len(port.campaign.session) == 0
    assert port.say(stream, "reading a 1 2 3 mm").startswith("kept 1")


def test_without_the_token_nothing_is_taken(port: Port) -> None:
    for greeting in ("token wrong", "token", f"reading a 1 2 3 mm {TOKEN}", f"TOKEN {TOKEN}", "\ud83d"):
        stream = port.connect(None)
        stream.sendall(greeting.encode("utf-8", "surrogatepass") + b"\nreading a 1 2 3 mm\n")
        port.turn()
        assert heard(stream) == "refused this is not the token\n", greeting
        assert heard(stream) == ""
        assert port.codes == ["lines-refused"]
    assert len(port.campaign.session) == 0
    assert TOKEN not in "".join(port.listener.messages())


def test_a_line_without_end_is_cut_off_early(port: Port) -> None:
    stream = port.connect()
    heard(stream)
    stream.setblocking(False)
    sent = 0
    for _ in range(2000):  # of a gigabyte
        try:
            sent += stream.send(b"x" * 65536)
        except BlockingIOError:
            port.turn()
        except OSError:
            break
        if not port.listener._clients:
            break
        port.turn()
    assert not port.listener._clients
    assert sent < 20_000_000
    assert port.codes == ["lines-refused"]
    again = port.connect()
    assert heard(again).startswith("ok")


def test_who_sends_too_many_lines_is_cut_off(port: Port) -> None:
    stream = port.connect()
    heard(stream)
    stream.sendall(b"reading zz 1 2 3 mm\n" * (2 * MOST_LINES))
    for _ in range(10):
        port.turn()
    assert port.codes == ["lines-refused"]
    assert len(port.campaign.session) <= MOST_LINES + 5


def test_too_many_connections_and_silent_ones_are_ended(port: Port, monkeypatch: pytest.MonkeyPatch) -> None:
    silent = [port.connect(None) for _ in range(MOST_CONNECTIONS)]
    more = port.connect()
    assert heard(more) == "refused too many connections\n"
    monkeypatch.setattr("truearm.measuring.sources.PATIENCE", 0.0)
    port.turn()
    assert all(heard(stream) == "" for stream in silent)
    monkeypatch.undo()
    assert heard(port.connect()).startswith("ok")


def test_it_listens_on_loopback_alone_and_names_a_free_port(port: Port) -> None:
    assert port.listener._bound.getsockname()[0] == "127.0.0.1"
    with pytest.raises(InputError, match="another program listens on this port") as refusal:
        Listener(port.listener.port)
    assert refusal.value.parameter == "listen"
    cure = refusal.value.cure or ""
    free = int("".join(c for c in cure if c.isdigit()))
    Listener(free).close()


def test_a_port_that_is_the_systems_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    class Forbidden(socket.socket):
        def bind(self, _: object) -> None:
            raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(socket, "socket", Forbidden)
    with pytest.raises(InputError, match="cannot be used by everyone") as refusal:
        Listener(80)
    assert refusal.value.parameter == "listen"


def test_a_token_is_made_where_none_is_given() -> None:
    listeners = [Listener(0) for _ in range(2)]
    for listener in listeners:
        listener.close()
    assert len({listener.token for listener in listeners}) == 2
    assert min(len(listener.token) for listener in listeners) >= 32
