"""What options hold: how each kind is checked, read from the command line, and written again.

Checks import what is heavy only when they run: the help of a command needs none of it. Values in Python are in SI
units, percent excepted; those of the command line, and those in messages, are in mm and degrees.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass
from pathlib import Path
from typing import Any, ClassVar, Final

from truearm.engine.base.errors import InputError, Words, wrong_kind

#: Units at the edges, and the one in Python of each that is another there.
_IN_PYTHON: Final = {"mm": "m", "deg": "rad", "mm/s": "m/s", "ppm": "1"}


class Kind:
    """What an option holds; what is its default, None for example, needs no check."""

    metavar: str  #: What stands for a value in the help.
    typed: ClassVar[Any] = str  #: What Typer makes of a word.
    at_edges: ClassVar[str] = ""  #: Unit on the command line and in messages; empty if it has none.

    @property
    def unit(self) -> str:
        """Unit in Python."""
        return _IN_PYTHON.get(self.at_edges, self.at_edges)

    @property
    def is_converted(self) -> bool:
        """Whether the unit in Python is another."""
        return self.at_edges in _IN_PYTHON

    @property
    def allowed(self) -> str:
        """What is allowed, where the type does not say it."""
        return ""

    def checked(self, value: Any, name: str, default: Any) -> Any:
        """Return a value that Python gave, or refuse it."""
        return value if value is default else self.check(value, name)

    def check(self, value: Any, name: str) -> Any:
        """Return a value that can be used, or refuse it by the name of its option."""
        return value

    def read(self, typed: Any, name: str) -> Any:
        """Return what was typed as Python has it."""
        return typed

    def typed_again(self, value: Any) -> list[str]:
        """Return a value as it is typed, once for each time that the option is repeated; an object by its kind."""
        return [type(value).__name__.upper() if is_dataclass(value) or hasattr(value, "shape") else str(value)]


@dataclass(frozen=True)
class Given(Kind):
    """What the job itself checks when it reads it: a robot, readings, a file of its own schema."""

    metavar: str = ""


class File(Given):
    """A file or folder."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no path."""
        from truearm.engine.base.files import path_argument

        path_argument(value, name)
        return value


class GivenFiles(Given):
    """A file or several, which the job itself reads."""

    typed = list[str]

    def read(self, typed: Any, name: str) -> Any:
        """Return the files, None for none."""
        return typed or None

    def typed_again(self, value: Any) -> list[str]:
        """Return each of them."""
        return [*map(str, value)] if isinstance(value, list | tuple) else super().typed_again(value)


@dataclass(frozen=True)
class Files(Given):
    """One or more files."""

    what: str = "file"  #: What each of them is, for messages.

    typed = list[str]

    def check(self, value: Any, name: str) -> Any:
        """Return their paths."""
        from truearm.engine.command.arguments import paths_argument

        return paths_argument(value, name, self.what)

    def typed_again(self, value: Any) -> list[str]:
        """Return each of them."""
        return [*map(str, value)]


class Flag(Given):
    """Yes or no; the command has its word alone."""

    typed = bool

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is neither True nor False."""
        from truearm.engine.command.arguments import flag_argument

        return flag_argument(value, name)


class Text(Given):
    """A text."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no text."""
        from truearm.engine.command.arguments import name_argument

        return name_argument(value, name)


