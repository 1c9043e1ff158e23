"""What a person should know about a result although nothing failed."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Notice:
    """A warning in plain words.

    Attributes
    ----------
    code
        Stable short name, for programs: ``redundant``, ``at-bound``.
    message
        What was noticed and what to do about it.
    """

    code: str
    message: str


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, for messages: ``1 reading``, ``2 readings``."""
    return f"{number} {noun if number == 1 else f'{noun}s'}"
