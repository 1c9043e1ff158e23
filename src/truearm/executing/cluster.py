"""Workers of a Dask cluster: reached through its scheduler, which runs whatever it is sent."""

from __future__ import annotations

import ipaddress
import logging
import pkgutil
import re
import socket
import threading
import time
from collections.abc import Callable
from concurrent.futures import Executor, Future
from contextlib import suppress
from typing import Any, Final, TypeVar
from urllib.parse import urlsplit

from truearm import __version__
from truearm.errors import InputError, Words
from truearm.shown import counted, listed

P = TypeVar("P")
R = TypeVar("R")

#: How long to wait for the scheduler, and for its first worker [s].
PATIENCE: Final = 4.0
#: How long to wait for its first words [s].
_GREETING: Final = 2.0
#: How much longer than that reaching it may take in all [s].
_MARGIN: Final = 1.0
#: How long scheduler and workers may take to answer while they work [s].
_ANSWER: Final = 60.0
#: How long there may be no worker before the work is given up [s].
_ALONE: Final = 60.0
#: How often to ask the scheduler about its workers [s].
_LOOK: Final = 2.0
#: What a scheduler says first [bytes], and how long a message it may announce.
_LENGTH: Final = 8
_LONGEST_GREETING: Final = 1_000_000
#: How schedulers are reached.
_PROTOCOLS: Final = ("tcp", "tls")
#: Names and numbers of machines.
_HOST: Final = re.compile(r"[0-9A-Za-z_.:%-]+")
#: Who prints tracebacks where a connection is lost; Dask gives the second one a level of its own.
_LOGGERS: Final = ("distributed", "distributed.client", "tornado.application")
#: What to do where the cluster has gone.
_RUN_AGAIN: Final = "Run this again when it is there: what is on disk is not computed twice."


