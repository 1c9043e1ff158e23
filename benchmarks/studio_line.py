"""A window's end of the line to a studio that is a process of its own, without a browser: for its benchmarks."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import msgspec
import viser
import zstandard
from websockets.sync.client import connect
from websockets.typing import Subprotocol

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

Message = dict[str, Any]


class Line:
    """A window.

    Attributes
    ----------
    elements
        What elements the page has, by their label; those of the same label by the last.
    contents
        What its elements hold now, by their number.
    bytes, messages
        How much has come.
    """

    def __init__(self, address: str) -> None:
        place = urlsplit(address).netloc
        self._line = connect(
            f"ws://{place}/",
            origin=f"http://{place}",  # type: ignore[arg-type]
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            max_size=None,
            compression=None,
            proxy=None,
        )
        self.elements: dict[str, Message] = {}
        self.contents: dict[str, dict[str, Any]] = {}
        self.bytes = self.messages = 0
        self.send(**CAMERA)

    def close(self) -> None:
        self._line.close()

    def send(self, **message: Any) -> None:
        self._line.send(msgspec.msgpack.encode(message))

    def give(self, label: str, value: Any) -> None:
        """Give an element a value, as somebody does who uses it."""
        self.send(type="GuiUpdateMessage", uuid=self.elements[label]["uuid"], updates={"value": value})

    def read(self, seconds: float) -> list[Message]:
        """Return the messages of the next window of time in which there are any; none if there are none."""
        try:
            content = self._line.recv(timeout=seconds)
        except TimeoutError:
            return []
        assert isinstance(content, bytes)
        self.bytes += len(content)
        unpacked = zstandard.ZstdDecompressor().decompressobj().decompress(content[16:])
        found: list[Message] = msgspec.msgpack.decode(unpacked)["messages"]
        self.messages += len(found)
        for message in found:
            props = message.get("props")
            if message["type"].startswith("Gui") and isinstance(props, dict):
                self.contents[message["uuid"]] = {"value": message.get("value"), **props}
                if isinstance(props.get("label"), str):
                    self.elements[props["label"]] = message
            elif message["type"] == "GuiUpdateMessage":
                self.contents.setdefault(message["uuid"], {}).update(message["updates"])
        return found

    def quiet(self, seconds: float = 0.15) -> None:
        """Read on until nothing comes any more."""
        while self.read(seconds):
            pass

    def until(self, true: Callable[[Message], bool], seconds: float = 60.0) -> bool:
        """Read until a message comes that fulfils a condition; return whether one has."""
        end = time.perf_counter() + seconds
        while (left := end - time.perf_counter()) > 0.0:
            if any(map(true, self.read(left))):
                return True
        return False


def moved(message: Message) -> bool:
    """Return whether a message moves the nominal flange."""
    return message["type"] in ("SetPositionMessage", "SetOrientationMessage") and message["name"] == "/nominal/flange"


@contextmanager
def studio(folder: Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start a studio, and return its process and its address."""
    words = ["studio", str(folder), "--port", "0", "--no-open"]
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "truearm", *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        yield process, next(word.rstrip(".,") for word in line.split() if word.startswith("http://"))
    finally:
        process.kill()
        process.wait()
