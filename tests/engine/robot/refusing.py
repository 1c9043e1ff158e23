"""Looks at a refusal: at its parameter and at telling pieces of its message."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from truearm.engine.base.errors import InputError


@contextmanager
def refused(*parts: str, parameter: str | None = None, of: object = "") -> Iterator[None]:
    """Expect a refusal that says these parts; `of` tells which of several cases failed."""
    said: InputError | None = None
    try:
        yield
    except InputError as refusal:
        said = refusal
    assert said is not None, f"{of}: it is not refused"
    missing = [part for part in parts if part not in str(said)]
    assert not missing, f"{of}: '{said}' does not say {missing}"
    assert parameter in (None, said.parameter), f"{of}: '{said}' is about {said.parameter}"
