"""Parts of work done by workers, also those of a Dask cluster, whose scheduler runs whatever it is sent."""

from __future__ import annotations

import ipaddress
import logging
import pkgutil
import re
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import Any, Final, Generic, TypeVar
from urllib.parse import urlsplit

from truearm.engine.base.errors import InputError, Words, counted, listed
from truearm.engine.base.version import __version__
from truearm.engine.base.workers import Workers

P = TypeVar("P")
R = TypeVar("R")

#: How long to wait for the scheduler, and for its first worker [s].
PATIENCE: Final = 4.0
#: How much longer than that reaching it may take in all [s].
_MARGIN: Final = 1.0
#: How long scheduler and workers may take to answer while they work [s].
_ANSWER: Final = 60.0
#: How long there may be no worker before the work is given up [s].
_ALONE: Final = 60.0
#: How often to ask the scheduler about its workers [s].
_LOOK: Final = 2.0
#: How schedulers are reached.
_PROTOCOLS: Final = ("tcp", "tls")
#: Names and numbers of machines.
_HOST: Final = re.compile(r"[0-9A-Za-z_.:%-]+")
#: Who prints tracebacks where a connection is lost; Dask gives the second one a level of its own.
_LOGGERS: Final = ("distributed", "distributed.client", "tornado.application")
#: What to do where the cluster has gone.
_RUN_AGAIN: Final = "Run this again when it is there: what is on disk is not computed twice."


