"""Who looks on while a solver takes its steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from truearm.modeling.chain import Array

#: Called at every step with the problem, the vector of its free parameters ``(parameters,)`` and the cost there: the
#: sum of squares that is made small.
Watch = Callable[[object, Array, float], None]
_WATCH: ContextVar[Watch | None] = ContextVar("watch", default=None)


@contextmanager
def watching(watch: Watch) -> Iterator[None]:
    """Let somebody look on at every step that solvers take in this block."""
    token = _WATCH.set(watch)
    try:
        yield
    finally:
        _WATCH.reset(token)


def step_taken(problem: object, vector: Array, cost: float) -> None:
    """Tell of a step."""
    watch = _WATCH.get()
    if watch is not None:
        watch(problem, vector, cost)
