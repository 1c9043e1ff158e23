"""What a result says: words, tables, pictures, in sections. Text, JSON and pages are made of them.

The text of a command is its blocks line by line; JSON holds what stands beside the words; one template draws all
pages. None of them knows a feature.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Final

from truearm.engine.base.errors import Notice, worst_first
from truearm.engine.base.units import without_mark
from truearm.engine.diagnose.next_step import NextStep
from truearm.engine.document.drawing import Figure
from truearm.engine.document.page import page

_TEMPLATE: Final = Path(__file__).with_name("document.html.jinja")


@dataclass(frozen=True)
class Words:
    """A paragraph; what is in backticks is shown as code. In text it is a line, or some."""

    text: str
    quiet: bool = False  #: Whether it stands back.
    in_json: Mapping[str, Any] = field(default_factory=dict)  #: What JSON holds of it.
    is_detail: bool = False  #: Whether it is not on the first screen.
    kind: ClassVar = "words"

    @property
    def lines(self) -> list[str]:
        """It as lines of text."""
        return self.text.split("\n") if self.text else []


@dataclass(frozen=True)
class Cell:
    """A cell of a table that is more than a text."""

    text: str
    sort: float | str | None = None  #: What rows are sorted by; None for the text.
    code: bool = False  #: Whether it is a name, of a parameter for example.
    link: str | None = None
    look: str = ""  #: A class of the style sheet.
    share: str | None = None  #: Percent that a bar before the text shows.
    chip: str = ""  #: The colour of a small square before it: ``before`` or ``after``.

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Table:
    """A table."""

    heading: tuple[str, ...]  #: Names of the columns; those after the first are numbers, if they are not in `texts`.
    rows: Sequence[Sequence[str | Cell]]  #: Its cells, row by row.
    texts: tuple[int, ...] = ()  #: Columns of words, from 0, whose cells go on in another line where there is no room.
    caption: str = ""
    name: str = ""  #: Of its place on the page.
    look: str = ""  #: ``sortable`` and classes of the style sheet.
    wide: bool = False  #: Whether it may be wider than the page.
    marks: tuple[str, ...] = ()  #: Of each row: ``uninformed``, ``taken``, or nothing.
    in_json: Mapping[str, Any] = field(default_factory=dict)  #: What JSON holds of it.
    is_detail: bool = False  #: Whether it is not on the first screen.
    kind: ClassVar = "table"

    @property
    def lines(self) -> list[str]:
        """It as lines of text, its columns under each other."""
        rows = [[str(cell) for cell in row] for row in (self.heading, *self.rows)]
        wide = [max(map(len, column)) for column in zip(*rows, strict=True)]
        return ["  ".join(cell.ljust(width) for cell, width in zip(row, wide, strict=True)).rstrip() for row in rows]

    def is_number(self, column: int) -> bool:
        """Return whether a column, from 0, has numbers."""
        return column > 0 and column not in self.texts


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture."""

    name: str  #: Of its place on the page.
    figure: Figure  #: What Plotly draws.
    kind: ClassVar = "picture"


@dataclass(frozen=True)
class Lead:
    """The answer: one figure, before and after, and what it is."""

    blocks: Sequence[Block]
    now: str = ""
    was: str = ""
    unit: str = ""
    name: str = ""
    kind: ClassVar = "lead"


@dataclass(frozen=True)
class Facts:
    """Terms and what is said of them: words, or what to do next; empty is filled in by hand on paper."""

    entries: Sequence[tuple[str, str | Sequence[NextStep]]]
    name: str = ""
    kind: ClassVar = "facts"


@dataclass(frozen=True)
class Points:
    """A list under a small heading."""

    title: str
    words: str
    entries: Sequence[str]
    name: str = ""
    kind: ClassVar = "points"


@dataclass(frozen=True)
class Under:
    """What JSON holds as an object under a key, or as a list of them; in text its blocks stand like any others."""

    key: str
    blocks: Sequence[Block]
    kind: ClassVar = "under"


@dataclass(frozen=True)
class Each:
    """What JSON holds as a list under a key, an object for each entry; in text their blocks follow each other."""

    key: str
    entries: Sequence[Sequence[Block]]
    kind: ClassVar = "each"


@dataclass(frozen=True)
class Folded:
    """What is opened by a click."""

    summary: str
    blocks: Sequence[Block]
    open: bool = False
    kind: ClassVar = "folded"


@dataclass(frozen=True)
class Warned:
    """A notice."""

    notice: Notice
    kind: ClassVar = "notice"

    @property
    def level(self) -> str:
        """How grave it is."""
        return self.notice.level

    @property
    def code(self) -> str:
        """Its name."""
        return self.notice.code

    @property
    def message(self) -> str:
        """What it says."""
        return self.notice.message


