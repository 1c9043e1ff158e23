"""Texts that somebody types into fields: taken once the typing rests, or when something else is done."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Any, Final

#: A text is taken when nothing was typed for so long [s].
_REST: Final = 0.6


class TypingAtRest:
    """What was typed and is not taken yet.

    Args:
        lock: Held while something is taken.
        sent: Returns the value that a window has sent for a field.
        take: Takes a value that was typed into a field, by doing what follows; returns whether nothing was refused.
        begun: Called with a field as often as somebody types in it.
    """

    def __init__(
        self,
        lock: threading.RLock,
        sent: Callable[[Any], Any],
        take: Callable[[Any, Any, Callable[[], None]], bool],
        begun: Callable[[Any], None],
    ) -> None:
        self._lock, self._sent, self._take, self._begun = lock, sent, take, begun
        self._typing: dict[object, tuple[threading.Timer, Callable[[], bool]]] = {}

    def settled(self, do: Callable[[], None]) -> Callable[[Any], None]:
        """Return a callback for a field: `do` is called once the typing rests, or before what is done next."""
        key = object()

        def called(event: Any) -> None:
            if getattr(event, "client", None) is None:
                return
            typed = self._sent(event.target)  # the pages may be shown anew before the lock is free
            with self._lock:
                if key in self._typing:
                    self._typing.pop(key)[0].cancel()
                self._begun(event.target)
                timer = threading.Timer(_REST, self._rested, (key,))
                timer.daemon = True
                self._typing[key] = (timer, partial(self._take, event.target, typed, do))
                timer.start()

        return called

    def take_all(self) -> bool:
        """Take everything that was typed; return whether nothing of it was refused."""
        taken = [self._rested(key) for key in [*self._typing]]  # each, whatever became of those before
        return all(taken)

    def _rested(self, key: object) -> bool:
        with self._lock:
            timer, take = self._typing.pop(key, (None, None))
            if timer is None or take is None:
                return True
            timer.cancel()
            return take()
