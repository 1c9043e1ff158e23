"""Errors and notices: :class:`InputError`, :class:`Notice`, printable text, and short displays of objects."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence, Sized
from contextlib import contextmanager
from dataclasses import dataclass, field
from html import escape
from itertools import islice
from numbers import Rational
from typing import Any, Final, Literal

# Text from files and command lines as it may be shown: nothing in it steers a terminal or hides what stands there.

#: Controls, halves of characters, breaks of lines and paragraphs, by their Unicode categories.
_UNSEEN: Final = ("Cc", "Cs", "Zl", "Zp")
#: What turns the direction of the text around it (Unicode Standard Annex 9): ``gpj.exe`` is shown as ``exe.jpg``.
TURNING: Final = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
#: A word of more characters is no word that anybody reads; paths are shorter.
LONGEST_WORD: Final = 300
_LONG_WORD: Final = re.compile(rf"\S{{{LONGEST_WORD + 1},}}")


def is_one_line(text: str) -> bool:
    """Return whether a text is one line that can be seen: not blank, without breaks and control characters."""
    return bool(text.strip()) and not any(_steers(character) for character in text)


def printable(text: str) -> str:
    r"""Return a text as one line that can be shown: control characters as their escapes, such as ``\x1b``."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(ascii(character)[1:-1] if _steers(character) else character for character in text)


def shortened(text: str, longest: int) -> str:
    """Return a text, without its middle if it has more than `longest` characters."""
    if len(text) <= longest:
        return text
    tail = longest // 4
    return f"{text[: longest - tail - 3]}...{text[-tail:]}"


def with_short_words(text: str) -> str:
    """Return a text in which very long words, such as a name of 5000 characters, have lost their middle."""
    return _LONG_WORD.sub(lambda match: shortened(match[0], LONGEST_WORD), text)


def _steers(character: str) -> bool:
    return unicodedata.category(character) in _UNSEEN or character in TURNING


#: A parameter that a text names, with a value or without: `seed`, `train=all`.
_NAMED: Final = re.compile(r"`(?P<name>[a-z][a-z_]*)(?:=(?P<value>[^`]*))?`")
#: A part of a message of more characters is shortened, and what came much sooner.
_LONGEST: Final = 1500
_LONGEST_VALUE: Final = 160
#: Names are compared with so many others at most: more take long and help nobody.
_MOST_COMPARED: Final = 2000


class InputError(ValueError):
    """Input that truearm refuses, with everything a person needs to fix it.

    Texts name parameters of a job in backticks (```seed```, ```train=all```), so that every caller can show them in its
    own words: Python as they are, the command as its options (:meth:`message`).

    Parameters
    ----------
    what
        What is wrong, in plain words.
    parameter
        Which parameter of the job; several are separated by a comma and a blank.
    where
        File, row and column, or the robot, where that says more than the parameter.
    came
        What was found there.
    allowed
        What would have been valid.
    cure
        What to do.
    """

    def __init__(
        self,
        what: str,
        *,
        parameter: str | None = None,
        where: str | None = None,
        came: object = None,
        allowed: str | None = None,
        cure: str | None = None,
    ) -> None:
        self.what, self.parameter, self.where = what, parameter, where
        self.came, self.allowed, self.cure = came, allowed, cure
        self.result: Any = None  # of the job, where it is refused only to write it
        super().__init__(self.message(str))

    def message(self, spelled: Callable[[str], str]) -> str:
        """Return the message with parameters as `spelled` names them, backticks included for those in texts."""
        where = self.where
        if where is None and self.parameter is not None:
            where = ", ".join(spelled(name) for name in self.parameter.split(", "))
        what = shortened(with_short_words(self.what), _LONGEST)
        parts = [f"{shortened(where, _LONGEST)}: {what}" if where else what]
        if self.came is not None:
            parts.append(f"got {_shown(self.came)}")
        if self.allowed is not None:
            parts.append(f"allowed: {shortened(with_short_words(self.allowed), _LONGEST)}")
        message = "; ".join(parts).rstrip(".") + "."
        return printable(f"{message} {shortened(with_short_words(self.cure), _LONGEST)}" if self.cure else message)


