"""A window's end of the line, without a browser: what one sends, and what nobody should."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import viser
import zstandard
from viser._messages import GuiHtmlMessage, GuiUpdateMessage
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

from truearm.studio.serving import Studio
from truearm.studio.window import Page

#: Headers of a browser that asks for a connection.
UPGRADE = {
    "Upgrade": "websocket",
    "Connection": "Upgrade",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
    "Sec_WebSocket_Version": "13",
}
#: What a window sends first: where it looks from.
CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [3.0, 3.0, 3.0],
    "fov": 1.3,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 600,
    "image_width": 800,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}


def answer(studio: Studio, request: str | bytes, seconds: float = 5.0) -> bytes:
    """Send bytes to the port of a studio, and return what comes back."""
    content = request if isinstance(request, bytes) else request.replace("\n", "\r\n").encode("latin-1")
    with socket.create_connection(("127.0.0.1", studio.access.port), timeout=seconds) as line:
        line.sendall(content)
        got = b""
        try:
            while part := line.recv(1 << 16):
                got += part
        except (TimeoutError, ConnectionResetError):
            pass
    return got


def get(studio: Studio, path: str = "/", **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Ask for a page; headers beside or in place of those of a browser on this machine."""
    said = {"Host": f"127.0.0.1:{studio.access.port}", **{k.replace("_", "-"): v for k, v in headers.items()}}
    lines = "".join(f"{name}: {value}\n" for name, value in said.items())
    head, _, body = answer(studio, f"GET {path} HTTP/1.1\n{lines}\n").partition(b"\r\n\r\n")
    first, *rest = head.decode("latin-1").split("\r\n")
    return int(first.split()[1]), dict(line.split(": ", 1) for line in rest), body


def window(
    studio: Studio, *, origin: str | None = "", subprotocols: Sequence[str] = (), headers: Mapping[str, str] = {}
) -> ClientConnection:
    """Open a window's connection, from its own page unless another origin is named."""
    place = f"127.0.0.1:{studio.access.port}"
    return connect(
        f"ws://{place}/",
        origin=f"http://{place}" if origin == "" else origin,  # type: ignore[arg-type]
        subprotocols=[Subprotocol(f"viser-v{viser.__version__}"), *map(Subprotocol, subprotocols)],
        additional_headers=dict(headers),
        max_size=None,
        compression=None,
        proxy=None,
    )


def send(line: Connection, **message: Any) -> None:
    """Send a message as the page does."""
    line.send(msgspec.msgpack.encode(message))


def own(studio: Studio) -> str:
    return f"127.0.0.1:{studio.access.port}"


def alive(studio: Studio) -> bool:
    """Return whether the page is still served and a window still works."""
    cookie = {} if studio.access.token is None else {"Cookie": f"{studio.access.cookie}={studio.access.token}"}
    status, _, body = get(studio, **cookie)
    with window(studio, headers=cookie) as line:
        send(line, **CAMERA)
        return status == 200 and b"<html" in body and len(line.recv(30)) > 100


def eventually(condition: Callable[[], bool], seconds: float = 30.0) -> bool:
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


def working(studio: Studio, line: Any) -> None:
    """Let a window be the one that works."""
    send(line, **CAMERA)
    assert eventually(lambda: studio.window.gate.has_worker)


def shown(studio: Studio) -> str:
    """Return the HTML that a window shows which comes now."""
    found = ""
    for message in list(studio.window.server._websock_server._broadcast_buffer.message_from_id.values()):
        if isinstance(message, GuiHtmlMessage):
            found += message.props.content
        elif isinstance(message, GuiUpdateMessage):
            found += str(message.updates.get("content", ""))
    return found


def element(studio: Studio, page: type[Page], label: str) -> str:
    """Return the name by which messages call an element of a page."""
    assert any(isinstance(one, page) for one in studio.window.pages)
    handles = studio.window.gui._gui_input_handle_from_uuid
    return next(name for name, handle in handles.items() if getattr(handle, "label", None) == label)


def messages_of(line: Connection, kind: str, until: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
    """Return the messages of a kind that a window is sent, up to one that fulfils a condition."""
    found: list[dict[str, Any]] = []
    while True:
        content = line.recv(30)
        assert isinstance(content, bytes)
        unpacked = zstandard.ZstdDecompressor().decompressobj().decompress(content[16:])
        for message in msgspec.msgpack.decode(unpacked)["messages"]:
            if message["type"] == kind:
                found.append(message)
                if until(message):
                    return found