class Cluster(Workers):
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
        self.lost = (distributed.KilledWorker,)
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)  # what happens is told, and once
        self._client = self._reached(distributed)
        try:
            super().__init__(self._client.get_executor(pure=False), 1)
            self._wait_for_workers()
        except BaseException:
            self._client.close(timeout=1)
            raise
        self._looked = self._seen = time.monotonic()

    def _refused(self, what: str, cure: str = _RUN_AGAIN) -> InputError:
        return InputError(what, parameter="scheduler", came=self._address, cure=cure)

    def _reached(self, distributed: Any) -> Any:
        """Return a client of the scheduler; Dask alone would wait for ever for what begins to speak and stops."""
        encrypted = self._address.startswith("tls")
        if encrypted and distributed.Security().get_connection_args("client").get("ssl_context") is None:
            raise self._refused(
                "the scheduler is reached by TLS, and there are no certificates for that",
                "Name them in Dask's configuration: distributed.comm.tls.",
            )
        client = distributed.Client.__new__(distributed.Client)
        try:
            _within(PATIENCE + _MARGIN, lambda: client.__init__(self._address, timeout=PATIENCE, set_as_default=False))
        except ImportError as error:
            client.status = "closed"  # or it would be waited for when it is forgotten
            raise self._refused(
                "the scheduler has another version of Dask, or of what Dask needs",
                "Install the same versions of dask and distributed on all machines.",
            ) from error
        except Exception as error:  # whatever the words of something else are taken for
            client.status = "closed"
            certificates = ", or its certificates" if encrypted else ""
            raise self._refused(
                "no Dask scheduler answers there",
                f"Start one with 'dask scheduler', or correct the address{certificates}.",
            ) from error
        return client

    def _wait_for_workers(self) -> None:
        until = time.monotonic() + PATIENCE
        while not (workers := self._known(PATIENCE)):
            if time.monotonic() > until:
                raise self._refused("the scheduler has no workers", f"Start some with 'dask worker {self._address}'.")
            time.sleep(0.1)
        self._refuse_other_versions([*workers])
        self._take(workers)

    def _take(self, workers: dict[str, Any]) -> None:
        """Work with these from now on, two parts a thread: the next one is there when one is done."""
        self._workers = workers
        self.in_flight = 2 * max(1, sum(int(worker["nthreads"]) for worker in workers.values()))

    def _known(self, patience: float) -> dict[str, Any]:
        """Return all workers by their addresses."""
        try:
            return dict(_within(patience, lambda: self._client.scheduler_info(n_workers=-1))["workers"])
        except TimeoutError as error:
            raise self._refused("the scheduler does not answer any more") from error

    def _refuse_other_versions(self, workers: list[str]) -> None:
        if not workers:
            return
        version_of = "truearm.engine.base.version:__version__"
        run = partial(self._client.run, pkgutil.resolve_name, version_of, workers=workers, on_error="return")
        try:
            versions = _within(_ANSWER, run)
        except TimeoutError as error:
            raise self._refused(
                "workers of the scheduler do not answer", "Look at what they print, and start them again."
            ) from error
        others = {address: version for address, version in versions.items() if version != __version__}
        if others:
            address, version = next(iter(others.items()))
            shown_version = version if isinstance(version, str) else "no truearm"
            raise InputError(
                f"{counted(len(others), 'worker')} of the scheduler {'has' if len(others) == 1 else 'have'} another "
                f"version of truearm ({listed([*others])})",
                parameter="scheduler",
                came=Words(f"{shown_version} on {address}"),
                allowed=__version__,
                cure="Install the same version on all of them.",
            )

    def handed(self, work: Callable[[P], R], part: P) -> Future[R] | None:
        """Hand out a part; None if the connection was lost."""
        try:
            return self._executor.submit(work, part)
        except Exception:  # of Dask, which has sent nothing: the work is done elsewhere
            return None

    def renew(self) -> None:
        """Wait for the scheduler, where its connection was lost, and for workers."""
        until = time.monotonic() + PATIENCE
        while self._client.status != "running":
            if time.monotonic() > until or self._client.status == "closed":
                raise self._refused("the scheduler is gone")
            time.sleep(0.1)
        try:
            self._wait_for_workers()
        except InputError:
            raise
        except Exception as error:  # of Dask, whose connection is lost again
            raise self._refused("the scheduler is gone") from error
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
            known = self._known(_ANSWER)
            self._refuse_other_versions([address for address in known if address not in self._workers])
        except InputError:
            raise
        except Exception:  # of Dask, whose connection is being lost: its parts will say so
            return []
        gone = [address for address in self._workers if address not in known]
        self._take(known)
        if known:
            self._seen = now
        elif now - self._seen > _ALONE:
            raise self._refused("all workers of the scheduler are gone")
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
    if parts.scheme == "tcp" and not insecure and not is_loopback(host):
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
    protocol, _, location = address.rpartition("://")
    named = f"{protocol}://" if protocol in _PROTOCOLS else ""
    return f"{named}...@{location.rpartition('@')[2]}" if "@" in address else address


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a host."""
    if host == "localhost":
        return True
    with suppress(ValueError):
        return ipaddress.ip_address(host).is_loopback
    return False


def _within(seconds: float, work: Callable[[], R]) -> R:
    """Return what a function returns.

    Raises:
        TimeoutError: If it takes longer. What it does is then nobody's, and ends with this process.
    """
    future = Future[R]()

    def do() -> None:
        try:
            future.set_result(work())
        except BaseException as error:
            future.set_exception(error)

    threading.Thread(target=do, daemon=True).start()
    return future.result(seconds)


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


# Parts of work: a bounded number at once, results as they come, lost ones repeated.
Part = TypeVar("Part")
Result = TypeVar("Result")

#: How often workers may die of a part that is done alone before it is given up.
_MOST_DEATHS: Final = 3
#: How often workers may die one after the other before any part is done.
_MOST_IN_A_ROW: Final = 10
#: How long to wait before looking after the workers [s].
_PATIENCE: Final = 1.0


@dataclass(frozen=True)
class DonePart(Generic[Part, Result]):
    """A part with its result; lost, and without one, if the workers that did it died again and again."""

    part: Part
    result: Result | None
    lost: bool = False


def done_parts(
    work: Callable[[Part], Result],
    parts: Iterable[Part],
    workers: Workers,
    tell: Callable[[str], None] = lambda _: None,
) -> Iterator[DonePart[Part, Result]]:
    """Do parts of work, and return each as soon as it is done.

    Where a worker dies, new ones are started. Nobody knows of which of the parts that were being done it died, so they
    are repeated one by one; one that kills its worker again and again is given up.

    Args:
        work: A function of a module; it and the parts go to other processes.
        parts: Taken as workers ask for them.
        workers: Who does them.
        tell: Called with what happened to workers.

    Raises:
        InputError: If the workers are gone and cannot be replaced, or all end before they have done anything.
    """
    run = _Run(work, iter(parts), workers, tell)
    try:
        yield from run.results()
    finally:
        for future in run.running:
            future.cancel()


class _Run(Generic[Part, Result]):
    """What is being done, and what will be repeated alone because a worker died while it was done.

    Each part with how often a worker has died of it alone; -1 while none has died.
    """

    def __init__(
        self, work: Callable[[Part], Result], parts: Iterator[Part], workers: Workers, tell: Callable[[str], None]
    ) -> None:
        self._work, self._parts, self._workers, self._tell = work, parts, workers, tell
        self.running: dict[Future[Result], tuple[Part, int]] = {}
        self._suspects: deque[tuple[Part, int]] = deque()
        self._in_a_row = 0

    def results(self) -> Iterator[DonePart[Part, Result]]:
        """Go on until every part is done or given up."""
        while self._hand_out():
            finished, _ = wait(self.running, _PATIENCE, FIRST_COMPLETED)
            for words in self._workers.news():
                self._tell(words)
            broken: BaseException | None = None
            for future in finished:
                try:
                    outcome = DonePart(self.running[future][0], future.result())
                except self._workers.lost:
                    outcome = DonePart[Part, Result](self.running[future][0], None, lost=True)
                except (BrokenExecutor, CancelledError) as error:
                    broken = error
                    continue
                except InputError:
                    raise
                except Exception as error:
                    refusal = self._workers.refusal(error)
                    if refusal is None:
                        raise
                    raise refusal from error
                else:
                    self._in_a_row = 0
                del self.running[future]
                yield outcome
            if broken is not None:
                yield from self._broken(broken)

    def _hand_out(self) -> bool:
        """Hand out as many parts as may be done at once; return whether any is being done."""
        while not self._suspects and len(self.running) < self._workers.in_flight:
            if not (next_part := [*islice(self._parts, 1)]):
                break
            self._hand(next_part[0], -1)
        while self._suspects and not self.running:
            self._hand(*self._suspects.popleft())
            if not self.running:
                self._renew()
        return bool(self.running)

    def _hand(self, part: Part, deaths: int) -> None:
        """Hand out a part, or keep it where a worker has just died."""
        future = self._workers.handed(self._work, part)
        if future is None:
            self._suspects.appendleft((part, max(deaths, 0)))
        else:
            self.running[future] = part, deaths

    def _broken(self, reason: BaseException) -> Iterator[DonePart[Part, Result]]:
        """Repeat what was being done, or give up the part of which a worker died alone too often."""
        running = [(part, deaths + 1) for part, deaths in self.running.values()]
        self.running.clear()
        part, deaths = running[0]
        if deaths == _MOST_DEATHS:
            self._tell("a worker died of the same part again, and the part is given up")
        else:
            self._tell(f"a worker died, and {counted(len(running), 'part')} will be repeated")
            self._suspects.extendleft(reversed(running))
        try:
            self._renew()
        except InputError as error:
            raise error from reason
        if deaths == _MOST_DEATHS:
            yield DonePart(part, None, lost=True)

    def _renew(self) -> None:
        self._in_a_row += 1
        if self._in_a_row > _MOST_IN_A_ROW:
            raise InputError(
                "worker processes end before they have done anything",
                parameter="workers",
                cure="Look at what they print. In a script that Python runs, call the job below: "
                "if __name__ == '__main__'.",
            )
        self._workers.renew()
