"""What every result is: blocks, from which its text, its JSON and its page are made."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar, Final

import numpy as np

from truearm.engine.base.errors import Notice, as_html, counted, has_error, listed, short_text, worst_first
from truearm.engine.base.units import Marked, mark_lines, parts_of, with_mark
from truearm.engine.data.dataset import Dataset
from truearm.engine.document.document import Block, detail, json_of, leaves_of, lines_of, say
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf

#: So many lines has the first screen of a command, and so many of them are notices.
_LINES: Final = 10
_FIRST: Final = 3


class Record:
    """A result that a person can read: its text is what the command prints with details, its summary what JSON holds.

    Where it holds data or a robot that are simulated, both say so first.
    """

    #: What was asked for; None of what no job has made. It says itself as a call in Python and as a command.
    request: Any = None
    #: Whether it is a list that was asked for, so that the first screen has all of it.
    is_list: ClassVar[bool] = False

    @property
    def simulated_from(self) -> tuple[Marked, ...]:
        """What of it comes from a virtual instrument: ``data``, ``robot``, both or nothing.

        A record that holds neither has a field ``simulated_from`` instead.
        """
        return parts_of(getattr(self, entry.name) for entry in fields(self))  # type: ignore[arg-type]

    @property
    def written(self) -> Sequence[str]:
        """Names of the files that hold it, in the folder that was asked for."""
        return ()

    def written_at(self, out: str) -> str:
        """Return the line that says which files hold it, where they were asked for; empty for none."""
        return f"Written to {out}: {', '.join(self.written)}" if self.written else ""

    @property
    def finished(self) -> bool:
        """Whether it can be used as it is: no notice is an error."""
        return not has_error(getattr(self, "warnings", ()))

    def blocks(self) -> Iterable[Block]:
        """Return what it says, the answer first, with what JSON holds of it; notices and next steps come by themselves.

        In JSON units stand in the names.
        """
        raise NotImplementedError

    def everything(self) -> list[Block]:
        """Return errors, its blocks, what to do next and what else to know, as a result has it that holds this one."""
        parts, dangers = self.simulated_from, self._notices(error=True)
        blocks: list[Block] = [say(simulated=True, simulated_parts=[*parts])] if parts else []
        blocks += [say(*notice_lines(dangers)), *self.blocks()]
        if hasattr(self, "next"):
            blocks.append(detail(*(step.line for step in self.next), next=[step.summary() for step in self.next]))
        if hasattr(self, "warnings"):
            rest = notice_lines(self._notices(error=False))
            blocks.append(detail(*rest, warnings=notice_summaries(self.warnings)))
        return blocks

    def _notices(self, *, error: bool) -> list[Notice]:
        """Return the errors, which stand before its figures, or the other notices."""
        return [notice for notice in getattr(self, "warnings", ()) if (notice.level == "error") is error]

    def summary(self) -> dict[str, Any]:
        """Return the figures as JSON holds them, units in the names."""
        summary = json_of(self.everything())
        return {name: summary[name] for name in ("truearm",) if name in summary} | summary

    def as_json(self) -> Any:
        """Return what the command prints as JSON."""
        return self.summary()

    def lines(self) -> list[str]:
        """Return the result in words and figures, line by line, details among them."""
        return with_mark(lines_of(self.everything()), self.simulated_from)

    def __repr__(self) -> str:
        return short_text(self.lines())

    def _repr_html_(self) -> str:
        return as_html(repr(self))


def joints_lines(joints_are: JointsOf) -> list[str]:
    """Return what is to know about joint positions in files that are not the model's; nothing of those that are."""
    if joints_are == "model":
        return []
    return ["Joint positions in the file are those that the robot's controller shows (axis_i)."]


def notice_lines(notices: Sequence[Notice]) -> list[str]:
    """Return what to know about a result, one line each, the worst first."""
    return [f"{notice.level.capitalize()} ({notice.code}): {notice.message}" for notice in worst_first(notices)]


