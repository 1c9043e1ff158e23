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
