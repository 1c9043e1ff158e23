"""Typing into fields of a page without a browser, and waiting until what was typed is taken."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace
from typing import Any

from truearm.studio.serving import Studio


def typed(studio: Studio, element: Any, value: Any) -> None:
    """Give a field a value as somebody does who types it, and wait until it is taken or refused."""
    with studio.window.lock:
        element._impl.value = value
        for callback in element._impl.update_cb:
            callback(SimpleNamespace(client=object(), target=element))
    end = time.monotonic() + 30.0
    while any(isinstance(one, threading.Timer) for one in threading.enumerate()) and time.monotonic() < end:
        time.sleep(0.005)
    with studio.window.lock:
        pass
