"""What a window may say: values that an element can have, and messages of the kind that they say they are."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Final

import msgspec
import viser

#: So long a text may be that somebody types.
_TEXT: Final = 10_000
#: So large a number may be: all whole ones up to it can be told apart.
_NUMBER: Final = 2.0**53


def fits(element: Any, value: object) -> bool:
    """Return whether an element of the window can have a value; nothing else is ever put there."""
    if hasattr(element, "options"):
        return value in element.options
    return _is_like(getattr(element, "value", None), value)


def checked(message: Mapping[str, Any], kind: str, *, closely: bool) -> None:
    """Refuse a message that its kind cannot be made of, as viser would stumble over it.

    Args:
        closely: Whether its fields must be of the kinds that viser's page sends, and its numbers finite.

    Raises:
        ValueError: If it cannot be.
    """
    if not all(isinstance(name, str) for name in message):
        raise ValueError(f"a message {kind} with a name that is no text")
    fields = {name: value for name, value in message.items() if name != "type"}
    try:
        if closely:
            msgspec.convert(fields, getattr(viser._messages, kind))
        viser._messages.Message.deserialize(msgspec.msgpack.encode(message))
    except Exception as error:  # whatever it is that its fields cannot be made of
        raise ValueError(f"a message {kind} that cannot be read") from error
    if closely and not _is_finite(fields):
        raise ValueError(f"a message {kind} with a number that is not finite")


def _is_like(known: object, value: object) -> bool:
    if isinstance(known, bool) or isinstance(value, bool):
        return isinstance(known, bool) and isinstance(value, bool)
    if isinstance(known, int | float):
        return isinstance(value, int | float) and abs(value) <= _NUMBER  # NaN is not
    if isinstance(known, str):
        return isinstance(value, str) and len(value) <= _TEXT
    if isinstance(known, tuple):
        return isinstance(value, list) and len(value) == len(known) and all(map(_is_like, known, value))
    return False


def _is_finite(value: object) -> bool:
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, Mapping):
        return all(map(_is_finite, value.values()))
    return all(map(_is_finite, value)) if isinstance(value, list) else True