class Cluster:
    """Parts are done by the workers of a Dask scheduler.

    Args:
        address: Of the scheduler, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``.
        insecure: Whether a scheduler on another machine may be reached without TLS.

    Raises:
        InputError: If Dask is not installed, the address is none or is another machine's without TLS, the scheduler
            cannot be reached or has no workers, or a worker has another version of truearm.
    """

    def __init__(self, address: str, *, insecure: bool) -> None:
        self._address = checked_address(address, insecure=insecure)
        distributed = _distributed()
        self.lost: tuple[type[BaseException], ...] = (distributed.KilledWorker,)
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # what happens is told, and once
        self._client = self._reached(distributed)
        try:
            self._workers = self._waited_for_workers()
            self._refuse_other_versions([*self._workers])
        except BaseException:
            self._client.close(timeout=1)
            raise
        self._looked = self._seen = time.monotonic()
        self._executor: Executor = self._client.get_executor(pure=False)

    def _reached(self, distributed: Any) -> Any:
        """Return a client of the scheduler; Dask alone would wait for ever for what begins to speak and stops."""
        client = distributed.Client.__new__(distributed.Client)

        def connect() -> None:
            self._greeted(distributed)
            client.__init__(self._address, timeout=PATIENCE, set_as_default=False)

        try:
            _within(PATIENCE + _MARGIN, connect)
        except Exception as error:  # whatever the words of something else are taken for
            client.status = "closed"  # or it would be waited for when it is forgotten
            if isinstance(error, InputError):
                raise
            if isinstance(error, ImportError):
                raise InputError(
                    "the scheduler has another version of Dask, or of what Dask needs",
                    parameter="scheduler",
                    came=self._address,
                    cure="Install the same versions of dask and distributed on all machines.",
                ) from error
            certificates = ", or its certificates" if self._address.startswith("tls") else ""
            raise InputError(
                "no Dask scheduler answers there",
                parameter="scheduler",
                came=self._address,
                cure=f"Start one with 'dask scheduler', or correct the address{certificates}.",
            ) from error
        return client

    def _greeted(self, distributed: Any) -> None:
        """Make sure that a scheduler listens: it speaks first, the length of a short message."""
        parts = urlsplit(self._address)
        with socket.create_connection((str(parts.hostname), int(parts.port or 0)), timeout=PATIENCE) as plain:
            stream = plain
            if parts.scheme == "tls":
                context = distributed.Security().get_connection_args("client").get("ssl_context")
                if context is None:
                    raise InputError(
                        "the scheduler is reached by TLS, and there are no certificates for that",
                        parameter="scheduler",
                        came=self._address,
                        cure="Name them in Dask's configuration: distributed.comm.tls.",
                    )
                stream = context.wrap_socket(plain, server_hostname=parts.hostname)
            first, until = b"", time.monotonic() + _GREETING
            while len(first) < _LENGTH:
                stream.settimeout(max(until - time.monotonic(), 0.01))
                came = stream.recv(_LENGTH - len(first))
                if not came:
                    raise OSError("nothing is said there")
                first += came
            if int.from_bytes(first, "little") > _LONGEST_GREETING:
                raise OSError("something else listens there")

    def _waited_for_workers(self) -> dict[str, Any]:
        """Return the workers as soon as there are any."""
        until = time.monotonic() + PATIENCE
        while not (found := self._known(PATIENCE)):
            if time.monotonic() > until:
                raise InputError(
                    "the scheduler has no workers",
                    parameter="scheduler",
                    came=self._address,
                    cure=f"Start some with 'dask worker {self._address}'.",
                )
            time.sleep(0.1)
        return found

    def _known(self, patience: float) -> dict[str, Any]:
        """Return all workers by their addresses."""
        try:
            return dict(_within(patience, lambda: self._client.scheduler_info(n_workers=-1))["workers"])
        except TimeoutError as error:
            raise InputError(
                "the scheduler does not answer any more", parameter="scheduler", came=self._address, cure=_RUN_AGAIN
            ) from error

    def _refuse_other_versions(self, workers: list[str]) -> None:
        """Refuse workers whose results would not be those of this version."""
        if not workers:
            return
        try:
            there = _within(
                _ANSWER,
                lambda: self._client.run(
                    pkgutil.resolve_name, "truearm:__version__", workers=workers, on_error="return"
                ),
            )
        except TimeoutError as error:
            raise InputError(
                "workers of the scheduler do not answer",
                parameter="scheduler",
                came=self._address,
                cure="Look at what they print, and start them again.",
            ) from error
        others = {address: version for address, version in there.items() if version != __version__}
        if others:
            address, version = next(iter(others.items()))
            came = version if isinstance(version, str) else "no truearm"
            raise InputError(
                f"{counted(len(others), 'worker')} of the scheduler {'has' if len(others) == 1 else 'have'} another "
                f"version of truearm ({listed([*others])})",
                parameter="scheduler",
                came=Words(f"{came} on {address}"),
                allowed=__version__,
                cure="Install the same version on all of them.",
            )

    @property
    def in_flight(self) -> int:
        """Two a thread: the next one is there when one is done."""
        return 2 * max(1, sum(int(worker["nthreads"]) for worker in self._workers.values()))

    def handed(self, work: Callable[[P], R], part: P) -> Future[R] | None:
        """Hand out a part; None if the connection was lost."""
        try:
            return self._executor.submit(work, part)
        except Exception:  # of Dask, which has sent nothing: the work is done elsewhere
            return None

    def refusal(self, error: Exception) -> InputError | None:
        """Return none: what the cluster adds is broken connections and parts that workers died of."""
        return None

    def renew(self) -> None:
        """Wait for the scheduler, where its connection was lost, and for workers."""
        until = time.monotonic() + PATIENCE
        while self._client.status != "running":
            if time.monotonic() > until or self._client.status == "closed":
                raise InputError("the scheduler is gone", parameter="scheduler", came=self._address, cure=_RUN_AGAIN)
            time.sleep(0.1)
        try:
            self._workers = self._waited_for_workers()
            self._refuse_other_versions([*self._workers])
        except InputError:
            raise
        except Exception as error:  # of Dask, whose connection is lost again
            raise InputError(
                "the scheduler is gone", parameter="scheduler", came=self._address, cure=_RUN_AGAIN
            ) from error
        self._executor = self._client.get_executor(pure=False)

    def news(self) -> list[str]:
        """Return which workers have gone and come.

        Raises:
            InputError: If there was none for a minute, or a new one has another version of truearm.
        """
        now = time.monotonic()
        if now - self._looked < _LOOK or self._client.status != "running":
            return []
        self._looked = now
        try:
            found = self._known(_ANSWER)
            self._refuse_other_versions([address for address in found if address not in self._workers])
        except InputError:
            raise
        except Exception:  # of Dask, whose connection is being lost: its parts will say so
            return []
        gone = [address for address in self._workers if address not in found]
        self._workers = found
        if found:
            self._seen = now
        elif now - self._seen > _ALONE:
            raise InputError(
                "all workers of the scheduler are gone", parameter="scheduler", came=self._address, cure=_RUN_AGAIN
            )
        return [f"worker {address} is gone, and what it was doing is repeated by others" for address in gone]

    def close(self, *, finish: bool) -> None:
        """Leave the cluster as it is, without what it is still doing."""
        for end in (lambda: self._executor.shutdown(wait=finish), lambda: self._client.close(timeout=1)):
            with suppress(Exception):  # of Dask, where the scheduler is gone
                _within(PATIENCE, end)


