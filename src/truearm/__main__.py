"""The command ``truearm``, also as ``python -m truearm``: what it needs before any other module is loaded.

Whatever stops it, it ends with a short message or none: closed streams, Ctrl-C while modules load, a warning of a
library.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from io import TextIOWrapper
from typing import Any, NoReturn

#: Exit code of what Ctrl-C stopped, as shells have it.
_INTERRUPTED = 130


class _Interrupts:
    """Ctrl-C: ends the command at once while modules load, which may not survive it, and raises an exception later.

    Attributes:
        came: Whether somebody pressed it, whatever exception that became on its way out.
    """

    came = False
    _loading = True

    def watch(self) -> None:
        """Take over from Python, unless Ctrl-C is to be ignored (``nohup``)."""
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._stop)
            sys.unraisablehook = self._lost

    def loaded(self) -> None:
        """Let what runs put things in order when it is interrupted."""
        self._loading = False

    def _stop(self, *_: object) -> NoReturn:
        if self._loading:
            os._exit(_INTERRUPTED)
        self.came = True
        raise KeyboardInterrupt

    def _lost(self, lost: Any) -> None:
        """Interrupt again where the first time fell into a place from which no exception comes out."""
        if isinstance(lost.exc_value, KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        else:
            sys.__unraisablehook__(lost)


def main() -> None:
    """Run the command."""
    interrupts = _Interrupts()
    interrupts.watch()
    _prepare_streams()
    if not sys.warnoptions:  # whoever asks for them with -W or PYTHONWARNINGS gets them
        import warnings

        warnings.simplefilter("ignore")
    from truearm.commands import main as run

    interrupts.loaded()
    try:
        run()
    except BaseException:
        if not interrupts.came:
            raise
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(_INTERRUPTED)  # everything is in order, and Python's own end may not survive what was cut off


def _prepare_streams() -> None:
    """Make sure that standard streams are there and can print any text; without standard output nothing runs."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:  # a closed one would be the next file that is opened, and messages would end in it
            os.open(os.devnull, os.O_RDWR)
    if sys.stderr is None:
        sys.stderr = os.fdopen(2, "w", closefd=False)
    if sys.stdout is None:
        sys.stderr.write("truearm: standard output is closed. Send it to a file, or to /dev/null.\n")
        sys.exit(2)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    main()
