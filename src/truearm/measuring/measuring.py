"""Measuring a plan with an instrument, reading by reading."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TYPE_CHECKING, Final

from truearm.measuring.open_campaign import OpenCampaign, opened
from truearm.measuring.result import Measured

if TYPE_CHECKING:
    from truearm.measuring.measure import Measure

#: How long a source is waited for before somebody is asked whether to stop [s].
_TURN: Final = 0.5


def measured(asked: Measure) -> Measured:
    """Take one reading after the other until all are there, or somebody stops."""
    with opened(asked) as campaign:
        _begun(campaign, asked.tell, with_token=asked.token is None)
        with _stopped_by_hand() as stopped:
            last = time.monotonic()
            while not campaign.session.done and not stopped():
                step = campaign.session.next
                if step is not None:
                    words = f"{step.number} of {step.of}: {step.label} {step.names[0]}, {campaign.source.waiting}"
                    asked.progress(words)
                left = _TURN if asked.timeout is None else asked.timeout - (time.monotonic() - last)
                entries = campaign.step(max(0.0, min(_TURN, left)))
                for line in campaign.source.messages():
                    asked.tell(line)
                for entry in entries:
                    asked.tell(entry.line())
                if entries:
                    last = time.monotonic()
                elif asked.timeout is not None and time.monotonic() - last >= asked.timeout:
                    break
        asked.progress("writing the measurements")
        return campaign.finish()


def _begun(campaign: OpenCampaign, tell: Callable[[str], None], *, with_token: bool) -> None:
    from truearm.measuring.sources import HOST, Listener

    session = campaign.session
    if campaign.before:
        tell(f"Going on after {campaign.before} entries of the log: {session.outstanding} readings are still to come.")
    if isinstance(campaign.source, Listener):
        token = f", token {campaign.source.token}" if with_token else ""
        tell(f"Listening on {HOST} port {campaign.source.port}{token}")


@contextmanager
def _stopped_by_hand() -> Iterator[Callable[[], bool]]:
    """Tell whether Ctrl-C was pressed, instead of ending in the middle of a line; the second one ends at once."""
    pressed = threading.Event()

    def press(number: int, frame: FrameType | None) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()

    if threading.current_thread() is not threading.main_thread():
        yield pressed.is_set
        return
    before = signal.signal(signal.SIGINT, press)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
