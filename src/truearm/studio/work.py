"""Long actions: each in a process of its own, so that the window stays alive and cancelling ends it at once."""

from __future__ import annotations

import multiprocessing
import sys
import threading
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, Final

from truearm.engine.base.errors import InputError

#: New processes import what they need: this one has threads and a server, which a copy of it would not.
_PROCESSES: Final = multiprocessing.get_context("spawn")


class Work:
    """A function that runs elsewhere.

    Args:
        do: Called in the other process with `arguments` and a function ``progress``; it and what it returns can be
            pickled.
        said: Called with the words of its progress.
        ended: Called once with what it returned, with its refusal, or with None where it was cancelled.
    """

    def __init__(
        self,
        do: Callable[..., Any],
        arguments: dict[str, Any],
        said: Callable[[str], None],
        ended: Callable[[Any], None],
    ) -> None:
        self._said, self._ended = said, ended
        self._cancelled = False
        self.began = time.monotonic()
        mine, theirs = _PROCESSES.Pipe(duplex=False)
        self._process = _PROCESSES.Process(target=_run, args=(theirs, do, arguments), daemon=True)
        self._process.start()
        theirs.close()
        self._watcher = threading.Thread(target=self._watch, args=(mine,), daemon=True)
        self._watcher.start()

    def cancel(self) -> None:
        """End it at once; what it was writing is put back by whatever writes there next."""
        self._cancelled = True
        with suppress(ValueError):  # it has ended, and is closed
            self._process.kill()

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended and its end is told; return whether it has."""
        self._watcher.join(seconds)
        return not self._watcher.is_alive()

    def _watch(self, source: Connection) -> None:
        outcome: Any = InputError(
            "the process that did this has died", cure="The computer may be short of memory. Try again."
        )
        with suppress(EOFError, OSError), source:
            while True:
                kind, content = source.recv()
                if kind == "progress":
                    self._said(content)
                    continue
                outcome = content
                break
        self._process.join()
        self._process.close()  # its pipe would stay open until somebody collects it
        self._ended(None if self._cancelled else outcome)


def _run(target: Connection, do: Callable[..., Any], arguments: dict[str, Any]) -> None:
    """Run in the other process: it ends where nobody listens any more."""

    def progress(words: str) -> None:
        try:
            target.send(("progress", words))
        except OSError:
            sys.exit(1)

    try:
        outcome: Any = do(**arguments, progress=progress)
    except InputError as error:
        outcome = error
    except Exception as error:
        outcome = unforeseen(error)
    with suppress(OSError):
        target.send(("ended", outcome))
    target.close()


def unforeseen(error: Exception) -> InputError:
    """Return a refusal for what nobody has foreseen; its place is printed on standard error."""
    traceback.print_exception(error)
    return InputError(
        f"this failed in an unforeseen way ({type(error).__name__}: {error})",
        cure="Run the command of the same name on the same files, and report what it says.",
    )