def first_screen(record: Record) -> list[str]:
    """Return at most ten lines, with the one that says where files are.

    Errors come first, then the answer, the next step, and what else to know. The last line counts what is left out.
    Details stand where there is room for them. Lists are shown as a whole.
    """
    everything = record.lines()
    notices, steps = worst_first(getattr(record, "warnings", ())), getattr(record, "next", ())
    if record.is_list or (len(everything) < _LINES and len(notices) <= _FIRST):
        return everything
    mark, leaves = mark_lines(record.simulated_from), [*leaves_of(record.blocks())]
    free = _LINES - len(mark) - len(steps[:1]) - 2  # the last two count the rest, and say where files are
    grave, answer = sum(n.level == "error" for n in notices), sum(len(x.lines) for x in leaves if not x.is_detail)
    shown = min(len(notices), _FIRST, max(1, grave, free - answer))
    spare, text = free - shown - answer, list[str]()
    for leaf in leaves:
        if not leaf.is_detail or len(leaf.lines) <= spare:
            text += leaf.lines
            spare -= len(leaf.lines) * leaf.is_detail
    told = notice_lines(notices[:shown])
    text = [*mark, *told[:grave], *text[: free - shown], *(step.line for step in steps[:1]), *told[grave:]]
    left_out = Counter[str](notice.level for notice in notices[shown:])
    left_out["line"] = len(everything) - len(text) - left_out.total()
    more = listed([counted(count, noun) for noun, count in left_out.items() if count])
    return [*text, f"And {more} more, which `details` shows."]


def notice_summaries(notices: Sequence[Notice]) -> list[dict[str, str]]:
    """Return what to know about a result as JSON holds it, the worst first."""
    return [notice.summary() for notice in worst_first(notices)]


@dataclass(frozen=True, eq=False, repr=False)
class Imported(Record):
    """Measurements that came from files of other programs."""

    data: Dataset  #: The measurements.
    out: Path | None = None  #: The canonical CSV file that holds them; None if none was written.
    #: How many readings are missing of each point, where the file has places for them.
    missing: Mapping[str, int] = field(default_factory=dict)
    warnings: tuple[Notice, ...] = ()  #: What the data cannot hold of the files.

    def blocks(self) -> Iterator[Block]:
        """Give what was read."""
        data, saved = self.data, "" if self.out is None else f": {self.out}"
        many, targets = counted(data.configurations, "configuration"), list(data.targets)
        yield say(f"{many}, targets {', '.join(targets)}{saved}", configurations=data.configurations, targets=targets)
        lines = (f"  {name}: {count} missing {_nouns('reading', count)}" for name, count in self.missing.items())
        yield say(*lines, missing=dict(self.missing))


@dataclass(frozen=True, eq=False, repr=False)
class ImportedRoboDK(Record):
    """Measurements that came from a table of RoboDK."""

    data: Dataset  #: The measurements.
    tool_points: Array  #: Where each target is in the flange frame, as RoboDK was told [m], ``(targets, 3)``.
    out: Path | None = None  #: The canonical CSV file that holds them; None if none was written.
    missing: int = 0  #: How many readings are missing.

    def blocks(self) -> Iterator[Block]:
        """Give what was read, and where the targets are in the flange frame [mm]."""
        data, saved = self.data, "" if self.out is None else f": {self.out}"
        yield say(f"{counted(data.configurations, 'configuration')}{saved}", configurations=data.configurations)
        points = {n: (1e3 * point).tolist() for n, point in zip(data.targets, self.tool_points, strict=True)}
        lines = (f"  target {n}: tool point ({', '.join(f'{v:g}' for v in point)}) mm" for n, point in points.items())
        yield say(*lines, tool_points_mm=points)
        lost = [f"  {self.missing} missing {_nouns('reading', self.missing)}"] if self.missing else []
        yield say(*lost, missing=self.missing)


@dataclass(frozen=True, eq=False, repr=False)
class ImportedCircles(Record):
    """Circles that a robot drew, as distances and heights."""

    data: Dataset  #: The measurements.
    pages: tuple[str, ...]  #: Names of the pages.
    out: Path | None = None  #: The canonical CSV file that holds them; None if none was written.

    @property
    def gaps(self) -> int:
        """How many distances are missing, where the line has gaps."""
        return int(np.sum(~self.data.has_reading))

    def blocks(self) -> Iterator[Block]:
        """Give what was read."""
        configurations, saved = self.data.configurations, "" if self.out is None else f": {self.out}"
        on = f"{counted(configurations, 'configuration')} on {counted(len(self.pages), 'page')}"
        yield say(f"{on}{saved}", configurations=configurations, pages=list(self.pages))
        words = f"  {self.gaps} missing {_nouns('distance', self.gaps)}, where the line has gaps"
        yield say(words if self.gaps else "", missing=self.gaps)


def _nouns(noun: str, count: int) -> str:
    return noun if count == 1 else f"{noun}s"