@dataclass(frozen=True)
class Whole(Kind):
    """A whole number."""

    metavar: str = "N"
    low: int = 0
    high: int | None = None
    counts: bool = False  #: Whether it counts something, whose upper limit ``base.limits`` has by the option's name.
    or_zero: bool = False  #: Whether 0 is allowed below `low`.

    typed = int

    @property
    def allowed(self) -> str:
        """The range."""
        zero = "0, or " * self.or_zero
        return f"{zero}{self.low} or more" if self.high is None else f"{zero}{self.low} to {self.high}"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no whole number, or out of range."""
        from truearm.engine.command.arguments import count_argument, whole_argument

        if self.or_zero and type(value) is int and value == 0:
            return value
        if self.counts:
            return count_argument(value, name, self.low)
        return whole_argument(value, name, self.low, self.high)


@dataclass(frozen=True)
class Number(Kind):
    """A number, in an SI unit in Python."""

    at_edges: str = ""  # type: ignore[misc]  # an instance has its own
    metavar: str = ""
    low: float = -math.inf  #: low, high: at the edges.
    high: float = math.inf
    above: bool = False  #: Whether `low` itself is not allowed.
    deviation: bool = False  #: Whether it is a standard deviation: one that can be meant, or 0 if that is allowed.

    typed = float

    def __post_init__(self) -> None:
        if not self.metavar:
            object.__setattr__(self, "metavar", self.at_edges.upper())

    @property
    def allowed(self) -> str:
        """The range."""
        low, high, unit = f"{self.low:g}", f"{self.high:g}", f" {self.at_edges}" if self.at_edges else ""
        if math.isinf(self.low):
            return "" if math.isinf(self.high) else f"up to {high}{unit}"
        if self.above:
            return f"above {low}{unit}" if math.isinf(self.high) else f"above {low}, up to {high}{unit}"
        return f"{low}{unit} or more" if math.isinf(self.high) else f"{low} to {high}{unit}"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no finite number, out of range, or of a size that cannot be meant."""
        from truearm.engine.base.arrays import finite_number
        from truearm.engine.base.units import from_si, sized_si

        number = finite_number(value, name, allowed=self.allowed or None)
        shown = from_si(number, self._length) if self.is_converted else number
        if not self.low <= shown <= self.high or (self.above and shown == self.low):
            raise InputError(
                "the number is out of range",
                parameter=name,
                came=Words(f"{shown:g} {self.at_edges}".strip()),
                allowed=self.allowed,
                cure=self._in_another_unit(shown),
            )
        if self.is_converted and not (self.deviation and number == 0.0):
            sized_si(shown, self._length, parameter=name, deviation=self.deviation)
        return number

    def _in_another_unit(self, shown: float) -> str | None:
        if not self.is_converted or math.isinf(self.high):
            return None
        other = next((shown * by for by in (1e3, 1e-3) if self.low <= shown * by <= self.high), None)
        return f"Is it {other:g} {self.at_edges}? Check its unit." if other else None

    @property
    def _length(self) -> str:
        return self.at_edges.partition("/")[0]

    def read(self, typed: Any, name: str) -> Any:
        """Return the number in the SI unit."""
        from truearm.engine.base.units import to_si

        return to_si(typed, self._length) if self.is_converted else typed

    def typed_again(self, value: Any) -> list[str]:
        """Return it in the unit at the edges."""
        from truearm.engine.base.units import written

        return [f"{written(value, self._length) if self.is_converted else value}".removesuffix(".0")]


@dataclass(frozen=True)
class Numbers(Kind):
    """Numbers, typed with commas between."""

    metavar: str = "X,.."
    at_edges: str = ""  # type: ignore[misc]  # an instance has its own
    count: int | None = None  #: How many; None for one or more.
    example: str = ""  #: What is allowed, for messages.

    def check(self, value: Any, name: str) -> Any:
        """Refuse what are not so many finite numbers."""
        from truearm.engine.command.arguments import lengths_argument, numbers_argument

        count = self.count if self.count is not None else len(value) if isinstance(value, Sequence) else 1
        if self.at_edges == "mm":
            return lengths_argument(value, name, count)
        return numbers_argument(value, name, count, self.example)

    def read(self, typed: Any, name: str) -> Any:
        """Return the numbers of a text."""
        from truearm.engine.base.units import sized_si
        from truearm.engine.command.texts import read_numbers

        numbers = read_numbers(typed, name, self.example or f"numbers in {self.at_edges}")
        return [sized_si(number, self.at_edges, parameter=name) for number in numbers] if self.is_converted else numbers

    def typed_again(self, value: Any) -> list[str]:
        """Return them with commas between."""
        return [",".join(text for number in value for text in Number(self.at_edges).typed_again(number))]


