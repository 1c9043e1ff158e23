"""A session with its log on disk and its source of readings, and how fixed nests seem to move meanwhile."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Final, Self

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule
from truearm.engine.robot.chain import Array
from truearm.measuring.reading_log import ReadingLog
from truearm.measuring.session import Entry, Session
from truearm.measuring.sources import Incoming, Source

#: So many configurations are named in a notice.
_NAMED: Final = 5


TORN_LINE: Final = Rule("torn-line", "note", "the log ended with a part of a line", gravity=0)


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
            incoming = self._coming.popleft()
            if incoming.reading is not None:
                entry = self._written(self.session.judged(incoming.reading))
            elif incoming.left is not None:
                try:
                    entry = self._written(self.session.leave_out(*incoming.left))
                except InputError as error:
                    incoming.refuse(str(error))
                    continue
            incoming.reply(entry)
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
            TORN_LINE(
                "The log ended with a part of a line, as where a machine is stopped: that reading was not confirmed, "
                "and is measured again."
            )
        ]


CLOCK_BACK: Final = Rule("clock-back", "warning", "a reading has an earlier time than the one before")
MANY_LEFT_OUT: Final = Rule(
    "many-left-out",
    "warning",
    "at more than half of the configurations every target was left out, and `not-seen` does not say so",
)
OTHER_ORDER: Final = Rule("other-order", "note", "not measured in the order of the plan")
NOT_JUDGED: Final = Rule("not-judged", "note", "nothing says how readings were taken")
NESTS_MISSED: Final = Rule(
    "nests-missed", "warning", "in some rounds not all nests were measured; where they were hidden"
)
NO_NESTS: Final = Rule("no-nests", "note", "no nests were measured", cure="Name them as `nests`.")


def session_notices(session: Session) -> list[Notice]:
    """Return what to know about how a plan was measured: nothing of it asks how well a reading fits."""
    readings = [entry for entry in session.entries if entry.reading is not None]
    notices = []
    if back := _gone_back(readings):
        notices.append(
            CLOCK_BACK(
                f"The clock went back before {_numbers(back)}. The order is that in which readings came; the drift of "
                "nests over time may be wrong."
            )
        )
    none = len(session.without_reading)
    if 2 * none > len(session.labels):
        notices.append(
            MANY_LEFT_OUT(
                f"At {none} of {len(session.labels)} configurations every target was left out: "
                f"{len(session.left_out)} of {session.planned} readings of targets are "
                "missing. If the instrument does not see them there, plan for it: `truearm plan` with `device`."
            )
        )
    jumps = _out_of_order(session)
    if jumps:
        notices.append(
            OTHER_ORDER(f"Not measured in the order of the plan: {_some(jumps)}. The file says in which order it was.")
        )
    entries = [entry for entry in session.kept if entry.reading is not None]
    blind = sum(session.quality.unasked(entry.reading) for entry in entries if entry.reading is not None)
    if blind:
        notices.append(
            NOT_JUDGED(
                f"Of {blind} of {len(entries)} readings that are kept nothing says how they were taken, or no limit "
                "was given: scatter, settling and samples of the dwell were not judged."
            )
        )
    if session.missed_rounds:
        notices.append(
            NESTS_MISSED(
                f"In {session.missed_rounds} of {session.rounds} rounds not all nests were measured: what moved in "
                f"between is not known as well.{_hidden(session)}"
            )
        )
    if readings and not session.nests:
        notices.append(
            NO_NESTS("No fixed nests were measured along the way: nobody can tell whether instrument or robot moved.")
        )
    return notices


def _hidden(session: Session) -> str:
    """Say at which configurations nests were left out, and why."""
    left = session.nests_left_out
    if not left:
        return ""
    names = _some([f"{e.name} at {e.label}{f' ({e.words})' if e.words else ''}" for e in left])
    return f" Left out: {names}. Put nests where nothing comes between, or measure them at another configuration."


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
    more = len(names) - _NAMED
    return f"{', '.join(names[:_NAMED])}{f' and {more} more' if more > 0 else ''}"


#: Fewer degrees of freedom say too little of a standard deviation.
_LEAST_FREEDOMS: Final = 12


@dataclass(frozen=True, eq=False)
class NestDrift:
    """Nests in the order of their rounds."""

    names: tuple[str, ...]  #: Of the nests that were read.
    rounds: tuple[int, ...]  #: Number of each round with a reading, from 0, ``(r,)``.
    time: Array  #: Mean time of each [s], from the first reading of a nest on, ``(r,)``.
    #: Of each nest against its first reading [m], in the instrument's frame, ``(nests, r, 3)``; NaN where it was not
    #: read.
    moved: Array
    #: Standard deviation of a coordinate about the mean of its nest [m]; None where too few readings tell it.
    sigma: float | None
    freedoms: int  #: Degrees of freedom of that.

    @property
    def distance(self) -> Array:
        """How far each is from its first reading [m], ``(nests, r)``, NaN where it was not read."""
        return np.asarray(np.sqrt((self.moved**2).sum(axis=2)))

    @property
    def largest(self) -> float:
        """Of all distances [m]."""
        return float(np.nanmax(self.distance))

    @property
    def common(self) -> Array:
        """Mean over the nests of how they moved in each round [m], ``(r, 3)``: what all of them share."""
        return np.asarray(np.nanmean(self.moved, axis=0))

    def noise(self, stated: float | None = None) -> float | None:
        """Return the standard deviation of a coordinate of a reading without what all nests share [m].

        Args:
            stated: What the instrument says of itself [m]; else it is found from the nests, if enough of them were
                read.
        """
        if stated is not None:
            return stated
        read = np.isfinite(self.moved[:, :, 0])
        freedoms = 3 * int(read.sum() - read.any(axis=1).sum() - read.any(axis=0).sum() + 1)
        if freedoms < _LEAST_FREEDOMS:
            return self._from_round_to_round()
        # Nests that were read in every round: what is left of each round and each nest is scatter alone.
        left = self.moved - np.nanmean(self.moved, axis=0, keepdims=True)
        left = left - np.nanmean(left, axis=1, keepdims=True)
        spread = float(np.sqrt(np.nansum(left**2) / freedoms))
        return spread if spread > 0.0 else None

    def _from_round_to_round(self) -> float | None:
        """Return the scatter as one round follows another, the root of half the mean squared step (von Neumann 1941).

        Of a steady drift it holds what one step has of it, so it is rather too large. Steps that share a reading are
        worth two thirds of steps that share none.
        """
        steps = np.diff(self.moved, axis=1)
        known = int(np.isfinite(steps).sum())
        if 2 * known < 3 * _LEAST_FREEDOMS:
            return None
        spread = float(np.sqrt(np.nansum(steps**2) / (2.0 * known)))
        return spread if spread > 0.0 else None


def nest_drift(session: Session) -> NestDrift | None:
    """Return how the nests moved, by the readings that are kept; None before one was read."""
    entries = [entry for entry in session.kept if entry.is_nest and entry.reading is not None]
    if not entries:
        return None
    names = tuple(name for name in session.nests if any(entry.name == name for entry in entries))
    rounds = tuple(sorted({session.round_of(entry) for entry in entries}))
    place = np.full((len(names), len(rounds), 3), np.nan)
    time = np.full((len(names), len(rounds)), np.nan)
    for entry in entries:
        if entry.reading is not None:
            at = names.index(entry.name), rounds.index(session.round_of(entry))
            place[at], time[at] = entry.reading.position, entry.reading.time
    times = np.nanmean(time, axis=0)
    first = np.array([row[np.isfinite(row[:, 0])][0] for row in place])
    read = np.isfinite(place[:, :, 0])
    freedoms = 3 * int((read.sum(axis=1) - 1).sum())
    about = place - np.nanmean(place, axis=1, keepdims=True)
    sigma = None
    if freedoms >= _LEAST_FREEDOMS and (spread := float(np.sqrt(np.nansum(about**2) / freedoms))) > 0.0:
        sigma = spread
    return NestDrift(names, rounds, times - times[0], place - first[:, None], sigma, freedoms)
