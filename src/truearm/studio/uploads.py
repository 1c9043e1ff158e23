"""Files that a window sends: each is written on disk as it comes, and none is held in memory.

The parts of a file go into a hidden file of the project's folder, which is locked while it comes. It gets its name
there once it is whole. What is not whole when its window goes, or the process ends, is removed: at once, or when the
project is opened again.

What is relied on of viser's page: a file comes as ``FileTransferStartUpload`` with ``filename`` and ``size_bytes``, and
in ``part_count`` messages ``FileTransferPart`` with ``content``, in order. viser itself sees none of them.
"""

from __future__ import annotations

import re
import secrets
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Final

from truearm.engine.base.files import reason_of
from truearm.engine.base.limits import limit

#: So many files are taken in at once.
_AT_ONCE: Final = 4
#: A file of which nothing has come for so long makes room for another [s].
_PATIENCE: Final = 60.0
#: Names of files that are coming.
_COMING: Final = re.compile(r"\.truearm-upload\.[0-9a-f]{16}")


@dataclass(eq=False)
class Upload:
    """A file that comes, or has come."""

    name: str  #: As the window calls it: it may be anything.
    element: str  #: Of the window, by which it was sent.
    size: int  #: As it was announced [bytes].
    path: Path  #: Where it is on disk.
    came: int = 0  #: How much of it [bytes].
    _parts: int = 0
    _stream: IO[bytes] | None = None
    _last: float = field(default_factory=time.monotonic)

    def discard(self) -> None:
        """Remove it from where it came, if it is still there."""
        if self._stream is not None:
            with suppress(OSError):
                self._stream.close()
        with suppress(OSError):
            self.path.unlink(missing_ok=True)


class Uploads:
    """Takes in files of windows.

    Attributes:
        folder: Of the project.
        takers: What is called with a whole file, by the element that sends it; from the server's thread.
        told: Called at each step with who sends, the file by the window's number for it, and the file; from there, too.
            A file that is refused comes as None.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.takers: dict[str, Callable[[Upload], None]] = {}
        self.told: Callable[[object, str, str, Upload | None], None] = lambda *_: None
        self._coming: dict[str, tuple[object, Upload]] = {}
        self._lock = threading.Lock()

    def begins(self, sender: object, message: Mapping[str, Any]) -> str | None:
        """Let a file come; return why not, in words.

        Raises:
            ValueError: If the message is none that the page sends.
        """
        size, parts, name = message.get("size_bytes"), message.get("part_count"), message.get("transfer_uuid")
        file, element = message.get("filename"), message.get("source_component_uuid")
        if not (type(size) is int and type(parts) is int and isinstance(name, str)):
            raise ValueError("an upload without size or number")
        if not (isinstance(file, str) and isinstance(element, str)):
            raise ValueError("an upload without a name")
        if size < 0 or parts < 0 or parts > size or (parts == 0 and size):
            raise ValueError("an upload of no size")
        why = self._opened(sender, name, Upload(file, element, size, self._new_path(), _parts=parts))
        if why is not None:
            self.told(sender, name, element, None)
        elif not parts:
            self._ends(sender, name)
        return why

    def goes_on(self, sender: object, message: Mapping[str, Any]) -> str | None:
        """Take a part of a file; return why it cannot go on, in words. Parts of what was refused go nowhere.

        Raises:
            ValueError: If there is more of the file than was announced, or less, or the message is none that the page
                sends.
        """
        name, content = message.get("transfer_uuid"), message.get("content")
        if not isinstance(content, bytes) or not isinstance(name, str):
            raise ValueError("a part of a file without content")
        with self._lock:
            known = self._coming.get(name)
        if known is None or known[0] is not sender:
            return None
        upload = known[1]
        upload.came += len(content)
        upload._parts -= 1
        upload._last = time.monotonic()
        if upload.came > upload.size or (not upload._parts and upload.came < upload.size):
            self._drop(name)
            raise ValueError(f"{'more' if upload.came > upload.size else 'less'} of a file than was announced")
        try:
            assert upload._stream is not None
            upload._stream.write(content)
            upload._stream.flush()
        except OSError as error:
            self._drop(name)
            self.told(sender, name, upload.element, None)
            return f"the file cannot be written ({reason_of(error)})"
        if upload._parts:
            self.told(sender, name, upload.element, upload)
        else:
            self._ends(sender, name)
        return None

    def turned_away(self, sender: object, message: Mapping[str, Any]) -> bool:
        """Tell a window that its file is not taken; return whether that is the file's first message."""
        name, element = message.get("transfer_uuid"), message.get("source_component_uuid")
        is_first = "filename" in message
        if is_first and isinstance(name, str) and isinstance(element, str):
            self.told(sender, name, element, None)
        return is_first

    def gone(self, sender: object) -> None:
        """Remove what a window was sending when it went."""
        with self._lock:
            names = [name for name, (whose, _) in self._coming.items() if whose is sender]
        for name in names:
            self._drop(name)

    def stop(self) -> None:
        """Remove everything that is still coming."""
        for name in [*self._coming]:
            self._drop(name)

    def _opened(self, sender: object, name: str, upload: Upload) -> str | None:
        if upload.element not in self.takers:
            return "a file for nothing that takes files"
        if upload.size > limit("upload"):
            return f"the file is too large to be taken in: {upload.size} bytes; allowed: {limit('upload')} or fewer"
        now = time.monotonic()
        for old in [name for name, (_, one) in self._coming.items() if now - one._last > _PATIENCE]:
            self._drop(old)
        with self._lock:
            if len(self._coming) >= _AT_ONCE or name in self._coming:
                return "too many files at once; wait for the others"
            try:
                upload._stream = upload.path.open("xb")
            except OSError as error:
                return f"the file cannot be written ({reason_of(error)})"
            with suppress(OSError):  # a file system without locks
                _lock_alone(upload._stream)
            self._coming[name] = (sender, upload)
        return None

    def _ends(self, sender: object, name: str) -> None:
        """Hand on a file that is whole: it stays locked until it is discarded."""
        with self._lock:
            _, upload = self._coming.pop(name)
        self.told(sender, name, upload.element, upload)
        self.takers[upload.element](upload)

    def _drop(self, name: str) -> None:
        with self._lock:
            _, upload = self._coming.pop(name, (None, None))
        if upload is not None:
            upload.discard()

    def _new_path(self) -> Path:
        return self.folder / f".truearm-upload.{secrets.token_hex(8)}"


def clear_uploads(folder: Path) -> None:
    """Remove what processes that were killed have left of files that came; those that are coming now stay."""
    with suppress(OSError):
        for path in [path for path in folder.iterdir() if _COMING.fullmatch(path.name)]:
            with suppress(OSError), path.open("rb") as stream:
                _lock_alone(stream)
                path.unlink()


def _lock_alone(stream: IO[bytes]) -> None:
    """Lock a file as long as it is open, or fail where another process has; on Windows nobody removes an open file."""
    if sys.platform != "win32":
        import fcntl

        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
