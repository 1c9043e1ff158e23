"""Who does the parts of great work: this process, other processes of this machine, or any executor."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import wait
from typing import Final, ParamSpec, TypeVar

from truearm.engine.base.errors import InputError, Words

P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")

#: BLAS of one thread in every worker: NumPy reads this when it is first imported.
_ONE_THREAD: Final = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
#: What to do where workers have gone.
_RUN_AGAIN: Final = "Run this again with it: what is on disk is not computed twice."


class Workers:
    """Who does parts of work: an executor, and what to do where those that it has die.

    Attributes:
        in_flight: How many parts are handed out at once: enough that nobody waits, and no more.
        lost: What is raised for a part that workers died of, after it was repeated.
    """

    lost: tuple[type[BaseException], ...] = ()

    def __init__(self, executor: Executor, in_flight: int) -> None:
        self._executor, self.in_flight = executor, in_flight

    def handed(self, work: Callable[[T], R], part: T) -> Future[R] | None:
        """Hand out a part; None if workers have just died.

        Raises:
            InputError: If nobody takes it.
        """
        try:
            return self._executor.submit(work, part)
        except BrokenExecutor:
            return None

    def refusal(self, error: Exception) -> InputError | None:
        """Return what to say of an error in the place of a result; None if it is the work's own."""
        return None

    def renew(self) -> None:
        """Put new workers in the place of those that died.

        Raises:
            InputError: If that cannot be done.
        """

    def news(self) -> list[str]:
        """Return what has happened to workers since the last time, in plain words.

        Raises:
            InputError: If nobody is left who could do the work.
        """
        return []

    def close(self, *, finish: bool) -> None:
        """Let go of the workers, of what they are doing too unless they shall finish it."""


class _InThisThread(Executor):
    def submit(self, fn: Callable[P, R], /, *args: P.args, **kwargs: P.kwargs) -> Future[R]:
        future = Future[R]()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class ThisProcess(Workers):
    """Parts are done here, one after the other."""

    def __init__(self) -> None:
        super().__init__(_InThisThread(), 1)


class Processes(Workers):
    """Parts are done by processes of this machine, each with one BLAS thread.

    They are started anew and not copied (``spawn``), so that threads and locks of this process do them no harm; they
    end with this process, however that ends; and they leave Ctrl-C to it.

    Args:
        workers: How many.
    """

    def __init__(self, workers: int) -> None:
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise InputError(
                "a worker process is asked for workers of its own while it loads the program",
                parameter="workers",
                cure="In a script that Python runs, call the job below: if __name__ == '__main__'.",
            )
        self._workers = workers
        self._environment = {name: os.environ.get(name) for name in _ONE_THREAD}
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))
        super().__init__(self._pool(), in_flight=2 * workers)  # the next one is there when one is done

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self._workers, mp_context=multiprocessing.get_context("spawn"), initializer=_begin)

    def renew(self) -> None:
        """Start new processes."""
        self._executor.shutdown(wait=False, cancel_futures=True)
        self._executor = self._pool()

    def close(self, *, finish: bool) -> None:
        """End the processes."""
        self._executor.shutdown(wait=finish, cancel_futures=True)
        for name, value in self._environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin() -> None:
    """Prepare a worker process: Ctrl-C is its parent's, and it ends when that ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    """End this process when another has ended: its pipes stay open in its fellows, and it would wait for ever."""
    wait([sentinel])
    os._exit(1)


class Given(Workers):
    """Parts are done by an executor that somebody else has made, and closes.

    Args:
        executor: Any :class:`concurrent.futures.Executor`.
        in_flight: How many parts it is handed at once.
    """

    def __init__(self, executor: Executor, in_flight: int = 32) -> None:
        super().__init__(executor, in_flight)

    def handed(self, work: Callable[[T], R], part: T) -> Future[R] | None:
        """Hand out a part; None if it is broken, as a pool is whose worker died."""
        try:
            future = self._executor.submit(work, part)
        except BrokenExecutor:
            return None
        except Exception as error:
            raise InputError(
                "the executor takes no work",
                parameter="executor",
                came=_words(error),
                cure="Give one that works and is not shut down. " + _RUN_AGAIN,
            ) from error
        if not isinstance(future, Future):
            raise InputError(
                "the executor does not return futures as concurrent.futures has them",
                parameter="executor",
                came=Words(type(future).__qualname__),
            )
        return future

    def refusal(self, error: Exception) -> InputError | None:
        """Return that the executor has not done a part: what goes wrong in the work itself is a result."""
        return InputError(
            "the executor has not done a part of the work",
            parameter="executor",
            came=_words(error),
            cure=f"Give one whose workers have what this process has. {_RUN_AGAIN}",
        )

    def renew(self) -> None:
        """Refuse: it is not ours."""
        raise InputError(
            "the workers of the executor are gone", parameter="executor", cure=f"Make a new one. {_RUN_AGAIN}"
        )


def _words(error: Exception) -> Words:
    """Return the kind of an error and what it says, on one line."""
    text = " ".join(str(error).split())
    return Words(f"{type(error).__name__}: {text}" if text else type(error).__name__)


@contextmanager
def with_workers(workers: Workers) -> Iterator[Workers]:
    """Let go of workers at the end: at once where something went wrong."""
    try:
        yield workers
    except BaseException:
        workers.close(finish=False)
        raise
    workers.close(finish=True)


def processes(workers: int) -> Workers:
    """Return so many processes of this machine; this one alone for one."""
    return ThisProcess() if workers == 1 else Processes(workers)
