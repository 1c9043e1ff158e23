"""Looks at a refusal: at its parameter and at telling pieces of its message."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from truearm.engine.base.errors import InputError


@contextmanager
def refused(*parts: str, parameter: str | None = None, of: object = "") -> Iterator[None]:
    """Expect a refusal that says these parts; `of` tells which of several cases failed."""
    words: InputError | None = None
    try:
        yield
    except InputError as refusal:
        words = refusal
    assert words is not None, f"{of}: it is not refused"
    missing = [part for part in parts if part not in str(words)]
    assert not missing, f"{of}: '{words}' does not say {missing}"
    assert parameter in (None, words.parameter), f"{of}: '{words}' is about {words.parameter}"
