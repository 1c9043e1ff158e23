"""KRL as statements: one a line, with comments and the inside of strings out of the way."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from truearm.compensation.programs.lines import Lines, without_mark
from truearm.compensation.programs.program import Source
from truearm.errors import InputError

_LONE_RETURN: Final = re.compile(r"\r(?!\n)")
#: Lines that are empty, a comment or a header (``&ACCESS``), and then one that is not.
_LINE: Final = re.compile(r"(?:[ \t\r]*+(?:[;&][^\n]*+)?\n)*+[ \t\r]*+((\$?[A-Za-z_][\w$]*+)?+[^\n]*+)\n?", re.ASCII)
_CODE: Final = re.compile(r'(?:[^";\n]++|"[^"\n]*+")*+')
_STRING: Final = re.compile(r'"[^"\n]*+"')


#: A statement: its first word in capitals, where it begins, and where its first word and itself end.
Statement = tuple[str, int, int, int]


def short(name: str) -> str:
    """Return a name as it can be shown."""
    return name if len(name) <= 60 else f"{name[:57]}..."


class Text:
    """One source, read as lines.

    Attributes:
        index: Of the source.
        module: Its name without suffix, in capitals: .src and .dat of one name are one module.
        flat: Its text, every character at its place, with a newline at the end of every line.
    """

    def __init__(self, index: int, source: Source) -> None:
        self.index = index
        self._source = source
        self.module = source.path.stem.upper()
        self.flat = _LONE_RETURN.sub("\n", without_mark(source.text))
        self._lines = Lines(source.text)

    def line(self, place: int) -> int:
        """Return the number of the line that a place is on, from 1."""
        return self._lines.number(place)

    def refusal(
        self, what: str, place: int, came: str | None = None, allowed: str | None = None, cure: str | None = None
    ) -> InputError:
        """Return the error that refuses what stands at a place."""
        return InputError(what, where=self._source.where(self.line(place)), came=came, allowed=allowed, cure=cure)

    def statements(self) -> Iterator[Statement]:
        """Yield the statements that begin with a word, and refuse those that end in the middle."""
        flat = self.flat
        for line in _LINE.finditer(flat):
            start, stop = line.span(1)
            word = line[2]
            if word is None:
                continue
            if flat.find('"', start, stop) >= 0:
                stop = self._end_of_code(start, stop)
                bare = _STRING.sub("", flat[start:stop])
                closed = bare.count("{") == bare.count("}")
            else:
                comment = flat.find(";", start, stop)
                if comment >= 0:
                    stop = comment
                closed = flat.count("{", start, stop) == flat.count("}", start, stop)
            while flat[stop - 1] in " \t\r":
                stop -= 1
            if not closed:
                raise self.refusal(
                    "the curly brackets of this line do not close", start, flat[start:stop], cure="Is the file cut off?"
                )
            yield word.upper(), start, start + len(word), stop

    def _end_of_code(self, start: int, stop: int) -> int:
        code = _CODE.match(self.flat, start, stop)
        end = code.end() if code else start
        if end < stop and self.flat[end] == '"':
            raise self.refusal("a string does not close", start, self.flat[start:stop], cure="Is the file cut off?")
        return end
