"""Opening a project in the browser, and serving it until Ctrl-C."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError
from truearm.engine.base.files import exists
from truearm.engine.base.parts import is_loopback
from truearm.studio.access import Access, listening_socket, new_token
from truearm.studio.gate import Gate, start_server
from truearm.studio.pages import PAGES
from truearm.studio.project import Project, open_project
from truearm.studio.uploads import Uploads
from truearm.studio.window import Page, Window

#: What is chosen in a new project of the demonstration: what it calibrated and corrected itself.
DEMONSTRATION: Final[Mapping[str, Any]] = {
    "truearm": "truearm-studio/1",
    "robot": "irb120",
    "data": "measurements.csv",
    "payload": "2.7kg,50mm,25mm,100mm",
    "program": "plate.mod",
    "cell": "cell.yaml",
    "taught": ["none"],
    "controller_kinematics": "nominal",
}
#: What a token is made of that somebody chooses.
_TOKEN: Final = re.compile(r"[A-Za-z0-9_-]{16,200}")


@dataclass(frozen=True, eq=False)
class Studio:
    """A project that is served."""

    access: Access  #: Where, and to whom.
    window: Window  #: Its pages.

    def stop(self) -> None:
        """Stop serving it."""
        self.window.stop()

    def wait(self) -> None:
        """Serve it until Ctrl-C."""
        threading.Event().wait()


def serve(
    folder: str | Path,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str | None = None,
    demo: bool = False,
    pages: Sequence[type[Page]] = PAGES,
    say: Callable[[str], None] = lambda _: None,
    progress: Callable[[str], None] = lambda _: None,
) -> Studio:
    """Serve a project.

    Args:
        folder: Of the project; made where it is missing.
        host: Name or address of this machine to listen on. More than loopback is served with a token alone.
        port: To listen on; 0 for any that is free.
        token: What a browser must bring; None for none on loopback, and for a new one elsewhere.
        demo: Fill the folder with what :func:`truearm.demo` writes, and choose it. A folder that was filled so before
            is opened as it is.
        pages: Of the window.
        say: Called with every request that is refused.
        progress: Called with a few words at each step before the window is there.

    Raises:
        InputError: If the folder is no project, or holds something else than the demonstration; or if host, port or
            token cannot be used.
    """
    chosen = token_argument(token, host)
    # Nothing of a project is made where it cannot be served.
    bound = listening_socket(host_argument(host), port_argument(port))
    try:
        project: Project = open_project(folder, DEMONSTRATION if demo else None)
        # Where it was filled before, it is opened as it is now: what was changed since stays.
        if demo and not exists(project.folder / DEMONSTRATION["cell"]):
            from truearm.starting.jobs import demo as job

            job(project.folder, progress=progress)
            project.look()
        progress("opening the window")
        access = Access(host, bound.getsockname()[1], chosen, names_of(host))
        gate = Gate(access, Uploads(project.folder))
        server = start_server(gate, bound, "truearm studio")
    except BaseException:
        bound.close()
        raise
    window = Window(project, server, gate, pages)
    tell = gate.say

    def told(text: str) -> None:
        say(text)
        tell(text)

    gate.say = told
    return Studio(access, window)


def host_argument(host: object) -> str:
    """Return the host that was given, or refuse what is none."""
    if isinstance(host, str) and host.strip() and host.isascii() and host.isprintable():
        return host
    raise InputError(
        "this is no address of this machine", parameter="host", came=str(host), allowed="such as 127.0.0.1 or 0.0.0.0"
    )


def port_argument(port: object) -> int:
    """Return the port that was given, or refuse what is none."""
    if isinstance(port, int) and not isinstance(port, bool) and 0 <= port <= 65535:
        return port
    raise InputError("this is no port", parameter="port", came=port, allowed="1 to 65535, 0 for any that is free")


def token_argument(token: object, host: str) -> str | None:
    """Return the token that was given, or a new one where there must be one."""
    if token is None:
        return None if is_loopback(host) else new_token()
    if isinstance(token, str) and _TOKEN.fullmatch(token):
        return token
    raise InputError(
        "this is no token that keeps others out",
        parameter="token",
        allowed="16 to 200 letters, digits, - and _",
        cure="Leave it out where the host is not loopback: then one is made.",
    )


def names_of(host: str) -> frozenset[str]:
    """Return by which names a browser may call this machine."""
    names = {"localhost", "127.0.0.1", "::1", host.lower()}
    if not is_loopback(host):
        names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
    return frozenset(names - {"0.0.0.0", "::"})
