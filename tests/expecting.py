"""What tests say of what they are given: that it is known, and that a call is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

import pytest

from truearm.engine.base.errors import InputError

T = TypeVar("T")


def known(value: T | None) -> T:
    """Return what may be unknown elsewhere, and is known here."""
    assert value is not None
    return value


def refused(parameter: str | None, words: str, call: Callable[..., object], *given: object, **named: object) -> str:
    """Return what is said of a call that is refused: with these words, a pattern, and naming this parameter."""
    with pytest.raises(InputError, match=words or None) as refusal:
        call(*given, **named)
    assert parameter in (None, refusal.value.parameter), refusal.value
    return str(refusal.value)


@contextmanager
def refusing(*parts: str, parameter: str | None = None, of: object = "") -> Iterator[None]:
    """Expect a refusal of what stands within that says these parts; `of` tells which of several cases failed."""
    said: InputError | None = None
    try:
        yield
    except InputError as refusal:
        said = refusal
    assert said is not None, f"{of}: it is not refused"
    missing = [part for part in parts if part not in str(said)]
    assert not missing, f"{of}: '{said}' does not say {missing}"
    assert parameter in (None, said.parameter), f"{of}: '{said}' is about {said.parameter}"