@dataclass(frozen=True)
class Alert:
    """What the reader must not miss, and is no notice of the result."""

    strong: str
    words: str
    kind: ClassVar = "alert"


@dataclass(frozen=True)
class Section:
    """A part of a page under a heading."""

    title: str
    blocks: Sequence[Block]
    name: str = ""
    kind: ClassVar = "section"

    @property
    def is_drawn(self) -> bool:
        """Whether it has a picture, with which it is printed on one page."""
        return any(isinstance(block, Picture) for block in self.blocks)


Block = Words | Table | Picture | Lead | Facts | Points | Folded | Warned | Alert | Section | Under | Each


@dataclass(frozen=True)
class Document:
    """A page about a result."""

    title: str  #: Of the window.
    blocks: Sequence[Block]
    command: str  #: How to run it again.
    headline: str = ""  #: Over the page; empty for the title.
    subtitle: str = ""
    history: Sequence[str] = ()  #: What was done before.
    cover: Sequence[Block] = ()  #: What is printed on the first page, with a place to sign it.

    def html(self, of: object) -> str:
        """Return the page, one HTML file.

        Args:
            of: The record that it tells about: if that is simulated, the page begins with it.
        """
        return page(_TEMPLATE, pictures_of(self), of, document=self)


def say(*lines: str, **in_json: Any) -> Words:
    """Return lines of text, with what JSON holds of them by its keys; either may be missing, and lines may be empty."""
    return Words("\n".join(filter(None, lines)), in_json=in_json)


def detail(*lines: str, **in_json: Any) -> Words:
    """Return lines that are not on the first screen; arguments as for :func:`say`."""
    return Words("\n".join(filter(None, lines)), in_json=in_json, is_detail=True)


def under(key: str, blocks: Iterable[Block]) -> Under:
    """Return what JSON holds as an object under a key."""
    return Under(key, [*blocks])


def each(key: str, entries: Iterable[Words | Iterable[Block]]) -> Each:
    """Return what JSON holds as a list under a key, an object for each entry."""
    return Each(key, [[entry] if isinstance(entry, Words) else [*entry] for entry in entries])


def leaves_of(blocks: Iterable[Block]) -> Iterator[Words | Table]:
    """Give the blocks that have lines, also those inside others."""
    for block in blocks:
        if isinstance(block, Words | Table):
            yield block
        elif isinstance(block, Under):
            yield from leaves_of(block.blocks)
        elif isinstance(block, Each):
            for entry in block.entries:
                yield from leaves_of(entry)


def lines_of(blocks: Iterable[Block], *, details: bool = True) -> list[str]:
    """Return what blocks say as lines of text, without details if these are not asked for."""
    return [line for leaf in leaves_of(blocks) if details or not leaf.is_detail for line in leaf.lines]


def json_of(blocks: Iterable[Block]) -> dict[str, Any]:
    """Return what JSON holds of blocks."""
    summary: dict[str, Any] = {}
    for block in blocks:
        if isinstance(block, Words | Table):
            summary |= block.in_json
        elif isinstance(block, Under):
            summary[block.key] = json_of(block.blocks)
        elif isinstance(block, Each):
            summary[block.key] = [json_of(entry) for entry in block.entries]
    return summary


def _pictures(blocks: Sequence[Block]) -> Iterator[Picture]:
    for block in blocks:
        if isinstance(block, Picture):
            yield block
        elif isinstance(block, Lead | Folded | Section):
            yield from _pictures(block.blocks)


def answer(words: Sequence[str], notices: Sequence[Notice]) -> Section:
    """Return the section that a page begins with: what was found, a sentence each, and what to know about it."""
    lead = Lead([Words(sentence) for sentence in without_mark(words)])
    return Section("", [lead, *warned(notices)], "result")


def warned(notices: Sequence[Notice]) -> list[Warned]:
    """Return notices as they stand on a page, the worst first."""
    return [Warned(notice) for notice in worst_first(notices)]


def pictured(name: str, title: str, words: str, figure: Figure) -> Section:
    """Return a section of one picture under a few words."""
    return Section(title, [Words(words), Picture(name, figure)])


def tabled(title: str, heading: tuple[str, ...], rows: Sequence[Sequence[str]], texts: tuple[int, ...] = ()) -> Section:
    """Return a section of one table; arguments as for :class:`Table`."""
    return Section(title, [Table(heading, rows, texts, wide=True)])


def pictures_of(document: Document) -> dict[str, Figure]:
    """Return the pictures of a page by the names of their places."""
    return {picture.name: picture.figure for picture in _pictures((*document.cover, *document.blocks))}