def checked_address(address: str, *, insecure: bool) -> str:
    """Return the address of a scheduler with its protocol, or refuse one that somebody else could listen to.

    Raises:
        InputError: For no address, and for another machine's without TLS unless `insecure`.
    """
    full = address if "://" in address else f"tcp://{address}"
    try:
        parts = urlsplit(full)
        host, port = parts.hostname, parts.port
    except ValueError:
        parts, host, port = urlsplit(""), None, None
    whole = host is not None and port is not None and _HOST.fullmatch(host) is not None
    if parts.scheme not in _PROTOCOLS or not whole or "@" in address:
        raise InputError(
            "this is no address of a scheduler",
            parameter="scheduler",
            came=_without_password(address),
            allowed="tcp://HOST:PORT or tls://HOST:PORT",
            cure="A scheduler knows no users and passwords: leave them out." if "@" in address else None,
        )
    assert host is not None
    if parts.scheme == "tcp" and not insecure and not _is_here(host):
        raise InputError(
            "this scheduler is on another machine, and is reached without TLS",
            parameter="scheduler",
            came=address,
            allowed="tls://HOST:PORT, or a scheduler on this machine",
            cure="Whoever reaches a scheduler can run programs on its workers and change what is sent: use TLS, or "
            "a tunnel such as 'ssh -L 8786:localhost:8786 HOST'. In a network that you trust, give `insecure`.",
        )
    return full


def _without_password(address: str) -> str:
    """Return an address as messages show it: nobody reads there what stands before an @."""
    protocol, _, rest = address.rpartition("://")
    named = f"{protocol}://" if protocol in _PROTOCOLS else ""
    return f"{named}...@{rest.rpartition('@')[2]}" if "@" in address else address


def _is_here(host: str) -> bool:
    """Return whether a host is this machine by its name or number."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _within(seconds: float, work: Callable[[], R]) -> R:
    """Return what a function returns.

    Raises:
        TimeoutError: If it takes longer. What it does is then nobody's, and ends with this process.
    """
    done = Future[R]()

    def do() -> None:
        try:
            done.set_result(work())
        except BaseException as error:
            done.set_exception(error)

    threading.Thread(target=do, daemon=True).start()
    return done.result(seconds)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise InputError(
            "schedulers are reached by Dask, and it is not installed",
            parameter="scheduler",
            cure='Install it with truearm: pip install "truearm[fleet]".',
        ) from error
    return distributed
