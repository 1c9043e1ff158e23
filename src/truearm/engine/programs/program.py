"""What every robot language is read into: where the numbers of targets stand in the text, and what they mean.

A program is text, and stays text: a reader finds the numbers of targets and notes where each begins and ends. Whoever
corrects the program puts other numbers in those places, and no other byte changes.
"""

from __future__ import annotations

import re
import unicodedata
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal, NamedTuple, NoReturn

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.base.version import __version__
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.transform import Orientation, Transform

if TYPE_CHECKING:
    from truearm.engine.programs.new_program import MotionProgram, NewProgram


MoveKind = Literal["joint", "linear", "circular"]


@dataclass(frozen=True)
class Source:
    """The text of one file of a program."""

    path: Path  #: Of the file.
    text: str  #: Its bytes as Latin-1, so that every character is one byte and no byte is lost, whatever its encoding.

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
    """

    name: str  #: What the language calls it.
    #: ``pose``; ``joints``, angles of turning joints and lengths of sliding ones; ``pulses``, of the motors.
    kind: Literal["pose", "joints", "pulses"]
    length: float = 1e-3  #: Metres in one unit of a length.
    angle: float = 1.0  #: Radians in one unit of an angle; of no meaning for quaternions and pulses.
    orientation: Orientation | None = None  #: How a pose is turned; None if its numbers are a position alone.
    #: Fewest decimals of a number that is written: of lengths, and of angles or of a quaternion's numbers.
    decimals: tuple[int, int] = (3, 4)
    #: For languages that do not write zeros: what to put into the text for a number that is not written, with ``{}``
    #: where the number goes, one for each number. Such a number is 0 and its place is empty, where the text belongs.
    absent: tuple[str, ...] = ()


@dataclass(frozen=True)
class Configuration:
    """Which of the postures that reach a pose the program means; what is not said may be anything."""

    #: shoulder, elbow, wrist: words of the branches of :mod:`truearm.engine.robot.inverse.branches`.
    shoulder: Literal["front", "back"] | None = None
    elbow: Literal["up", "down"] | None = None
    wrist: Literal["noflip", "flip"] | None = None
    #: ``(joint, low, high)``: the joint, from 1, reads `low` or more and less than `high` [rad], as the controller
    #: shows it.
    ranges: tuple[tuple[int, float, float], ...] = ()
    #: ``(joint, low, high)``: the joint reads less than `low`, or `high` or more [rad].
    outside: tuple[tuple[int, float, float], ...] = ()
    #: Whether the controller takes the ranges to the letter. Others take the nearest posture where a joint is a little
    #: beyond.
    literal: bool = False
    #: Joint positions [rad or m], as the controller shows them, that the posture is nearest to; if None, and the rest
    #: leaves a choice, nearest to where the robot comes from.
    near: tuple[float, ...] | None = None


ANY_POSTURE = Configuration()


@dataclass(frozen=True, slots=True)
class ProgramTarget:
    """A place in a program that the robot is sent to."""

    source: int  #: Which file of the program it stands in, from 0.
    line: int  #: Line in that file, from 1.
    name: str  #: As the program calls it; empty where it has no name.
    form: Form  #: What its numbers mean.
    values: tuple[float, ...]  #: Its numbers, in the file's units.
    #: Where each of `values` stands in the text: ``(start, stop)``; ``(place, place)`` for a number that is not written
    #: and can be put in there, see :attr:`Form.absent`; None for one that cannot.
    places: tuple[tuple[int, int] | None, ...]
    #: tool, frame: names of the tool and of the work object, base or user frame that hold; empty for the flange and the
    #: robot's own base.
    tool: str = ""
    frame: str = ""
    configuration: Configuration = ANY_POSTURE  #: In which posture the target is reached.
    #: Index of the target that this one is an offset from, None for none. A target and its parent have the same tool
    #: and frame.
    parent: int | None = None
    #: Whether the offset is in the axes of the parent itself (RelTool, the colon of KRL) and not of the frame (Offs).
    turned: bool = False


@dataclass(frozen=True, slots=True)
class Move:
    """An instruction that moves the robot."""

    kind: MoveKind  #: How the tip goes.
    target: int  #: Index of the target that it ends at.
    source: int  #: source, line: file of the program, from 0, and line in it, from 1.
    line: int
    via: int | None = None  #: Index of the target that a circle passes.
    #: Which stretch of the program, from 0: the moves of a stretch follow each other in the text, and nothing between
    #: them jumps, calls or moves the robot. Where the robot is before the first of them is not known.
    routine: int = 0
    #: Where the whole instruction stands in the text, ``(start, stop)``, from its first to after its last character.
    statement: tuple[int, int] = (0, 0)
    #: target_text, via_text: where the words for the targets stand in the text, inside of `statement`. ``(0, 0)`` for a
    #: move that cannot be split.
    target_text: tuple[int, int] = (0, 0)
    via_text: tuple[int, int] | None = None


@dataclass(frozen=True)
class Skipped:
    """A target that is left as it is."""

    source: int  #: source, line: file of the program, from 0, and line in it, from 1.
    line: int
    reason: str  #: Why, in plain words.


@dataclass(frozen=True)
class Program:
    """A robot program: its texts, and what was found in them."""

    language: str  #: Name of the language.
    sources: tuple[Source, ...]  #: Its files.
    targets: tuple[ProgramTarget, ...]  #: In the order of the text.
    moves: tuple[Move, ...] = ()  #: In the order of the text.
    #: By name, ``T_flange_tip`` as the program defines it, in the controller's flange frame.
    tools: Mapping[str, Transform] = field(default_factory=dict)
    #: By name, ``T_base_frame`` as the program defines it, in the controller's base frame.
    frames: Mapping[str, Transform] = field(default_factory=dict)
    skipped: tuple[Skipped, ...] = ()  #: What looks like a target and cannot be corrected, with the reason.
    #: How often an instruction occurs that the reader does not know and leaves alone, by its first word.
    unknown: Mapping[str, int] = field(default_factory=dict)
    #: By the name of a tool, what the program says that the robot carries with it; the centre of gravity in the
    #: controller's flange frame.
    loads: Mapping[str, Payload] = field(default_factory=dict)
    load_changes: bool = False  #: Whether instructions change what the robot carries.

    def by_file(self) -> dict[Path, list[ProgramTarget]]:
        """Return its targets by the files in which they stand."""
        targets: dict[Path, list[ProgramTarget]] = {source.path: [] for source in self.sources}
        for target in self.targets:
            targets[self.sources[target.source].path].append(target)
        return targets


class Edit(NamedTuple):
    """Text to put in the place of other text."""

    source: int  #: File of the program, from 0.
    #: start, stop: what is replaced, in the text as it was; nothing if they are the same, and the new text is put
    #: before it.
    start: int
    stop: int
    text: str  #: The new text.


@dataclass(frozen=True)
class Split:
    """A linear or circular move that is split into segments."""

    move: int  #: Index of the move.
    #: One entry for each instruction to insert before the move: the numbers of its target, and of its via for a circle
    #: (else None), in the form and units of the move's target.
    points: tuple[tuple[tuple[float, ...], tuple[float, ...] | None], ...]
    #: For a circle the numbers of the via of its last segment, which is the move itself.
    last_via: tuple[float, ...] | None = None


class SplitEdits(NamedTuple):
    """How the text of a program changes when moves are split."""

    edits: list[Edit]  #: What changes in the text.
    unsplit: list[int]  #: Indices of moves that stay whole, because segments of them would do something else.


class MakersCalibration(NamedTuple):
    """How the maker of a controller may have calibrated the arm itself."""

    maker: str  #: Of robot and controller.
    name: str  #: What the maker calls it.
    always: bool = False  #: Whether every arm is delivered so, or only where it was ordered.


@dataclass(frozen=True)
class Language:
    """A robot language."""

    name: str  #: Its name.
    #: Of its files, lower case with the dot. The suffix decides the language; what is in the file has to agree.
    suffixes: tuple[str, ...]
    makers: tuple[str, ...]  #: Whose controllers run it, by the names that the maker has; the first is the usual one.
    recognizes: Callable[[str], bool]  #: Whether a text looks like this language.
    read: Callable[[Sequence[Source]], Program]  #: Read the files of one program, given together.
    #: Put lines of comment into a text of the language: ASCII, 32 characters at most. Every other byte stays, but for a
    #: count of lines; the text stays as it is where it has no place for them.
    comment: Callable[[str, Sequence[str]], str]
    #: Split moves; None if the language's programs cannot be split.
    split: Callable[[Program, Sequence[Split]], SplitEdits] | None = None
    #: Write a program from scratch: texts of its files by their names.
    new: Callable[[NewProgram], Mapping[str, str]] | None = None
    #: The same for a program with stops, waits and circles.
    motion: Callable[[MotionProgram], Mapping[str, str]] | None = None
    #: Whether files that are given together are one program and share names; else each is one for itself.
    together: bool = False
    #: Pairs of suffixes: beside a file of the first may lie one of the second that belongs to it.
    companions: tuple[tuple[str, str], ...] = ()
    #: How controllers that run it may have been calibrated by their maker; None if nothing is known of that.
    calibration: MakersCalibration | None = None
    #: flange, base: what the language calls the robot's own flange and base, in small letters. Every cell file may call
    #: them ``flange`` and ``base``.
    flange: tuple[str, ...] = ()
    base: tuple[str, ...] = ()
    #: Where a text reads numbers of a place: the first group is the name of the place, without an index that follows;
    #: None where comments and strings are matched instead. None if the language's programs cannot.
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


#: A number in a program.
NUMBER: Final = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
#: Neither millimetres nor degrees are ever as many.
LARGEST: Final = 1e6
_PARTS: Final = re.compile(r"[+-]?\d*\.?(\d*)(?:[eE]([+-]?\d+))?")
#: A number has more decimals only by mistake, and no float carries them.
_MOST: Final = 15


def decimals_of(text: str) -> int:
    """Return how many decimals a number is written with; ``1.5e-3`` has four."""
    if "e" not in text and "E" not in text:
        return min(len(text.partition(".")[2]), _MOST)
    match = _PARTS.fullmatch(text)
    if match is None:
        raise ValueError(f"{text!r} is no number")
    return int(min(max(len(match[1]) - float(match[2] or 0), 0), _MOST))  # an exponent may have 5000 digits


def rewritten(text: str, value: float, fewest: int) -> str:
    """Return the text of a number with another value, or the text as it is if its value is the same.

    Args:
        text: The number as it stands in the program.
        value: The new value, in the same unit.
        fewest: How many decimals it gets at least. It keeps those that it has.

    Note:
        Two values are the same if they agree when written with that many decimals, or to a hundredth of the last of
        `fewest`: what is smaller is the rounding of the arithmetic behind it.
    """
    old = float(text)
    away = abs(value - old)
    if away < 0.01 * 10.0**-fewest:
        return text
    decimals = max(decimals_of(text), fewest)
    new = written(value, decimals)
    return text if away < 2.0 * 10.0**-decimals and float(new) == round(old, decimals) else new


def written(value: float, decimals: int) -> str:
    """Return the text of a number with so many decimals; zero has no sign."""
    text = f"{value:.{decimals}f}"
    return text.lstrip("-") if text[0] == "-" and not float(text) else text


#: The byte order mark of UTF-8 in a text of one character a byte.
BYTE_ORDER_MARK: Final = "\xef\xbb\xbf"
_END: Final = re.compile(r"\r\n?|\n")
_BLANK: Final = re.compile(r"[ \t]*+")


class Lines:
    """The lines of a text, which end with a line feed, a carriage return or both."""

    def __init__(self, text: str) -> None:
        characters = np.frombuffer(text.encode("latin-1", "replace"), dtype=np.uint8)
        ends = (characters == 10) | (characters == 13)
        ends[:-1] &= (characters[:-1] != 13) | (characters[1:] != 10)
        self._starts: list[int] = (np.flatnonzero(ends) + 1).tolist()

    def number(self, place: int) -> int:
        """Return the number of the line that a place in the text is on, from 1."""
        return bisect_right(self._starts, place) + 1


def without_mark(text: str) -> str:
    """Return a text with blanks in the place of a byte order mark."""
    size = len(BYTE_ORDER_MARK)
    return " " * size + text[size:] if text.startswith(BYTE_ORDER_MARK) else text


def line_end(text: str, place: int = 0) -> str:
    """Return what ends the line that a place is on, for the last line what ends the first."""
    match = _END.search(text, place) or _END.search(text)
    return match[0] if match else "\n"


def indentation(text: str, place: int) -> str:
    """Return the blanks at the start of the line that a place is on, and before the place."""
    start = max(text.rfind("\n", 0, place), text.rfind("\r", 0, place)) + 1
    blank = _BLANK.match(text, start, place)
    return blank[0] if blank else ""


def replaced(text: str, start: int, stop: int, words: Iterable[tuple[int, int, str]]) -> str:
    """Return a stretch of a text with other words, ``(start, stop, word)``, in places that do not overlap."""
    parts, place = [], start
    for begin, end, word in sorted(words, key=lambda edit: edit[:2]):
        if begin < place:
            raise ValueError(f"words overlap at {begin}")
        parts += [text[place:begin], word]
        place = end
    return "".join((*parts, text[place:stop]))


#: What stands in a program that was written corrected, in a comment of its own.
MARK: Final = "corrected by truearm"
#: FANUC's and Yaskawa's controllers take no longer comments [characters].
_LONGEST: Final = 32
#: Controllers and editors may change letters and blanks.
_MARKED: Final = re.compile(rf"({MARK.replace(' ', ' +')}(?: +\d[\w.+]*+)?)[ \t;>-]*(?=[\r\n]|\Z)", re.IGNORECASE)
_LINE_END: Final = re.compile(r"[\r\n]|\Z")
#: What ends a comment in some language, or what a controller may not read.
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9 ./+-]|-(?=-)")


def correction_comment(day: date, robot: str = "", calibration: str = "") -> tuple[str, ...]:
    """Return the lines that name a program as corrected, in ASCII, 32 characters at most.

    Args:
        day: When it was corrected.
        robot: For which robot; empty if that stands there already.
        calibration: Hash of the robot's file; empty if it has none.
    """
    origin = f"{day.isoformat()}, calibration {calibration[:8]}" if calibration else day.isoformat()
    lines = [f"{MARK} {__version__}", origin, *([f"for {_UNSAFE.sub('_', robot)}"] if robot else [])]
    return tuple(line[:_LONGEST].rstrip() for line in lines)


def comment_of(text: str) -> str | None:
    """Return the words in a text that name it as corrected; None if there are none.

    They have a line of their own, without other words before them.
    """
    if MARK.split()[-1] not in text.lower():
        return None
    for match in _MARKED.finditer(text):
        before = max(text.rfind("\n", 0, match.start()), text.rfind("\r", 0, match.start())) + 1
        if not re.search("[A-Za-z]", text[before : match.start()]):
            return match[1]
    return None


def with_lines_behind(text: str, place: int, lines: Sequence[str], comment: str | None) -> str:
    """Return a text with lines of comment behind the one that a place is on.

    Args:
        place: Behind the last word that has to stand before them. What follows on its line goes to a line behind them,
            unless it is a comment.
        comment: How comments begin that last to the end of the line; None if no comment does.
    """
    end = _LINE_END.search(text, place)
    stop = end.start() if end else len(text)
    tail, break_ = text[place:stop].strip(), line_end(text, place)
    if not tail or (comment is not None and tail.startswith(comment)):
        return text[:stop] + "".join(break_ + line for line in lines) + text[stop:]
    return text[:place] + "".join(break_ + line for line in lines) + break_ + text[place:]
