"""What readings come from, as the measuring sees it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from truearm.measurement.measuring.readings import Reading
from truearm.measurement.measuring.session import Entry, Session
from truearm.notices import Notice


def _nobody(entry: Entry) -> None:
    """Tell nobody."""


@dataclass(frozen=True, eq=False)
class Incoming:
    """What came."""

    reading: Reading | None = None  #: That was read; None where a point is left out.
    #: Configuration and name of the point that is left out, and why in words; None for a reading.
    left: tuple[str, str, str] | None = None
    reply: Callable[[Entry], None] = _nobody  #: Called with what became of it, once that is on disk.
    refuse: Callable[[str], None] = lambda words: None  #: Called with words where it cannot be taken.


class Source(Protocol):
    """A virtual instrument, a folder that is watched, or a port that is listened to."""

    @property
    def kind(self) -> str:
        """``virtual``, ``watch`` or ``listen``."""

    @property
    def waiting(self) -> str:
        """For what it waits, in words."""

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know about it so far."""

    def poll(self, session: Session, seconds: float) -> list[Incoming]:
        """Return what has come, or comes within some time."""

    def told(self) -> list[str]:
        """Return what is to be said of what could not be read, once each."""

    def close(self) -> None:
        """Let go of what it holds."""
