"""The measuring of a plan in the project's folder: opened, taken step by step, told in words, and written."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, counted, listed
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.measuring.measure import open_campaign
from truearm.measuring.open_campaign import OpenCampaign, sight
from truearm.measuring.result import DATA, GOES_ON, Measured
from truearm.measuring.session import REASONS, Entry
from truearm.measuring.sources import HOST, Listener
from truearm.studio.arrows import coloured
from truearm.studio.measure_fields import MeasureFields, measure_arguments, measure_command
from truearm.studio.project import Project

#: Of points that are set aside, and of points of which nothing says how they were taken.
ASIDE: Final = (205, 60, 180)
UNTOLD: Final = (128, 134, 140)
#: Lines of sight: to a target that is next, to one that is hidden, to one of which nothing is asked any more.
_NEXT: Final = (46, 160, 67)
_HIDDEN: Final = (214, 69, 61)
_OTHER: Final = (150, 158, 170)
#: What the instrument is called among the lines of sight.
INSTRUMENT: Final = "instrument"
#: How it goes on in the window, where no command is typed.
_START: Final = "Start goes on there."
#: What stands above the columns of the last readings.
HEAD: Final = ("no.", "at", "point", "dev. [mm]", "settling [mm]", "breaks", "became")


@dataclass(frozen=True, eq=False)
class MeasuredPoints:
    """Readings to draw."""

    kept: Array  #: kept, aside: in the base frame of the nominal robot [m], ``(n, 3)`` and ``(m, 3)``.
    colours: NDArray[np.uint8]  #: Of those that are kept, ``(n, 3)``.
    aside: Array


@dataclass(frozen=True, eq=False)
class LinesOfSight:
    """Lines from the instrument to the targets at the next configuration, or to the nests in their round."""

    segments: Array  #: In the base frame of the nominal robot [m], ``(n, 2, 3)``.
    colours: NDArray[np.uint8]  #: ``(n, 3)``.
    names: dict[str, Array]  #: Of the instrument and of what is next, with their places ``(3,)``.


class Measuring:
    """A campaign that is open; one thread at a time.

    Attributes:
        fields: With which it was opened.
        campaign: Of the job.

    Raises:
        InputError: As the job refuses.
    """

    def __init__(self, project: Project, robot: Robot) -> None:
        settings = project.settings
        self.fields: MeasureFields = settings.measure
        self._project, self._robot = project, robot
        self._called, self._source = settings.robot, project.robot_source()
        self._payload = settings.payload
        self._said = self.fields.said(settings.payload)
        self._about = self._about_text()
        self.campaign: OpenCampaign = self._opened()

    def _opened(self) -> OpenCampaign:
        project, fields, said = self._project, self.fields, self._said
        plan = fields.planned()
        given = measure_arguments(said)
        for name in ("watch", "about", "constraints"):
            if name in given:
                given[name] = project.path(given[name], name)
        for name in ("mapping", "truth"):  # a file of the project, or a name that the job knows
            if name in given and project.path(given[name], name).exists():
                given[name] = project.path(given[name], name)
        return open_campaign(
            project.path(plan, "plan"),
            self._source,
            project.path(fields.out, "out"),
            command=measure_command(plan, self._called, said),
            **given,
        )

    def _about_text(self) -> bytes | None:
        path = None if self.fields.about is None else self._project.path(self.fields.about, "about")
        return path.read_bytes() if path is not None and path.is_file() else None

    # What comes --------------------------------------------------------------------------------------------------

    @property
    def is_virtual(self) -> bool:
        """Whether its readings come when they are asked for."""
        return self.campaign.source.kind == "virtual"

    @property
    def address(self) -> list[str]:
        """Where programs send lines to, with the token; nothing where none is listened to."""
        source = self.campaign.source
        if not isinstance(source, Listener):
            return []
        return [f"{HOST} port {source.port}", f"token {source.token}"]

    def step(self, most: int) -> tuple[tuple[Entry, ...], list[str]]:
        """Take up to some readings of those that have come; return them, and what could not be read."""
        entries: list[Entry] = []
        for _ in range(most if self.is_virtual else 1):
            entries += self.campaign.step(most=most)
        return tuple(entries), self.campaign.source.messages()

    def finish(self) -> Measured:
        """Write measurements and report as the command does in the project's folder, and return what came of it."""
        measured = self.measured()
        measured.write()
        return measured

    def outcome(self, found: Measured) -> list[str]:
        """Return what the command prints of what came of it, in the words of the window."""
        return [line.replace(GOES_ON, _START) for line in found.lines()]

    def measured(self) -> Measured:
        """Return what came of it so far; places are named as they are called in the folder."""
        here, found = f"{self._project.folder}/", self.campaign.measured()
        told = tuple(Notice(one.code, one.message.replace(here, ""), one.level) for one in found.measuring_notices)
        return replace(
            found, plan=self.fields.planned(), instrument=found.instrument.replace(here, ""), measuring_notices=told
        )

    def with_what_is_said_now(self) -> None:
        """Open it again if the file of serial numbers and air is another one, or was changed since."""
        about, before = self._project.settings.measure.about, self.fields
        self.fields = before.model_copy(update={"about": about})
        now = self._about_text()
        if now != self._about or self.fields != before:
            self._said = self.fields.said(self._payload)
            self.campaign.close()
            self.campaign, self._about = self._opened(), now

    @property
    def data(self) -> str:
        """Name of the measurements in the project."""
        return f"{self.fields.out}/{DATA}"

    # In words ----------------------------------------------------------------------------------------------------

    def next_words(self) -> list[str]:
        """Return what is to be measured next, and whether the instrument sees it."""
        session = self.campaign.session
        step = session.next
        if step is None:
            return ["Nothing is left to be measured."]
        still = f"{counted(session.outstanding, 'reading')} still to come."
        if step.kind == "nests":
            text = [f"Next: nests {listed(step.names)}, with the robot at {step.label}. {still}"]
        else:
            number = step.configuration + 1
            text = [f"Next: {listed(step.names)} at configuration {step.label}, number {number} of the plan. {still}"]
        seen = sight(self.campaign)
        if seen is None and step.kind == "nests":
            return text
        if seen is None:
            text.append("Where the instrument stands is not known here, nor what it sees.")
            return text
        hidden = [name for name, v, o in zip(seen.names, seen.visible, seen.outstanding, strict=True) if o and not v]
        text.append(f"It does not see {listed(hidden)} there." if hidden else "It sees all of them.")
        return text

    def progress(self) -> tuple[int, int]:
        """Return how many of the steps, configurations and rounds of the nests, are done, and of how many."""
        session = self.campaign.session
        step = session.next
        of = len(session.labels) + session.rounds
        return (of, of) if step is None else (step.number - 1, step.of)

    def kept_words(self) -> str:
        """Return how many readings are kept, those of nests counted by themselves."""
        kept = self.campaign.session.kept
        nests = sum(entry.is_nest for entry in kept)
        return f"{counted(len(kept) - nests, 'reading')} kept{f', {nests} of nests' if nests else ''}"

    def rows(self, most: int) -> list[Sequence[object]]:
        """Return the last entries, the newest first, as the rows of a table."""
        session = self.campaign.session
        return [_row(entry, session.reason_of(entry)) for entry in reversed(session.entries[-most:])]

    def last_words(self) -> str:
        """Return the last entry with all its figures and words, as the command prints it; empty before the first."""
        entries = self.campaign.session.entries
        return entries[-1].line().strip() if entries else ""

    def reasons(self) -> list[Sequence[object]]:
        """Return how many readings are not kept, for each reason with its meaning."""
        session = self.campaign.session
        sequences: list[Sequence[object]] = [
            (count, code, REASONS[code]) for code, count in session.aside_by_reason.items()
        ]
        if session.left_out:
            sequences.append((len(session.left_out), "left-out", REASONS["left-out"]))
        return sequences

    # In the scene ------------------------------------------------------------------------------------------------

    @property
    def placed(self) -> Robot | None:
        """The nominal robot where the instrument sees it: of a real one only if the robot file says so."""
        if self.campaign.placed is not None:
            return self.campaign.placed
        return None if self._robot.base == Transform() else self._robot

    def points(self) -> MeasuredPoints | None:
        """Return the readings; None where nobody knows where the robot stands."""
        if self.placed is None:
            return None
        drawn = self.campaign.session.drawn()
        at = in_base(drawn.position, self.placed.base)
        read = np.isfinite(at).all(axis=1)
        kept, aside = read & drawn.kept, read & ~drawn.kept
        limit = self.campaign.session.quality.deviation
        deviation = drawn.deviation[kept]
        most = limit if limit is not None else float(np.nanmax(deviation, initial=0.0))
        told = np.isfinite(deviation)
        colours = np.where(told[:, None], coloured(np.where(told, deviation, 0.0), 0.0, most), UNTOLD)
        return MeasuredPoints(at[kept], colours.astype(np.uint8), at[aside])

    def lines_of_sight(self) -> LinesOfSight | None:
        """Return lines to what is next; None for a real instrument, or if nothing is left."""
        seen, placed = sight(self.campaign), self.campaign.placed
        if seen is None or placed is None:
            return None
        origin, ends = in_base(seen.origin[None], placed.base), in_base(seen.targets, placed.base)
        colours = [
            (_NEXT if asked else _OTHER) if visible else _HIDDEN
            for visible, asked in zip(seen.visible, seen.outstanding, strict=True)
        ]
        names = {INSTRUMENT: origin[0]}
        step = self.campaign.session.next
        if step is not None:
            k = seen.names.index(step.names[0])  # labels of all of them would cover each other
            names[f"{step.names[0]}, {'next' if seen.visible[k] else 'hidden'}"] = ends[k]
        return LinesOfSight(
            np.stack([np.broadcast_to(origin, ends.shape), ends], axis=1),
            np.array(colours, np.uint8),
            names,
        )


def in_base(points: Array, base: Transform) -> Array:
    """Return points ``(n, 3)`` of the world in a base frame [m]."""
    return np.asarray((points - np.array(base.translation)) @ base.rotation)


def _row(entry: Entry, reason: str) -> Sequence[object]:
    reading = entry.reading
    figures: list[Any] = ["", "", ""]
    if reading is not None:
        figures = [_mm(reading.deviation), _mm(reading.settling), reading.breaks or ""]
    if entry.event == "aside":
        became = f"takes back {entry.of}"
    elif entry.event == "left":
        became = "left out"
    else:
        became = f"aside: {reason}" if reason else "kept"
    return (entry.number, entry.label or "?", entry.name, *figures, became)


def _mm(length: float | None) -> str:
    return "" if length is None else f"{length * 1e3:.4f}"
