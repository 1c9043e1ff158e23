"""Who is let in: the address, the token, and what a request must bring before a connection is accepted."""

from __future__ import annotations

import hmac
import http
import ipaddress
import secrets
import socket
from contextlib import suppress
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Final
from urllib.parse import parse_qs, urlsplit

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from truearm.engine.base.errors import InputError, printable, shortened
from truearm.engine.base.parts import is_loopback

#: So many windows are open at once.
_WINDOWS: Final = 16
#: Headers of every answer. The page is one file that asks nobody else, so it may not: its own address can name another
#: server to obey, and that is refused here.
_HEADERS: Final = {
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
_POLICY: Final = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; connect-src 'self' ws://{host} data: blob:; "
    "frame-ancestors 'none'; form-action 'none'; base-uri 'none'; object-src 'none'"
)
#: The page that takes the token out of the address: the browser then comes again with the cookie alone.
_ENTER: Final = (
    '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
    '<meta http-equiv="refresh" content="0;url=/"><title>truearm studio</title>'
)


@dataclass(frozen=True)
class Refused:
    """A request that goes no further."""

    status: int  #: Of the answer.
    why: str  #: In words.


@dataclass(frozen=True)
class Access:
    """Where the window is served, and to whom."""

    host: str  #: host, port: as bound.
    port: int
    token: str | None  #: What a browser must bring; None for none, on loopback alone.
    #: Names and addresses by which a browser may call this machine, in lower case; the numeric addresses of a machine
    #: that listens on more than loopback are all allowed.
    names: frozenset[str]

    @property
    def address(self) -> str:
        """The page's address, without the token."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        shown = {"0.0.0.0": "127.0.0.1", "[::]": "[::1]"}.get(host, host)
        return f"http://{shown}:{self.port}/"

    @property
    def entrance(self) -> str:
        """The address to open first: it holds the token, where there is one."""
        return self.address if self.token is None else f"{self.address}?token={self.token}"

    @property
    def cookie(self) -> str:
        """The name of the cookie that stands for the token from then on."""
        return f"truearm-studio-{self.port}"

    def knows(self, name: str) -> bool:
        """Return whether a browser may call this machine by a name."""
        if name in self.names:
            return True
        if is_loopback(self.host):
            return False
        with suppress(ValueError):
            ipaddress.ip_address(name)
            return True
        return False

    def admits(self, token: str | None) -> bool:
        """Return whether a token is the right one; it takes as long for every wrong one."""
        if self.token is None:
            return True
        given = (token or "").encode("utf-8", "surrogatepass")
        return hmac.compare_digest(given, self.token.encode())

    def refusal(self, request: Request, windows: int) -> Refused | None:
        """Return why a request goes no further; None where it may.

        Args:
            windows: How many connections there are already.
        """
        headers = request.headers
        upgrade = [value.lower() for value in headers.get_all("Upgrade")]
        is_socket = "websocket" in upgrade
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or len(origins) > 1:
            return Refused(400, "a request with no Host, or with several of Host or Origin")
        if not self._is_called(hosts[0]):
            return Refused(403, f"a request for another machine ({_shown(hosts[0])})")
        if (is_socket or origins) and origins != [f"http://{hosts[0]}"]:
            came = origins[0] if origins else "none"
            return Refused(403, f"a page of another origin ({_shown(came)})")
        if upgrade and (not is_socket or headers.get_all("Upgrade") != ["websocket"]):
            return Refused(400, "a connection of another kind")
        if self.enters(request):
            given = _given(request)
            return None if len(given) == 1 and self.admits(given[0]) else Refused(401, "a wrong token")
        if not self.admits(self._brought(headers)):
            return Refused(401, "no token, or a wrong one")
        if request.path.partition("?")[2]:
            return Refused(404, "an address with a question mark, which could name another server")
        if is_socket and windows >= _WINDOWS:
            return Refused(503, f"more than {_WINDOWS} windows at once")
        return None

    def enters(self, request: Request) -> bool:
        """Return whether a request brings a token in its address: what it asks for is the cookie."""
        is_page = "Upgrade" not in request.headers and request.path.partition("?")[0] == "/"
        return self.token is not None and is_page and bool(_given(request))

    def entered(self) -> Response:
        """Return the page that gives the browser its cookie."""
        body = _ENTER.encode()
        cookie = f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Strict"
        headers = Headers(
            {"Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(body)), "Set-Cookie": cookie}
        )
        return Response(http.HTTPStatus.OK, "OK", headers, body)

    def close_up(self, request: Request, response: Response) -> None:
        """Give an answer the headers that keep the page to itself."""
        for name, value in _HEADERS.items():
            response.headers[name] = value
        host = next(iter(request.headers.get_all("Host")), "")
        if self._is_called(host):
            response.headers["Content-Security-Policy"] = _POLICY.format(host=host)

    def _is_called(self, host: str) -> bool:
        """Return whether a header ``Host`` calls this machine."""
        name = ""
        with suppress(ValueError):
            split = urlsplit(f"//{host}")
            _ = split.port  # refuses what is no number
            if split.netloc == host and not (split.username or split.password or split.path or split.query):
                name = (split.hostname or "").lower()
        return bool(name) and self.knows(name)

    def _brought(self, headers: Headers) -> str | None:
        """Return the token in the cookie of a request."""
        for text in headers.get_all("Cookie"):
            with suppress(CookieError):
                morsel = SimpleCookie(text).get(self.cookie)
                if morsel is not None:
                    return morsel.value
        return None


def _given(request: Request) -> list[str]:
    """Return the tokens in the address of a request."""
    query = request.path.partition("?")[2]
    with suppress(ValueError):  # too many entries
        return parse_qs(query, max_num_fields=4).get("token", []) if len(query) < 1000 else []
    return []


def new_token() -> str:
    """Return a token that nobody guesses."""
    return secrets.token_urlsafe(24)


def listening_socket(host: str, port: int) -> socket.socket:
    """Return a socket that listens, or refuse.

    Raises:
        InputError: If the host is none of this machine's, or the port is taken; a free one is named.
    """
    try:
        family, _, _, _, place = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, UnicodeError) as error:
        raise InputError("this is no address of this machine", parameter="host", came=host) from error
    bound = socket.socket(family, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind(place)
        bound.listen(100)
    except OSError as error:
        bound.close()
        if isinstance(error, PermissionError):
            raise InputError(
                "this port cannot be used by everyone", parameter="port", came=port, allowed="1024 to 65535, 0 for any"
            ) from error
        with socket.socket(family, socket.SOCK_STREAM) as other:
            try:
                other.bind((place[0], 0, *place[2:]))
            except OSError as second:
                raise InputError("this is no address of this machine", parameter="host", came=host) from second
            free = other.getsockname()[1]
        raise InputError(
            "another program listens on this port",
            parameter="port",
            came=port,
            cure=f"Give `port={free}`, which is free.",
        ) from error
    return bound


def _shown(text: str) -> str:
    return printable(shortened(text, 100))
