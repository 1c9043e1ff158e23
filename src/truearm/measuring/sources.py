"""What readings come from; also readings sent by a program of this machine, over TCP."""

from __future__ import annotations

import hmac
import math
import secrets
import selectors
import shlex
import socket
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, Protocol

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, printable, shortened
from truearm.engine.base.units import LENGTH_UNITS, as_number, sized_si, to_si
from truearm.engine.data.readers.rows import QUATERNION_TOLERANCE
from truearm.measuring.session import Entry, Reading, Session


def _nobody(entry: Entry) -> None:
    """Tell nobody."""


@dataclass(frozen=True, eq=False)
class Incoming:
    """What came."""

    reading: Reading | None = None  #: That was read; None where a point is left out.
    #: Configuration and name of the point that is left out, and why in words; None for a reading.
    left: tuple[str, str, str] | None = None
    reply: Callable[[Entry], None] = _nobody  #: Called with what became of it, once that is on disk.
    refuse: Callable[[str], None] = lambda words: None  #: Called with words where it cannot be taken.


class Source(Protocol):
    """A virtual instrument, a folder that is watched, or a port that is listened to."""

    @property
    def kind(self) -> str:
        """``virtual``, ``watch`` or ``listen``."""

    @property
    def waiting(self) -> str:
        """For what it waits, in words."""

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know about it so far."""

    def poll(self, session: Session, seconds: float) -> list[Incoming]:
        """Return what has come, or comes within some time."""

    def messages(self) -> list[str]:
        """Return what is to be said of what could not be read, once each."""

    def close(self) -> None:
        """Let go of what it holds."""


HOST: Final = "127.0.0.1"
#: A line has no more bytes; who sends more is cut off.
LONGEST_LINE: Final = 1000
#: So many programs are connected at once.
MOST_CONNECTIONS: Final = 4
#: So many lines a second a connection sends, with as many at once; who sends more is cut off.
MOST_LINES: Final = 50
#: How long a connection may be without its token [s].
PATIENCE: Final = 5.0
_WORDS: Final = 200
#: So much is told at once; more is counted alone.
_MOST_MESSAGES: Final = 20
_KEYS: Final = ("at", "time", "sigma", "samples", "deviation", "settling", "breaks", "q")


@dataclass(eq=False)
class _Client:
    stream: socket.socket
    since: float
    known: bool = False
    unread: bytes = b""
    allowance: float = float(MOST_LINES)
    refilled: float = 0.0
    lines: int = 0


LINES_REFUSED: Final = Rule(
    "lines-refused",
    "warning",
    "lines that could not be taken, and connections that were ended: without the right token, too many, or with too "
    "much at once. Each was answered by a line that says why",
)


# Readings sent by a program of this machine, a line each, over TCP.
#
# Any program of this machine can reach loopback, and could forge points. So a connection begins with a token that only
# whoever started the measuring knows, and nothing is taken before. A line is words separated by blanks; names with
# blanks stand in double quotes::
#
#     token TOKEN
#     reading NAME X Y Z UNIT [at=LABEL] [time=SECONDS] [sigma=D] [samples=N] [deviation=D] [settling=D] [breaks=N]
#                             [q=W,X,Y,Z]
#     left LABEL NAME [WORDS]
#
# Lengths are in UNIT, one of ``mm``, ``m``, ``um``, ``in``. Every line is answered by one: ``kept 12``, ``aside 12
# scatter WORDS``, ``left 12``, or ``refused WORDS``, and then what comes next.
class Listener:
    """A source of readings: programs of this machine that know the token.

    Args:
        port: To listen on; 0 for any that is free.
        token: What a program must send first; a new one if None.
        clock: What time it is [s].

    Raises:
        InputError: If another program listens on the port; a free one is named.
    """

    kind: Final = "listen"

    def __init__(self, port: int, token: str | None = None, clock: Callable[[], float] = time.time) -> None:
        self.token = secrets.token_urlsafe(24) if token is None else token
        self._clock = clock
        self._bound = _listening_socket(port)
        self.port: int = self._bound.getsockname()[1]
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._bound, selectors.EVENT_READ)
        self._clients: dict[int, _Client] = {}
        self._messages: list[str] = []
        self._wrong_tokens = self._refused = self._cut_off = 0
        self._session: Session | None = None

    @property
    def waiting(self) -> str:
        """For what it waits."""
        return f"lines on port {self.port} of {HOST}"

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What was refused."""
        notices = []
        if self._wrong_tokens:
            notices.append(
                LINES_REFUSED(
                    f"{counted(self._wrong_tokens, 'connection')} without the right token "
                    f"{'was' if self._wrong_tokens == 1 else 'were'} refused."
                )
            )
        if self._refused:
            notices.append(LINES_REFUSED(f"{counted(self._refused, 'line')} that came could not be taken."))
        if self._cut_off:
            notices.append(
                LINES_REFUSED(
                    f"{counted(self._cut_off, 'connection')} sent too much at once, or connected beside too many "
                    "others, and was cut off."
                )
            )
        return tuple(notices)

    def poll(self, session: Session, seconds: float) -> list[Incoming]:
        """Return what connected programs send, waiting for the first line at most some time."""
        self._session = session
        until = time.monotonic() + seconds
        while True:
            incomings: list[Incoming] = []
            for key, _ in self._selector.select(max(0.0, min(until - time.monotonic(), PATIENCE / 5))):
                if key.fileobj is self._bound:
                    self._accept()
                else:
                    incomings += self._receive(self._clients[key.fd])
            self._drop_silent()
            if incomings or time.monotonic() >= until:
                return incomings

    def messages(self) -> list[str]:
        """Return what was refused since it was asked last."""
        messages, self._messages = self._messages, []
        return messages

    def close(self) -> None:
        """End all connections and free the port."""
        for client in [*self._clients.values()]:
            self._end(client)
        self._selector.close()
        self._bound.close()

    def _tell(self, words: str) -> None:
        if len(self._messages) < _MOST_MESSAGES:
            self._messages.append(words)

    def _accept(self) -> None:
        try:
            stream, _ = self._bound.accept()
        except OSError:
            return
        stream.setblocking(False)
        if len(self._clients) >= MOST_CONNECTIONS:
            self._cut_off += 1
            _send(stream, "refused too many connections")
            stream.close()
            return
        client = _Client(stream, time.monotonic(), refilled=time.monotonic())
        self._clients[stream.fileno()] = client
        self._selector.register(stream, selectors.EVENT_READ)

    def _receive(self, client: _Client) -> list[Incoming]:
        try:
            content = client.stream.recv(4096)
        except BlockingIOError:
            return []
        except OSError:
            content = b""
        if not content:
            self._end(client)
            return []
        *lines, client.unread = (client.unread + content).split(b"\n")
        incomings: list[Incoming] = []
        for line in lines:
            if client.stream.fileno() < 0:
                break
            if len(line) > LONGEST_LINE or not self._may_send(client):
                self._cut(client)
                break
            incomings += self._line(client, line)
        if len(client.unread) > LONGEST_LINE and client.stream.fileno() >= 0:
            self._cut(client)
        return incomings

    def _may_send(self, client: _Client) -> bool:
        instant = time.monotonic()
        client.allowance = min(float(MOST_LINES), client.allowance + (instant - client.refilled) * MOST_LINES) - 1.0
        client.refilled = instant
        return client.allowance >= 0.0

    def _line(self, client: _Client, line: bytes) -> list[Incoming]:
        try:
            words = shlex.split(line.decode().strip().replace("\\", "\\\\"))
        except ValueError:  # no UTF-8, or a quote that is not closed
            words = ["?"]
        if not client.known:
            return self._greeted(client, words)
        if not words:
            return []
        client.lines += 1
        try:
            return [self._incoming(client, words)]
        except InputError as error:
            self._refuse(client, str(error))
            return []

    def _greeted(self, client: _Client, words: list[str]) -> list[Incoming]:
        token = words[1] if len(words) == 2 and words[0] == "token" else ""
        if hmac.compare_digest(token.encode("utf-8", "surrogatepass"), self.token.encode()):
            client.known = True
            self._answer(client, f"ok{self._what_next()}")
            return []
        self._wrong_tokens += 1
        self._tell("a connection without the right token was refused")
        _send(client.stream, "refused this is not the token")
        self._end(client)
        return []

    def _incoming(self, client: _Client, words: list[str]) -> Incoming:
        def reply(entry: Entry) -> None:
            about = f" {entry.reason} {entry.words}".rstrip() if entry.event == "reading" and entry.reason else ""
            kind = entry.event if entry.event != "reading" else "aside" if entry.reason else "kept"
            self._answer(client, f"{kind} {entry.number}{about}{self._what_next()}")

        def refuse(message: str) -> None:
            self._refuse(client, message)

        if words[0] == "left":
            if len(words) < 3:
                raise InputError("a point is left out by its configuration and its name", came=" ".join(words))
            return Incoming(left=(words[1], words[2], " ".join(words[3:])), reply=reply, refuse=refuse)
        if words[0] != "reading":
            raise InputError("there is no such line", came=words[0], allowed="reading, left")
        return Incoming(_reading(words, self._clock(), f"port {self.port}"), reply=reply, refuse=refuse)

    def _what_next(self) -> str:
        step = None if self._session is None else self._session.next
        return "; nothing is left" if step is None else f"; next {shlex.quote(step.label)} {shlex.quote(step.names[0])}"

    def _refuse(self, client: _Client, message: str) -> None:
        self._refused += 1
        self._tell(f"a line was refused: {message}")
        self._answer(client, f"refused {message}")

    def _answer(self, client: _Client, text: str) -> None:
        if client.stream.fileno() >= 0 and not _send(client.stream, text):
            self._end(client)

    def _cut(self, client: _Client) -> None:
        self._cut_off += 1
        self._tell("a connection that sent too much was cut off")
        _send(client.stream, f"refused more than {LONGEST_LINE} bytes in a line, or {MOST_LINES} lines a second")
        self._end(client)

    def _drop_silent(self) -> None:
        for client in [*self._clients.values()]:
            if not client.known and time.monotonic() - client.since > PATIENCE:
                self._end(client)

    def _end(self, client: _Client) -> None:
        number = client.stream.fileno()
        if number >= 0:
            self._selector.unregister(client.stream)
            self._clients.pop(number, None)
            client.stream.close()