def wrong_kind(what: str, came: object, parameter: str, allowed: str, *, where: str | None = None) -> InputError:
    """Return the refusal of a value of another kind than belongs here."""
    if came is None:
        came = Words("None")
    elif not isinstance(came, str | bytes | int | float):
        size = f" of {len(came)}" if isinstance(came, Sized) and getattr(came, "ndim", None) != 0 else ""
        content = f" that holds {came.dtype}" if hasattr(came, "dtype") else ""
        came = Words(f"an object of type {kind_of(came)}{size}{content}")
    return InputError(what, parameter=parameter, where=where, came=came, allowed=allowed)


@contextmanager
def refusals_of(parameter: str) -> Iterator[None]:
    """Let refusals of what a parameter holds name it, beside the file or the place that they name."""
    try:
        yield
    except InputError as error:
        if error.parameter is None:
            name_parameter(error, parameter)
        raise


def name_parameter(error: InputError, parameter: str) -> None:
    """Let a refusal name a parameter."""
    error.parameter = parameter
    error.args = (error.message(str),)


def name_place(error: InputError, where: str) -> None:
    """Let a refusal name the place in a file."""
    error.where = where
    error.args = (error.message(str),)


@contextmanager
def refusals_at(where: str) -> Iterator[None]:
    """Let refusals name the place in a file where the value that they refuse stands."""
    try:
        yield
    except InputError as error:
        name_place(error, where)
        raise


def kind_of(value: object) -> str:
    """Return the name of an object's type, for messages."""
    return type(value).__name__


def with_parameters(text: str, spelled: Callable[[str, str | None], str]) -> str:
    """Return a text in which every parameter named in backticks is as `spelled` writes it, with its value if any."""
    return _NAMED.sub(lambda match: spelled(match["name"], match["value"]), text)


class Words(str):
    """What is said of a value instead of the value itself: shown without quotes."""

    __slots__ = ()


def _shown(value: object) -> str:
    if isinstance(value, Rational) and max(abs(int(value.numerator)), int(value.denominator)) >> 300:
        return "a number of very many digits"  # Python may refuse to write it out
    quoted = isinstance(value, str) and not isinstance(value, Words)
    text = repr(shortened(str(value), _LONGEST_VALUE)) if quoted else str(value)
    return shortened(text, _LONGEST if isinstance(value, Words) else _LONGEST_VALUE)


def nearest_names(name: str, known: Iterable[str], count: int = 3, likeness: float = 0.5) -> list[str]:
    """Return the known names most like `name`, best first, for a message that offers them; of very many the first few.

    Args:
        likeness: How like they must be, 0 to 1.
    """
    import difflib  # only where something is misspelt

    if len(name) > _LONGEST_VALUE:  # nobody misspells that, and to compare it takes long
        return []
    few = (candidate for candidate in islice(known, _MOST_COMPARED) if len(candidate) <= _LONGEST_VALUE)
    by_folded = {candidate.lower(): candidate for candidate in few}
    if name.lower() in by_folded:
        return [by_folded[name.lower()]]
    return [by_folded[match] for match in difflib.get_close_matches(name.lower(), by_folded, count, likeness)]


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """Return a sentence that offers the known names most like `name`, None if none is like it."""
    near = nearest_names(name, known)
    return f"Did you mean {' or '.join(near)}?" if near else None


#: ``note``: good to know. ``warning``: a figure may not hold. ``error``: the result should not be used as it is.
Level = Literal["note", "warning", "error"]
LEVELS: Final[tuple[Level, ...]] = ("note", "warning", "error")