@dataclass(frozen=True)
class Choice(Kind):
    """One of some names."""

    metavar: str = ""  #: Empty for the names themselves.
    known: Sequence[str] | Callable[[], Collection[str]] = ()  #: A function where they are not at hand yet.
    what: str | None = None  #: What it is the name of, for messages; None for the option.

    def __post_init__(self) -> None:
        if not self.metavar and not callable(self.known):
            object.__setattr__(self, "metavar", "|".join(self.known))

    @property
    def allowed(self) -> str:
        """The names, where they are at hand."""
        return "" if callable(self.known) else f"One of {', '.join(f'``{name}``' for name in self.known)}"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is none of them."""
        from truearm.engine.command.arguments import choice_argument

        names = self.known() if callable(self.known) else self.known
        return choice_argument(value, name, {known: known for known in names}, self.what)


@dataclass(frozen=True)
class ByFlags(Choice):
    """One of some names, for which the command has flags."""

    flags: Mapping[str, tuple[str, str]] = field(default_factory=dict)  #: Word and help of each but the default.


@dataclass(frozen=True)
class Names(Kind):
    """Names."""

    metavar: str = "NAME"
    example: str = "names of configurations"  #: What is allowed, for messages.
    known: Callable[[], Collection[str]] | None = None  #: Those that there are; None if only the data know them.
    what: str = ""  #: What they are the names of.
    commas: bool = True  #: Whether a word of the command holds several, with commas between.
    repeated: bool = True  #: Whether the option may be repeated.

    @property
    def typed(self) -> Any:
        """Words, or one."""
        return list[str] if self.repeated else str

    def check(self, value: Any, name: str) -> Any:
        """Refuse what are no names, or not of those that there are."""
        from truearm.engine.command.arguments import choices_argument, names_argument

        if self.known is None:
            return names_argument(value, name, self.example)
        return choices_argument(value, name, self.known(), self.what)

    def read(self, typed: Any, name: str) -> Any:
        """Return the names of a text, or of several."""
        texts = typed if isinstance(typed, list) else [typed]
        return [part.strip() for text in texts for part in (text.split(",") if self.commas else [text])]

    def typed_again(self, value: Any) -> list[str]:
        """Return them, with commas between where they may have some."""
        return [",".join(map(str, value))] if self.commas else [*map(str, value)]


class NumberOr(Given):
    """A whole number or a text, which the job tells apart."""

    def read(self, typed: Any, name: str) -> Any:
        """Return a number where the text is one."""
        try:
            return int(typed)
        except ValueError:
            return typed


class CountOr(NumberOr):
    """How many of something, or what has them: measurements or a file."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no count."""
        from truearm.engine.command.arguments import count_argument
        from truearm.engine.data.dataset import Dataset

        return value if isinstance(value, Dataset | str | Path) else count_argument(value, name)


class PayloadKind(Given):
    """What a robot carries: an object, or a text with its mass and centre of gravity."""

    @property
    def allowed(self) -> str:
        """An example."""
        return "An object, or a text such as ``2.7kg,50mm,25mm,100mm``"

    def check(self, value: Any, name: str) -> Any:
        """Return it as an object."""
        from truearm.engine.command.arguments import payload_argument

        return payload_argument(value, name)

    def typed_again(self, value: Any) -> list[str]:
        """Return its text."""
        return [value.text]


