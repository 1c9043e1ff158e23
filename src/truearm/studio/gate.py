"""Who may talk to the window: every connection and every message passes here before viser sees it.

viser listens for anybody who asks, from any web page, and takes what it is sent. So its server is started with a gate
around it (:func:`start_server`), by replacing for that moment the one function with which it listens,
``websockets.asyncio.server.serve``. What is relied on, each held by a test in ``tests/studio/test_gate.py``:

- ``WebsockServer._background_worker`` looks that function up when it starts, and gives it ``process_request``;
- each connection is read with ``recv()`` alone, and what comes is msgpack with the name of its kind in ``type``.

The socket is bound before, so viser cannot move on to another port, whatever its environment says.
"""

from __future__ import annotations

import http
import logging
import socket
import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import msgspec
import viser
import websockets.asyncio.server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from truearm.engine.base.errors import printable, shortened
from truearm.studio.access import Access
from truearm.studio.first_page import complete
from truearm.studio.uploads import Uploads
from truearm.studio.values import checked

#: Where the page asks whether somebody is there.
_ALIVE: Final = "/alive"
#: A message of the window is small; files come in parts of half a megabyte.
_MESSAGE_SIZE: Final = 4_000_000
#: What any window may send: where it looks from, and answers that viser asked for.
_LOOKING: Final = frozenset({"ViewerCameraMessage", "GetRenderResponseMessage", "FileTransferPartAck"})
#: A file that comes.
_FILES: Final = frozenset({"FileTransferStartUpload", "FileTransferPart"})
#: What only the window that works may send. Everything else is refused: asking for a public address, for example.
_WORKING: Final = _FILES | frozenset(
    {
        "GuiUpdateMessage",
        "GuiButtonHoldMessage",
        "GuiFormSubmitMessage",
        "GuiFormDirtyMessage",
        "CommandTriggerMessage",
        "ScenePointerMessage",
        "SceneNodeClickMessage",
        "SceneNodeDragMessage",
        "TransformControlsUpdateMessage",
        "TransformControlsDragStartMessage",
        "TransformControlsDragEndMessage",
    }
)


