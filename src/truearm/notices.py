"""What a person should know about a result although nothing failed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final, Literal

#: ``note``: good to know. ``warning``: a figure may not hold. ``error``: the result should not be used as it is.
Level = Literal["note", "warning", "error"]
LEVELS: Final[tuple[Level, ...]] = ("note", "warning", "error")


@dataclass(frozen=True)
class Notice:
    """A warning in plain words."""

    code: str  #: Stable short name, for programs: ``redundant``, ``at-bound``.
    message: str  #: What was noticed and what to do about it.
    level: Level = "warning"  #: How bad it is.
    #: The readings that it is about, where it is about single ones: label of the configuration and name of the target,
    #: which is empty for all that were read there.
    at: tuple[tuple[str, str], ...] = field(default=(), compare=False, repr=False)

    def summary(self) -> dict[str, str]:
        """Return it as JSON holds it."""
        return {"code": self.code, "level": self.level, "message": self.message}


def worst_first(notices: Iterable[Notice]) -> tuple[Notice, ...]:
    """Return notices with errors first and notes last, otherwise in their order."""
    return tuple(sorted(notices, key=lambda notice: -LEVELS.index(notice.level)))


def has_error(notices: Iterable[Notice]) -> bool:
    """Return whether a notice says that the result should not be used as it is."""
    return any(notice.level == "error" for notice in notices)
