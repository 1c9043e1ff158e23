"""The one exception for input that cannot be used."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import contextmanager
from itertools import islice
from numbers import Rational
from typing import Final

from truearm.printable import printable, shortened, with_short_words

#: A parameter that a text names, with a value or without: `seed`, `train=all`.
_NAMED: Final = re.compile(r"`(?P<name>[a-z][a-z_]*)(?:=(?P<value>[^`]*))?`")
#: A part of a message of more characters is shortened, and what came much sooner.
_LONGEST: Final = 1500
_LONGEST_CAME: Final = 160
#: Names are compared with so many others at most: more take long and help nobody.
_MOST_COMPARED: Final = 2000


class InputError(ValueError):
    """Input that truearm refuses, with everything a person needs to mend it.

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
        held = f" that holds {came.dtype}" if hasattr(came, "dtype") else ""
        came = Words(f"an object of type {kind_of(came)}{size}{held}")
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


def kind_of(came: object) -> str:
    """Return the name of an object's type, for messages."""
    return type(came).__name__


def with_parameters(text: str, spelled: Callable[[str, str | None], str]) -> str:
    """Return a text in which every parameter named in backticks is as `spelled` writes it, with its value if any."""
    return _NAMED.sub(lambda found: spelled(found["name"], found["value"]), text)


class Words(str):
    """What is said of a value instead of the value itself: shown without quotes."""

    __slots__ = ()


def _shown(came: object) -> str:
    if isinstance(came, Rational) and max(abs(int(came.numerator)), int(came.denominator)) >> 300:
        return "a number of very many digits"  # Python may refuse to write it out
    quoted = isinstance(came, str) and not isinstance(came, Words)
    text = repr(shortened(str(came), _LONGEST_CAME)) if quoted else str(came)
    return shortened(text, _LONGEST if isinstance(came, Words) else _LONGEST_CAME)


def nearest_names(name: str, known: Iterable[str], count: int = 3, likeness: float = 0.5) -> list[str]:
    """Return the known names most like `name`, best first, for a message that offers them; of very many the first few.

    Args:
        likeness: How like they must be, 0 to 1.
    """
    import difflib  # only where something is misspelt

    if len(name) > _LONGEST_CAME:  # nobody misspells that, and to compare it takes long
        return []
    few = (candidate for candidate in islice(known, _MOST_COMPARED) if len(candidate) <= _LONGEST_CAME)
    by_folded = {candidate.lower(): candidate for candidate in few}
    if name.lower() in by_folded:
        return [by_folded[name.lower()]]
    return [by_folded[match] for match in difflib.get_close_matches(name.lower(), by_folded, count, likeness)]


def did_you_mean(name: str, known: Iterable[str]) -> str | None:
    """Return a sentence that offers the known names most like `name`, None if none is like it."""
    near = nearest_names(name, known)
    return f"Did you mean {' or '.join(near)}?" if near else None
