"""The arguments of RAPID's instructions and functions.

Source: ABB, Technical reference manual, RAPID Kernel (3HAC050946-001), argument lists: optional arguments begin with a
backslash and may follow the one before without a comma.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

#: Brackets, commas and backslashes; innermost brackets together with what is in them.
_MARK: Final = re.compile(r"\[[^\[\](){}]*+\]|[\[\](){},\\]")
#: What nearly all arguments are: a target, three names, and perhaps a work object. Found at once, as programs are long.
_USUAL: Final = re.compile(
    r"\s*+(\w++|\[(?:[^\[\]]++|\[[^\[\]]*+\])*+\])\s*+,\s*+(\w++)\s*+,\s*+(\w++)\s*+,\s*+(\w++)\s*+"
    r"(?:\\\s*+WObj\s*+:=\s*+(\w++)\s*+)?+",
    re.I,
)
_OPTION: Final = re.compile(r"\\\s*+([^\W\d]\w*+)\s*+(?::=)?+")


@dataclass(slots=True)
class Arguments:
    """The arguments of an instruction or a function."""

    #: Where those stand that are not optional, each ``(start, stop)``.
    needed: list[tuple[int, int]] = field(default_factory=list)
    #: Where the values of the optional ones stand, by name in lower case; a switch has an empty one.
    options: dict[str, tuple[int, int]] = field(default_factory=dict)


def trimmed(code: str, start: int, stop: int) -> tuple[int, int]:
    """Return what remains of a span without white space at its ends."""
    if start < stop and not code[start].isspace() and not code[stop - 1].isspace():
        return start, stop
    text = code[start:stop]
    inner = text.lstrip()
    start += len(text) - len(inner)
    return start, start + len(inner.rstrip())


def arguments_of(code: str, start: int, stop: int) -> Arguments:
    """Return the arguments that stand in a span of code, whose brackets must be closed."""
    usual = _USUAL.fullmatch(code, start, stop)
    if usual is not None:
        _, *needed, frame = usual.regs
        return Arguments(needed, {} if frame[0] < 0 else {"wobj": frame})
    found = Arguments()
    depth, begin, optional = 0, start, False
    for mark in _MARK.finditer(code, start, stop):
        character = mark[0]
        if len(character) > 1:
            continue
        if character in "[({":
            depth += 1
        elif character in "])}":
            depth -= 1
        elif depth == 0:
            _put(found, code, begin, mark.start(), optional, after_option=character == "\\")
            optional = character == "\\"
            begin = mark.start() + (not optional)
    _put(found, code, begin, stop, optional, after_option=False)
    return found


def _put(found: Arguments, code: str, start: int, stop: int, optional: bool, after_option: bool) -> None:
    if not optional:
        span = trimmed(code, start, stop)
        # What is empty before an optional argument is none that is missing.
        if span[0] < span[1] or not after_option:
            found.needed.append(span)
    elif (name := _OPTION.match(code, start, stop)) is not None:
        found.options[name[1].lower()] = trimmed(code, name.end(), stop)