@dataclass(eq=False)
class Gate:
    """Decides on requests and messages, and which window works."""

    access: Access  #: Who is let in.
    uploads: Uploads  #: Takes in the files that windows send.
    say: Callable[[str], None] = lambda _: None  #: Called with every refusal in words; from the server's thread.
    #: Called with the connection of a window of which something was refused, why, and the message, empty where it was
    #: not read; from the server's thread.
    blocked: Callable[[ServerConnection, str, Mapping[str, Any]], None] = lambda *_: None
    #: Elements that a window which only reads may use: those with which it takes over.
    offers: set[str] = field(default_factory=set)
    #: Called with the number of an element and a value: whether it can have that.
    fits: Callable[[str, object], bool] = lambda *_: True
    _working: ServerConnection | None = None
    _said: dict[str, float] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def answer(
        self, theirs: Callable[[ServerConnection, Request], Response | None]
    ) -> Callable[[ServerConnection, Request], Response | None]:
        """Return what decides on a request before viser's own function sees it."""

        def decided(connection: ServerConnection, request: Request) -> Response | None:
            refused = self.access.refusal(request, len(connection.server.connections))
            response: Response | None
            if refused is not None:
                self._tell(f"refused: {refused.why}")
                text = f"truearm studio refused this: {refused.why}.\n"
                response = connection.respond(http.HTTPStatus(refused.status), text)
            elif request.path == _ALIVE:
                response = connection.respond(http.HTTPStatus.OK, "yes\n")
            elif self.access.enters(request):
                response = self.access.entered()
            else:
                response = theirs(connection, request)
                if response is not None:
                    complete(response)
            if response is not None:
                self.access.close_up(request, response)
            return response

        return decided

    def _tell(self, words: str) -> None:
        """Say what was refused; the same words once in a second, so that nobody fills a log with them."""
        now = time.monotonic()
        with self._lock:
            if now - self._said.get(words, -1.0) < 1.0:
                return
            if len(self._said) > 100:
                self._said.clear()
            self._said[words] = now
        self.say(words)

    @property
    def has_worker(self) -> bool:
        """Whether one of the windows works."""
        with self._lock:
            return self._working is not None

    def is_working(self, connection: ServerConnection | None) -> bool:
        """Return whether a window works, and does not only read."""
        with self._lock:
            return connection is not None and connection is self._working

    def take_over(self, connection: ServerConnection | None) -> None:
        """Let a window work; the one that did only reads from now on."""
        with self._lock:
            self._working = connection

    def arrived(self, connection: ServerConnection) -> bool:
        """Let the first window work; return whether this one does."""
        with self._lock:
            if self._working is None or self._working.state.name == "CLOSED":
                self._working = connection
            return connection is self._working

    def gone(self, connection: ServerConnection) -> None:
        """Forget a window, and what it was sending."""
        with self._lock:
            if self._working is connection:
                self._working = None
        self.uploads.gone(connection)

    def passes(self, connection: ServerConnection, raw: object) -> bool:
        """Return whether a message may go on to viser.

        Raises:
            ValueError: If it is malformed: the connection is closed then, and the window comes again by itself.
        """
        if not isinstance(raw, bytes):
            raise ValueError("a text where messages are binary")
        try:
            message = msgspec.msgpack.decode(raw)
            kind = message["type"]
        except (msgspec.DecodeError, TypeError, KeyError, RecursionError) as error:
            raise ValueError("a message that cannot be read") from error
        if kind in _LOOKING:
            checked(message, kind, closely=False)
            return True
        if kind not in _WORKING:
            return self._block(
                connection, f"the message {printable(shortened(str(kind), 100))} is not taken from a window", {}
            )
        if not self.is_working(connection) and message.get("uuid") not in self.offers:
            if kind in _FILES and not self.uploads.turned_away(connection, message):
                return False  # a part of a file of which that was said
            checked(message, kind, closely=kind != "GuiUpdateMessage")
            self.blocked(connection, "this window only reads; take over to work in it", message)  # no other's business
            return False
        if kind == "GuiUpdateMessage" and (
            not isinstance(message.get("updates"), dict) or set(message["updates"]) != {"value"}
        ):
            return self._block(connection, "an element was to be changed otherwise than by its value", {})
        checked(message, kind, closely=kind != "GuiUpdateMessage")
        if kind in _FILES:
            self._take(connection, message, kind)
            return False
        if kind == "GuiUpdateMessage" and not self.fits(message["uuid"], message["updates"]["value"]):
            return self._block(connection, "an element was to have a value that it cannot have", message)
        return True

    def _take(self, connection: ServerConnection, message: Mapping[str, Any], kind: str) -> None:
        """Take a file, or a part of one: viser does not see it."""
        uploads = self.uploads
        why = (uploads.begins if kind == "FileTransferStartUpload" else uploads.goes_on)(connection, message)
        if why is not None:
            self._block(connection, why, {})

    def _block(self, connection: ServerConnection, why: str, message: Mapping[str, Any]) -> bool:
        self._tell(f"refused: {why}")
        self.blocked(connection, why, message)
        return False

    def connection_class(self) -> type[ServerConnection]:
        """Return the kind of connection whose every message passes the gate."""
        gate = self

        class Watched(ServerConnection):
            """A connection that drops what may not pass, and closes where a message is malformed."""

            async def recv(self, decode: bool | None = None) -> Any:
                while True:
                    raw = await super().recv(decode)
                    try:
                        if gate.passes(self, raw):
                            return raw
                    except ValueError as error:
                        gate._tell(f"refused: {error}")
                        await self.close(1002, f"{error}")

        return Watched


#: viser is started once at a time, because its function to listen is replaced meanwhile.
_starting: Final = threading.Lock()


def start_server(gate: Gate, bound: socket.socket, title: str) -> viser.ViserServer:
    """Start viser behind a gate, on a socket that listens already.

    Raises:
        RuntimeError: If this viser does not listen as it is relied on: then nothing is served.
    """
    served = []

    def gated(handler: Any, host: Any, port: Any, *, process_request: Any, **how: Any) -> Any:
        if process_request is None:
            raise RuntimeError("viser serves no pages")
        served.append(True)
        given = {
            **how,
            "process_request": gate.answer(process_request),
            "create_connection": gate.connection_class(),
            "max_size": _MESSAGE_SIZE,
            "logger": _quiet(),
            "server_header": None,
            "sock": bound,
        }
        return listen(handler, None, None, **given)

    with _starting:
        listen = websockets.asyncio.server.serve
        websockets.asyncio.server.serve = gated  # type: ignore[assignment,misc]
        try:
            with _without_words():
                server = viser.ViserServer(host=gate.access.host, port=gate.access.port, label=title, verbose=False)
        finally:
            websockets.asyncio.server.serve = listen  # type: ignore[misc]
    if not served or server.get_port() != bound.getsockname()[1]:
        server.stop()
        raise RuntimeError("viser does not listen as it is relied on")
    _forget_sharing(server)
    return server


def _forget_sharing(server: viser.ViserServer) -> None:
    """Let nothing ask viser's makers for a public address of this window."""
    server.request_share_url = lambda *_, **__: None  # type: ignore[method-assign]


def _without_words() -> Any:
    """Return a context in which viser does not print where it listens: the command says it, with the token's page."""
    from contextlib import redirect_stdout
    from io import StringIO

    return redirect_stdout(StringIO())


def _quiet() -> logging.Logger:
    """Return a log that keeps to itself what connections end with: the gate says what it refuses."""
    log = logging.getLogger("truearm.studio.connections")
    log.propagate = False
    if not log.handlers:
        log.addHandler(logging.NullHandler())
    return log