def _reading(words: list[str], received: float, origin: str) -> Reading:
    """Return the reading of a line, or refuse it."""
    if len(words) < 6:
        raise InputError("a reading has a name, three coordinates and their unit", came=" ".join(words[:6]))
    name, unit = words[1], words[5]
    if unit not in LENGTH_UNITS:
        raise InputError("there is no such unit of length", came=unit, allowed=", ".join(LENGTH_UNITS))
    fields: dict[str, str] = {}
    for word in words[6:]:
        key, _, value = word.partition("=")
        if key not in _KEYS or key in fields:
            raise InputError("this cannot stand here", came=word, allowed=", ".join(f"{key}=" for key in _KEYS))
        fields[key] = value

    def length(key: str) -> float | None:
        return None if key not in fields else to_si(_number(fields[key], key, 0.0), unit)

    def count(key: str) -> int | None:
        if key not in fields:
            return None
        if not fields[key].isdecimal() or len(fields[key]) > 9:
            raise InputError("a count belongs here", came=f"{key}={fields[key]}")
        return int(fields[key])

    position = np.array([sized_si(_number(word, "coordinates"), unit) for word in words[2:5]])
    quaternion: Any = None
    if "q" in fields:
        quaternion = np.array([_number(text, "q") for text in fields["q"].split(",")])
        norm = float(np.linalg.norm(quaternion))
        if len(quaternion) != 4 or not abs(norm - 1.0) <= QUATERNION_TOLERANCE:
            raise InputError("a quaternion (w, x, y, z) of length 1 belongs here", came=fields["q"])
        quaternion = quaternion / norm
    sigma = None
    if "sigma" in fields:
        sigma = sized_si(_number(fields["sigma"], "sigma", 0.0), unit, deviation=True)
    return Reading(
        name=shortened(printable(name), _WORDS),
        time=_number(fields["time"], "time") if "time" in fields else received,
        position=position,
        quaternion=quaternion,
        label=shortened(printable(fields["at"]), _WORDS) if "at" in fields else None,
        sigma=sigma,
        samples=count("samples"),
        deviation=length("deviation"),
        settling=length("settling"),
        breaks=count("breaks") or 0,
        origin=origin,
    )


def _number(text: str, name: str, least: float = -math.inf) -> float:
    number = as_number(text)
    if number is None or not math.isfinite(number) or number < least:
        raise InputError(f"a number belongs here ({name})", came=text, allowed="0 or more" if least == 0.0 else None)
    return number


def _send(stream: socket.socket, text: str) -> bool:
    """Send a line, and return whether it was taken: who does not read answers is not waited for."""
    try:
        line = f"{shortened(printable(text), LONGEST_LINE)}\n".encode("utf-8", "replace")
        return stream.send(line) == len(line)
    except OSError:
        return False


def _listening_socket(port: int) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind((HOST, port))
        bound.listen(MOST_CONNECTIONS)
        bound.setblocking(False)
    except OSError as error:
        bound.close()
        if isinstance(error, PermissionError):
            raise InputError(
                "this port cannot be used by everyone",
                parameter="listen",
                came=port,
                allowed="1024 to 65535, 0 for any",
            ) from error
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as other:
            other.bind((HOST, 0))
            free = other.getsockname()[1]
        raise InputError(
            "another program listens on this port",
            parameter="listen",
            came=port,
            cure=f"Give `listen={free}`, which is free.",
        ) from error
    return bound