class Gravity(Given):
    """Free fall in the robot's base frame."""

    at_edges = "m/s^2"

    def check(self, value: Any, name: str) -> Any:
        """Return three numbers."""
        from truearm.engine.command.arguments import gravity_argument

        return gravity_argument(value, name)

    def read(self, typed: Any, name: str) -> Any:
        """Return the numbers of a text."""
        from truearm.engine.base.units import as_number

        numbers = [as_number(part.strip()) for part in typed.split(",")]
        if len(numbers) != 3 or any(number is None for number in numbers):
            raise InputError(
                "three numbers belong here", parameter=name, came=typed, allowed="0,0,-9.81 for a robot that stands"
            )
        return numbers

    def typed_again(self, value: Any) -> list[str]:
        """Return them with commas between."""
        return [",".join(text for number in value for text in Number().typed_again(number))]


class NotesKind(Given):
    """What a person notes, by its name."""

    typed = list[str]

    def check(self, value: Any, name: str) -> Any:
        """Return texts by their names."""
        from truearm.engine.command.arguments import notes_argument

        return notes_argument(value, name)

    def read(self, typed: Any, name: str) -> Any:
        """Return the notes that texts such as ``serial=1234`` hold."""
        notes: dict[str, str] = {}
        for text in typed:
            key, separator, note = text.partition("=")
            if not separator or key.strip() in notes:
                what = "a note was given twice" if separator else "a note is a name and a text"
                raise InputError(what, parameter=name, came=text, allowed="NAME=TEXT, such as serial=1234")
            notes[key.strip()] = note
        return notes

    def typed_again(self, value: Mapping[str, str]) -> list[str]:
        """Return them as they are typed."""
        return [f"{name}={note}" for name, note in value.items()]


class WrenchKind(Given):
    """What acts on a tool: an object, a text, or six numbers; the job reads it with the frame of its axes."""

    def typed_again(self, value: Any) -> list[str]:
        """Return its text."""
        if isinstance(value, str | Path):
            return [str(value)]
        return [value.text] if hasattr(value, "text") else Numbers().typed_again(value)


class TruthKind(Given):
    """What a robot truly is: a name, a file, or a robot."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is none of these."""
        from truearm.engine.base.files import path_argument
        from truearm.engine.robot.robot import Robot

        if isinstance(value, Robot):
            return value
        if not isinstance(value, str | Path):
            allowed = "nominal, random, gear-errors, tooth-errors, a truth's name, or a robot"
            raise wrong_kind("a truth belongs here", value, name, allowed)
        path_argument(value, name)
        return value


class Positions(Given):
    """Joint positions by the model, or a text in deg and mm: the job reads it with the robot at hand."""

    def typed_again(self, value: Any) -> list[str]:
        """Return a text; numbers are typed in units that only the robot knows."""
        return [value if isinstance(value, str) else self.metavar]


class NamedFiles(Given):
    """Files by name."""

    typed = list[str]
    what: ClassVar[str] = "file"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what are no paths by name."""
        from truearm.engine.command.arguments import files_argument

        return files_argument(value, name)

    def read(self, typed: Any, name: str) -> Any:
        """Return the files of texts such as ``base=points.txt``."""
        named: dict[str, str] = {}
        for text in typed:
            key, separator, file = text.partition("=")
            if not key or not separator or not file:
                allowed = f"NAME={self.what.upper()}"
                raise InputError(f"a name and a {self.what} belong here", parameter=name, came=text, allowed=allowed)
            if key in named:
                raise InputError("this name is given twice", parameter=name, came=key)
            named[key] = file
        return named

    def typed_again(self, value: Mapping[str, Any]) -> list[str]:
        """Return them as they are typed."""
        return [f"{name}={file}" for name, file in value.items()]


class Callback(Given):
    """A function that is called with a few words at each step; it is no part of what is asked for."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what cannot be called."""
        if not callable(value):
            raise wrong_kind("a function belongs here", value, name, "a function that takes a text")
        return value


class Doing(Given):
    """An executor that does parts of the work; it is no part of what is asked for."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no executor."""
        from truearm.engine.command.arguments import executor_argument

        return executor_argument(value)


class Again(Given):
    """How the caller would run a job again."""

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no text."""
        from truearm.engine.command.arguments import command_argument

        return command_argument(value)
