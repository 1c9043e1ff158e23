"""A session with its log on disk and its source of readings: what a command drives, and a page of the studio."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Final, Self

from truearm.errors import InputError
from truearm.measurement.measuring.reading_log import ReadingLog
from truearm.measurement.measuring.session import Entry, Session
from truearm.measurement.measuring.sources import Incoming, Source
from truearm.notices import Notice

#: So many configurations are named in a notice.
_NAMED: Final = 5


class Campaign:
    """The measuring of a plan into a folder.

    Args:
        session: New: what the log holds is added to it.
        source: What readings come from.
        folder: In which the log is, or is made.

    Raises:
        InputError: If the log cannot be used, or is another session's.
    """

    def __init__(self, session: Session, source: Source, folder: Path) -> None:
        self.session, self.source = session, source
        self._coming: deque[Incoming] = deque()
        self.log = ReadingLog(folder)
        try:
            session.add(*self.log.entries)
        except InputError as error:
            self.log.close()
            raise InputError(
                "this log does not belong to this plan",
                where=f"{self.log.path}, {error.where}",
                cure="Measure into another folder.",
            ) from error
        #: How many entries there were when it was opened.
        self.before = len(session)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def step(self, seconds: float = 0.0, most: int | None = None) -> tuple[Entry, ...]:
        """Take what has come, or comes within some time, and return what became of it; all of it is on disk then.

        Args:
            seconds: To wait at most.
            most: So much is taken at once, and the rest by the next call; None takes all of it.
        """
        taken: list[Entry] = []
        if not self._coming:
            self._coming.extend(self.source.poll(self.session, seconds))
        for _ in range(len(self._coming) if most is None else min(most, len(self._coming))):
            one = self._coming.popleft()
            if one.reading is not None:
                entry = self._written(self.session.judged(one.reading))
            elif one.left is not None:
                try:
                    entry = self._written(self.session.leave_out(*one.left))
                except InputError as error:
                    one.refuse(str(error))
                    continue
            one.reply(entry)
            taken.append(entry)
        return tuple(taken)

    def set_aside(self, number: int, words: str = "") -> Entry:
        """Take back a reading that was kept, by the operator's own word; it is asked for again."""
        return self._written(self.session.set_aside(number, words))

    def leave_out(self, label: str, name: str, words: str = "") -> Entry:
        """Ask no longer for a point that cannot be measured at a configuration."""
        return self._written(self.session.leave_out(label, name, words))

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know so far about how it was measured."""
        return (*self._of_log(), *session_notices(self.session), *self.source.notices)

    def close(self) -> None:
        """Let go of the log and the source."""
        self.log.close()
        self.source.close()

    def _written(self, entry: Entry) -> Entry:
        self.log.append(entry)
        self.session.add(entry)
        return entry

    def _of_log(self) -> list[Notice]:
        if not self.log.torn:
            return []
        return [
            Notice(
                "torn-line",
                "The log ended with a part of a line, as where a machine is stopped: that reading was not confirmed, "
                "and is measured again.",
                "note",
            )
        ]


def session_notices(session: Session) -> list[Notice]:
    """Return what to know about how a plan was measured: nothing of it asks how well a reading fits."""
    readings = [entry for entry in session.entries if entry.reading is not None]
    found = []
    if back := _gone_back(readings):
        found.append(
            Notice(
                "clock-back",
                f"The clock went back before {_numbers(back)}. The order is that in which readings came; the drift of "
                "nests over time may be wrong.",
            )
        )
    none = len(session.without_reading)
    if 2 * none > len(session.labels):
        found.append(
            Notice(
                "many-left-out",
                f"At {none} of {len(session.labels)} configurations every target was left out: "
                f"{len(session.left_out)} of {session.planned} readings of targets are "
                "missing. If the instrument does not see them there, plan for it: `truearm plan` with `device`.",
            )
        )
    jumps = _out_of_order(session)
    if jumps:
        found.append(
            Notice(
                "other-order",
                f"Not measured in the order of the plan: {_some(jumps)}. The file says in which order it was.",
                "note",
            )
        )
    kept = [entry for entry in session.kept if entry.reading is not None]
    blind = sum(session.quality.unasked(entry.reading) for entry in kept if entry.reading is not None)
    if blind:
        found.append(
            Notice(
                "not-judged",
                f"Of {blind} of {len(kept)} readings that are kept nothing says how they were taken, or no limit was "
                "given: scatter, settling and samples of the dwell were not judged.",
                "note",
            )
        )
    if session.missed_rounds:
        found.append(
            Notice(
                "nests-missed",
                f"In {session.missed_rounds} of {session.rounds} rounds not all nests were measured: what moved in "
                f"between is not known as well.{_hidden(session)}",
            )
        )
    if readings and not session.nests:
        found.append(
            Notice(
                "no-nests",
                "No fixed nests were measured along the way: nobody can tell whether instrument or robot moved. "
                "Name them as `nests`.",
                "note",
            )
        )
    return found


def _hidden(session: Session) -> str:
    """Say at which configurations nests were left out, and why."""
    left = session.nests_left_out
    if not left:
        return ""
    said = _some([f"{e.name} at {e.label}{f' ({e.words})' if e.words else ''}" for e in left])
    return f" Left out: {said}. Put nests where nothing comes between, or measure them at another configuration."


def _gone_back(entries: Sequence[Entry]) -> list[int]:
    """Return the numbers of the readings whose time is before that of the one before."""
    times = [(entry.number, entry.reading.time) for entry in entries if entry.reading is not None]
    return [number for (_, before), (number, time) in pairwise(times) if time < before]


def _out_of_order(session: Session) -> list[str]:
    places = {label: number for number, label in enumerate(session.labels)}
    first = list(dict.fromkeys(e.label for e in session.kept if not e.is_nest))
    return [b for a, b in pairwise(first) if places[b] < places[a]]


def _numbers(numbers: Sequence[int]) -> str:
    return f"reading{'s' if len(numbers) > 1 else ''} {_some([str(number) for number in numbers])}"


def _some(names: Sequence[str]) -> str:
    rest = len(names) - _NAMED
    return f"{', '.join(names[:_NAMED])}{f' and {rest} more' if rest > 0 else ''}"
