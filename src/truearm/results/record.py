"""What every result is: figures with a short text of their own."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import wraps
from typing import Any

from truearm.modeling.controller import JointsOf
from truearm.notices import Notice, worst_first
from truearm.shown import as_html, short_text
from truearm.simulated import Marked, parts_of, with_mark


class Record(ABC):
    """A result that a person can read: its text is what the command prints, its summary what JSON holds.

    Where it holds data or a robot that are simulated, both begin with that, whatever the record's own class returns.
    """

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        for name, marked in (("lines", _marked_lines), ("summary", _marked_summary)):
            if name in vars(cls):
                setattr(cls, name, marked(vars(cls)[name]))

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """What of it comes from a virtual instrument: ``data``, ``robot``, both or nothing.

        A record that holds neither has a field ``simulated_from`` instead.
        """
        return parts_of(getattr(self, one.name) for one in fields(self))  # type: ignore[arg-type]

    @abstractmethod
    def summary(self) -> dict[str, Any]:
        """Return the figures as JSON holds them, units in the names."""

    @abstractmethod
    def lines(self) -> list[str]:
        """Return the result in words and figures, line by line, as the command prints it."""

    def __repr__(self) -> str:
        return short_text(self.lines())

    def _repr_html_(self) -> str:
        return as_html(repr(self))


def _marked_lines(lines: Callable[[Any], list[str]]) -> Callable[[Any], list[str]]:
    @wraps(lines)
    def marked(record: Record) -> list[str]:
        return with_mark(lines(record), record.simulated_from)

    return marked


def _marked_summary(summary: Callable[[Any], dict[str, Any]]) -> Callable[[Any], dict[str, Any]]:
    @wraps(summary)
    def marked(record: Record) -> dict[str, Any]:
        parts, content = record.simulated_from, summary(record)
        if not parts:
            return content
        schema = {name: content[name] for name in ("truearm",) if name in content}
        return {**schema, "simulated": True, "simulated_parts": [*parts], **content}

    return marked


def joints_lines(joints_are: JointsOf) -> list[str]:
    """Return what is to know about joint positions in files that are not the model's; nothing of those that are."""
    if joints_are == "model":
        return []
    return ["Joint positions in the file are those that the robot's controller shows (axis_i)."]


def notice_lines(notices: Sequence[Notice]) -> list[str]:
    """Return what to know about a result, one line each, the worst first."""
    return [f"{notice.level.capitalize()} ({notice.code}): {notice.message}" for notice in worst_first(notices)]


def notice_summaries(notices: Sequence[Notice]) -> list[dict[str, str]]:
    """Return what to know about a result as JSON holds it, the worst first."""
    return [notice.summary() for notice in worst_first(notices)]