@dataclass(frozen=True)
class Notice:
    """A warning in plain words, made by its rule."""

    code: str  #: Stable short name, for programs: ``redundant``, ``at-bound``.
    message: str  #: What was noticed and what to do about it.
    level: Level = "warning"  #: How bad it is.
    #: The readings that it is about, where it is about single ones: label of the configuration and name of the target,
    #: which is empty for all that were read there.
    at: tuple[tuple[str, str], ...] = field(default=(), compare=False, repr=False)
    rule: Rule | None = field(default=None, compare=False, repr=False)  #: What made it; None if it came from a file.

    @property
    def gravity(self) -> int:
        """Its place among notices of its level, see :class:`Rule`; what is said of a file comes first."""
        return 2 if self.rule is None else self.rule.gravity

    def summary(self) -> dict[str, str]:
        """Return it as JSON holds it; a code that was another one before stands beside that for one release."""
        before = {"formerly": self.rule.formerly} if self.rule is not None and self.rule.formerly else {}
        return {"code": self.code, **before, "level": self.level, "message": self.message}


@dataclass(frozen=True)
class Rule:
    """A kind of notice. It is declared once, beside the function that finds it, and makes the notices of its code.

    The guide's table of codes is made from the rules.
    """

    code: str  #: Stable short name, for programs.
    level: Level | tuple[Level, ...]  #: How bad it is; the usual level first where it is chosen when it is told.
    meaning: str  #: What was noticed, for the guide: a part of a sentence in Markdown.
    cure: str = ""  #: What to do about it, in sentences; they end each message.
    #: Its place among notices of its level: 2 if a figure that was asked for may not hold, 1 if a part of the result
    #: may not, 0 if the result holds.
    gravity: int = 1
    unless: frozenset[str] = frozenset()  #: Codes of notices beside which it says nothing.
    formerly: str = ""  #: Its code in the release before, if that was another one.

    @property
    def levels(self) -> tuple[Level, ...]:
        """Every level that it may have, the usual one first."""
        return self.level if isinstance(self.level, tuple) else (self.level,)

    def __call__(self, text: str, level: Level | None = None, at: tuple[tuple[str, str], ...] = ()) -> Notice:
        """Return the notice: what was noticed, with figures and names, and the cure behind it."""
        message = f"{text} {self.cure}" if self.cure else text
        return Notice(self.code, message, level or self.levels[0], at, self)


def worst_first(notices: Iterable[Notice]) -> tuple[Notice, ...]:
    """Return notices with errors first and notes last, and the gravest of a level first; otherwise in their order."""
    return tuple(sorted(notices, key=lambda notice: (-LEVELS.index(notice.level), -notice.gravity)))


def has_error(notices: Iterable[Notice]) -> bool:
    """Return whether a notice says that the result should not be used as it is."""
    return any(notice.level == "error" for notice in notices)


#: What a `repr` may be long at most.
_LONGEST_SHOWN: Final = 2000
#: How many names are listed.
_LISTED: Final = 8


def short_text(lines: Iterable[str]) -> str:
    """Return lines as one text of at most 2000 characters."""
    text = "\n".join(lines)
    return text if len(text) <= _LONGEST_SHOWN else f"{text[: _LONGEST_SHOWN - 4].rstrip()}\n..."


def as_html(text: str) -> str:
    """Return a text as a notebook shows it."""
    return f"<pre>{escape(text)}</pre>"


def listed(names: Sequence[str]) -> str:
    """Return names separated by commas, the first ones of many."""
    if len(names) <= _LISTED:
        return ", ".join(names)
    return f"{', '.join(names[: _LISTED - 1])} and {len(names) - _LISTED + 1} more"


def counted(count: int, thing: str) -> str:
    """Return a count with the thing in the singular or the plural: ``1 reading``, ``2 readings``."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def millimetres(length: float) -> str:
    """Return a length [m] in mm with three digits, more of a long one."""
    return _three_digits(length * 1e3)


def degrees(angle: float) -> str:
    """Return an angle [rad] in deg with three digits, more of a large one."""
    return _three_digits(math.degrees(angle))


def _three_digits(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"
