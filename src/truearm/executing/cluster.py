"""Workers of a Dask cluster: reached through its scheduler, which runs whatever it is sent."""

from __future__ import annotations

import ipaddress
import logging
import pkgutil
import time
from concurrent.futures import Executor
from typing import Any, Final
from urllib.parse import urlsplit

from truearm.errors import InputError, Words
from truearm.shown import counted, listed
from truearm.version import __version__

#: How long to wait for the scheduler, and for its first worker [s].
PATIENCE: Final = 8.0
#: How long there may be no worker before the work is given up [s].
_ALONE: Final = 60.0
#: How often to ask the scheduler about its workers [s].
_LOOK: Final = 2.0
_PROTOCOLS: Final = ("tcp", "tls")
_RUN_AGAIN: Final = "Run this again when it is there: what is on disk is not computed twice."


class Cluster:
    """Parts are done by the workers of a Dask scheduler.

    Parameters
    ----------
    address
        Of the scheduler, ``tcp://HOST:PORT`` or ``tls://HOST:PORT``.
    insecure
        Whether a scheduler on another machine may be reached without TLS.

    Raises
    ------
    InputError
        If Dask is not installed, the address is none or is another machine's without TLS, the scheduler cannot be
        reached or has no workers, or a worker has another version of truearm.
    """

    def __init__(self, address: str, *, insecure: bool) -> None:
        self._address = checked_address(address, insecure=insecure)
        distributed = _distributed()
        self.lost: tuple[type[BaseException], ...] = (distributed.KilledWorker,)
        for name in ("client", "core", "comm", "batched"):
            logging.getLogger(f"distributed.{name}").setLevel(logging.CRITICAL)  # what happens is told, and once
        self._client = self._reached(distributed)
        try:
            self._workers = self._waited_for_workers()
            self._refuse_other_versions([*self._workers])
        except BaseException:
            self._client.close(timeout=1)
            raise
        self._looked = self._seen = time.monotonic()
        self.executor: Executor = self._client.get_executor(pure=False)

    def _reached(self, distributed: Any) -> Any:
        import dask

        try:
            with dask.config.set({"distributed.comm.timeouts.connect": PATIENCE}):
                return distributed.Client(self._address, timeout=PATIENCE, set_as_default=False)
        except TypeError as error:  # what Dask raises for TLS without certificates
            raise InputError(
                f"the scheduler cannot be reached by TLS ({_first_line(error)})",
                parameter="scheduler",
                came=self._address,
                cure="Name the certificates in Dask's configuration: distributed.comm.tls.",
            ) from error
        except (OSError, ValueError, RuntimeError) as error:
            raise InputError(
                "no Dask scheduler answers there",
                parameter="scheduler",
                came=self._address,
                cure="Start one with 'dask scheduler', or correct the address.",
            ) from error

    def _waited_for_workers(self) -> dict[str, Any]:
        """Return the workers as soon as there are any."""
        until = time.monotonic() + PATIENCE
        while not (found := self._known()):
            if time.monotonic() > until:
                raise InputError(
                    "the scheduler has no workers",
                    parameter="scheduler",
                    came=self._address,
                    cure=f"Start some with 'dask worker {self._address} --nthreads 1'.",
                )
            time.sleep(0.1)
        return found

    def _known(self) -> dict[str, Any]:
        return dict(self._client.scheduler_info()["workers"])

    def _refuse_other_versions(self, workers: list[str]) -> None:
        """Refuse workers whose results would not be those of this version."""
        there = self._client.run(
            pkgutil.resolve_name, "truearm.version:__version__", workers=workers, on_error="return"
        )
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

    def renew(self) -> bool:
        """Wait for the scheduler, where its connection was lost, and for workers."""
        until = time.monotonic() + PATIENCE
        while self._client.status != "running":
            if time.monotonic() > until or self._client.status == "closed":
                raise InputError("the scheduler is gone", parameter="scheduler", came=self._address, cure=_RUN_AGAIN)
            time.sleep(0.1)
        try:
            self._workers = self._waited_for_workers()
            self._refuse_other_versions([*self._workers])
        except OSError as error:
            raise InputError(
                "the scheduler is gone", parameter="scheduler", came=self._address, cure=_RUN_AGAIN
            ) from error
        self.executor = self._client.get_executor(pure=False)
        return True

    def news(self) -> list[str]:
        """Return which workers have gone and come.

        Raises
        ------
        InputError
            If there was none for a minute, or a new one has another version of truearm.
        """
        now = time.monotonic()
        if now - self._looked < _LOOK or self._client.status != "running":
            return []
        self._looked = now
        try:
            found = self._known()
            self._refuse_other_versions([address for address in found if address not in self._workers])
        except OSError:  # the connection is being lost: its parts will say so
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
        self.executor.shutdown(wait=finish)
        self._client.close(timeout=1)


def checked_address(address: str, *, insecure: bool) -> str:
    """Return the address of a scheduler with its protocol, or refuse one that somebody else could listen to.

    Raises
    ------
    InputError
        For no address, and for another machine's without TLS unless `insecure`.
    """
    full = address if "://" in address else f"tcp://{address}"
    try:
        parts = urlsplit(full)
        host, port = parts.hostname, parts.port
    except ValueError:
        parts, host, port = urlsplit(""), None, None
    if parts.scheme not in _PROTOCOLS or not host or port is None:
        raise InputError(
            "this is no address of a scheduler",
            parameter="scheduler",
            came=address,
            allowed="tcp://HOST:PORT or tls://HOST:PORT",
        )
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


def _is_here(host: str) -> bool:
    """Return whether a host is this machine by its name or number."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def _first_line(error: BaseException) -> str:
    return str(error).strip().partition("\n")[0].rstrip(".")


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
