"""What every robot language is read into: where the numbers of targets stand in the text, and what they mean.

A program is text, and stays text: a reader finds the numbers of targets and notes where each begins and ends. Whoever
corrects the program puts other numbers in those places, and no other byte changes.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple, NoReturn

from truearm.errors import InputError
from truearm.modeling.orientations import Orientation
from truearm.modeling.parts import Payload
from truearm.modeling.transform import Transform

if TYPE_CHECKING:
    from truearm.compensation.programs.motion_program import MotionProgram
    from truearm.compensation.programs.new_program import NewProgram

MoveKind = Literal["joint", "linear", "circular"]


@dataclass(frozen=True)
class Source:
    """The text of one file of a program.

    Attributes
    ----------
    path
        Of the file.
    text
        Its bytes as Latin-1, so that every character is one byte and no byte is lost, whatever its encoding.
    """

    path: Path
    text: str

    def where(self, line: int) -> str:
        """Return file and line, for a message."""
        return f"{self.path}, line {line}"

    def refuse(self, line: int, what: str, *, came: object = None, allowed: str | None = None) -> NoReturn:
        """Refuse a line."""
        raise InputError(what, where=self.where(line), came=came, allowed=allowed)


@dataclass(frozen=True)
class Form:
    """What the numbers of a target mean.

    A pose is x, y, z and the numbers of its orientation, in the order that `orientation` has; joints are joint
    positions as the controller shows them, one for each joint of the robot.

    Attributes
    ----------
    name
        What the language calls it.
    kind
        ``pose``; ``joints``, angles of turning joints and lengths of sliding ones; ``pulses``, of the motors.
    length
        Metres in one unit of a length.
    angle
        Radians in one unit of an angle; of no meaning for quaternions and pulses.
    orientation
        How a pose is turned; None if its numbers are a position alone.
    decimals
        Fewest decimals of a number that is written: of lengths, and of angles or of a quaternion's numbers.
    absent
        For languages that do not write zeros: what to put into the text for a number that is not written, with ``{}``
        where the number goes, one for each number. Such a number is 0 and its place is empty, where the text belongs.
    """

    name: str
    kind: Literal["pose", "joints", "pulses"]
    length: float = 1e-3
    angle: float = 1.0
    orientation: Orientation | None = None
    decimals: tuple[int, int] = (3, 4)
    absent: tuple[str, ...] = ()


@dataclass(frozen=True)
class Configuration:
    """Which of the postures that reach a pose the program means; what is not said may be anything.

    Attributes
    ----------
    shoulder, elbow, wrist
        Words of the branches of :mod:`truearm.modeling.inverse.branches`.
    ranges
        ``(joint, low, high)``: the joint, from 1, reads `low` or more and less than `high` [rad], as the controller
        shows it.
    outside
        ``(joint, low, high)``: the joint reads less than `low`, or `high` or more [rad].
    literal
        Whether the controller takes the ranges to the letter. Others take the nearest posture where a joint is
        a little beyond.
    near
        Joint positions [rad or m], as the controller shows them, that the posture is nearest to; if None, and the rest
        leaves a choice, nearest to where the robot comes from.
    """

    shoulder: Literal["front", "back"] | None = None
    elbow: Literal["up", "down"] | None = None
    wrist: Literal["noflip", "flip"] | None = None
    ranges: tuple[tuple[int, float, float], ...] = ()
    outside: tuple[tuple[int, float, float], ...] = ()
    literal: bool = False
    near: tuple[float, ...] | None = None


ANY_POSTURE = Configuration()


@dataclass(frozen=True, slots=True)
class ProgramTarget:
    """A place in a program that the robot is sent to.

    Attributes
    ----------
    source
        Which file of the program it stands in, from 0.
    line
        Line in that file, from 1.
    name
        As the program calls it; empty where it has no name.
    form
        What its numbers mean.
    values
        Its numbers, in the file's units.
    places
        Where each of `values` stands in the text: ``(start, stop)``; ``(place, place)`` for a number that is not
        written and can be put in there, see :attr:`Form.absent`; None for one that cannot.
    tool, frame
        Names of the tool and of the work object, base or user frame that hold; empty for the flange and the robot's
        own base.
    configuration
        In which posture the target is reached.
    parent
        Index of the target that this one is an offset from, None for none. A target and its parent have the same tool
        and frame.
    turned
        Whether the offset is in the axes of the parent itself (RelTool, the colon of KRL) and not of the frame (Offs).
    """

    source: int
    line: int
    name: str
    form: Form
    values: tuple[float, ...]
    places: tuple[tuple[int, int] | None, ...]
    tool: str = ""
    frame: str = ""
    configuration: Configuration = ANY_POSTURE
    parent: int | None = None
    turned: bool = False


@dataclass(frozen=True, slots=True)
class Move:
    """An instruction that moves the robot.

    Attributes
    ----------
    kind
        How the tip goes.
    target
        Index of the target that it ends at.
    source, line
        File of the program, from 0, and line in it, from 1.
    via
        Index of the target that a circle passes.
    routine
        Which stretch of the program, from 0: the moves of a stretch follow each other in the text, and nothing between
        them jumps, calls or moves the robot. Where the robot is before the first of them is not known.
    statement
        Where the whole instruction stands in the text, ``(start, stop)``, from its first to after its last character.
    target_text, via_text
        Where the words for the targets stand in the text, inside of `statement`. ``(0, 0)`` for a move that cannot be
        split.
    """

    kind: MoveKind
    target: int
    source: int
    line: int
    via: int | None = None
    routine: int = 0
    statement: tuple[int, int] = (0, 0)
    target_text: tuple[int, int] = (0, 0)
    via_text: tuple[int, int] | None = None


@dataclass(frozen=True)
class Skipped:
    """A target that is left as it is.

    Attributes
    ----------
    source, line
        File of the program, from 0, and line in it, from 1.
    reason
        Why, in plain words.
    """

    source: int
    line: int
    reason: str


@dataclass(frozen=True)
class Program:
    """A robot program: its texts, and what was found in them.

    Attributes
    ----------
    language
        Name of the language.
    sources
        Its files.
    targets
        In the order of the text.
    moves
        In the order of the text.
    tools
        By name, ``T_flange_tip`` as the program defines it, in the controller's flange frame.
    frames
        By name, ``T_base_frame`` as the program defines it, in the controller's base frame.
    skipped
        What looks like a target and cannot be corrected, with the reason.
    unknown
        How often an instruction occurs that the reader does not know and leaves alone, by its first word.
    loads
        By the name of a tool, what the program says that the robot carries with it; the centre of gravity in the
        controller's flange frame.
    load_changes
        Whether instructions change what the robot carries.
    """

    language: str
    sources: tuple[Source, ...]
    targets: tuple[ProgramTarget, ...]
    moves: tuple[Move, ...] = ()
    tools: Mapping[str, Transform] = field(default_factory=dict)
    frames: Mapping[str, Transform] = field(default_factory=dict)
    skipped: tuple[Skipped, ...] = ()
    unknown: Mapping[str, int] = field(default_factory=dict)
    loads: Mapping[str, Payload] = field(default_factory=dict)
    load_changes: bool = False

    def by_file(self) -> dict[Path, list[ProgramTarget]]:
        """Return its targets by the files in which they stand."""
        found: dict[Path, list[ProgramTarget]] = {source.path: [] for source in self.sources}
        for target in self.targets:
            found[self.sources[target.source].path].append(target)
        return found


class Edit(NamedTuple):
    """Text to put in the place of other text.

    Attributes
    ----------
    source
        File of the program, from 0.
    start, stop
        What is replaced, in the text as it was; nothing if they are the same, and the new text is put before it.
    text
        The new text.
    """

    source: int
    start: int
    stop: int
    text: str


@dataclass(frozen=True)
class Split:
    """A linear or circular move that is split into segments.

    Attributes
    ----------
    move
        Index of the move.
    points
        One entry for each instruction to insert before the move: the numbers of its target, and of its via for a
        circle (else None), in the form and units of the move's target.
    last_via
        For a circle the numbers of the via of its last segment, which is the move itself.
    """

    move: int
    points: tuple[tuple[tuple[float, ...], tuple[float, ...] | None], ...]
    last_via: tuple[float, ...] | None = None


class SplitEdits(NamedTuple):
    """How the text of a program changes when moves are split.

    Attributes
    ----------
    edits
        What changes in the text.
    unsplit
        Indices of moves that stay whole, because segments of them would do something else.
    """

    edits: list[Edit]
    unsplit: list[int]


class MakersCalibration(NamedTuple):
    """How the maker of a controller may have calibrated the arm itself.

    Attributes
    ----------
    maker
        Of robot and controller.
    name
        What the maker calls it.
    always
        Whether every arm is delivered so, or only where it was ordered.
    """

    maker: str
    name: str
    always: bool = False


@dataclass(frozen=True)
class Language:
    """A robot language.

    Attributes
    ----------
    name
        Its name.
    suffixes
        Of its files, lower case with the dot. The suffix decides the language; what is in the file has to agree.
    makers
        Whose controllers run it, by the names that the maker has; the first is the usual one.
    is_one
        Whether a text looks like this language.
    read
        Read the files of one program, given together.
    comment
        Put lines of comment into a text of the language: ASCII, 32 characters at most. Every other byte stays, but for
        a count of lines; the text stays as it is where it has no place for them.
    split
        Split moves; None if the language's programs cannot be split.
    new
        Write a program from scratch: texts of its files by their names.
    motion
        The same for a program with stops, waits and circles.
    together
        Whether files that are given together are one program and share names; else each is one for itself.
    companions
        Pairs of suffixes: beside a file of the first may lie one of the second that belongs to it.
    calibration
        How controllers that run it may have been calibrated by their maker; None if nothing is known of that.
    flange, base
        What the language calls the robot's own flange and base, in small letters. Every cell file may call them
        ``flange`` and ``base``.
    reads
        Where a text reads numbers of a place: the first group is the name of the place, without an index that follows;
        None where comments and strings are matched instead. None if the language's programs cannot.
    """

    name: str
    suffixes: tuple[str, ...]
    makers: tuple[str, ...]
    is_one: Callable[[str], bool]
    read: Callable[[Sequence[Source]], Program]
    comment: Callable[[str, Sequence[str]], str]
    split: Callable[[Program, Sequence[Split]], SplitEdits] | None = None
    new: Callable[[NewProgram], Mapping[str, str]] | None = None
    motion: Callable[[MotionProgram], Mapping[str, str]] | None = None
    together: bool = False
    companions: tuple[tuple[str, str], ...] = ()
    calibration: MakersCalibration | None = None
    flange: tuple[str, ...] = ()
    base: tuple[str, ...] = ()
    reads: re.Pattern[str] | None = None

    def runs_on(self, maker: str) -> bool:
        """Return whether controllers of a maker run it, whatever else is in the maker's full name."""
        words = _words(maker)
        return any(_words(name) <= words for name in self.makers)

    def programs(self, sources: Sequence[Source]) -> tuple[Program, ...]:
        """Read files that may be of several programs.

        Of a language whose programs have many files, all are one; but if two have the same name, each folder is one.
        """
        names = [source.path.name.lower() for source in sources]
        several = len(set(names)) < len(names)
        groups: dict[Path | None, list[Source]] = {}
        for source in sources:
            key = (source.path.parent if several else None) if self.together else source.path
            groups.setdefault(key, []).append(source)
        return tuple(self.read(group) for group in groups.values())


def _words(name: str) -> set[str]:
    """Return the words of a name, without capitals and accents."""
    plain = unicodedata.normalize("NFKD", name.casefold())
    return set(re.findall(r"[^\W_]+", "".join(c for c in plain if not unicodedata.combining(c))))
