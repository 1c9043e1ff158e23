"""How a table seems to be laid out: delimiter, decimal sign, encoding, comments, header."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Final

from truearm.engine.base.errors import InputError, counted
from truearm.engine.base.files import read_bytes, wide_encoding
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import as_number
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, split_line
from truearm.engine.data.readers.sheets import Workbook, is_workbook, open_workbook, sheet_cells, texts_of

#: Lines that are looked at to see how a table is laid out, and to see what its columns hold.
_LOOKED_AT: Final = 400
_MOST_LINES: Final = 100_000
#: Characters of them.
_CHARACTERS: Final = 400_000
#: Lines of titles that may stand above the headings of a sheet.
_TITLES: Final = 8
_DELIMITERS: Final = {"semicolon": ";", "tab": "\t", "comma": ",", "whitespace": None}
_COMMENTS: Final = ("//", "#", "%", "!", "*")
#: Units of which 400 are a turn; a degree is called Grad in German too.
GON: Final = frozenset({"gon", "grad", "Grad"})
#: Units that stand in a line of their own, or behind a name.
UNITS: Final = {
    **{name: name for name in ("mm", "m", "um", "in", "deg", "rad", "mrad", "degC", "degF", "K")},
    **{"µm": "um", "μm": "um", "inch": "in", "°": "deg", "degree": "deg", "degrees": "deg", "gon": "gon"},
    **{"grad": "grad", "Grad": "Grad"},
    **{"radian": "rad", "radians": "rad", "°c": "degC", "°C": "degC", "degc": "degC", "°F": "degF"},
    **{"metre": "m", "meter": "m", "millimetre": "mm", "millimeter": "mm"},
}

#: Texts that mean that nothing was measured.
NOTHING: Final = re.compile(
    r"n\.?/?[avd]\.?|k\.?/?a\.?|verdeckt|ung.ltig|fehlt|nan|none|null|nil|-+|\?+|\*+|"
    r"missing|failed|fail|lost|invalid|#n/a|#div/0!|no data|nodata|occluded",
    re.IGNORECASE,
)
#: Among so many lines there may be headings.
_HEADED: Final = 15
#: So many different texts in a line without numbers are headings.
_DIFFERENT: Final = 3

#: A line of data has so many numbers.
_ENOUGH: Final = 2

Rows = list[tuple[int, list[str]]]


@dataclass(frozen=True)
class GuessedLayout:
    """How a table seems to be laid out."""

    entries: dict[str, tuple[str | int, str]]  #: Entries of the mapping's layout, with what the guess rests on.
    decimal: str  #: The decimal sign.
    names: tuple[str, ...]  #: Name of each column; its number if there is no header, or names are there twice.
    headings: tuple[str, ...]  #: What stands above each column, of two lines if the lower one alone has names twice.
    units: tuple[str, ...]  #: Unit of each column by a line of units, empty where there is none.
    columns: tuple[tuple[str, ...], ...]  #: The cells of all rows, column by column.
    lines: tuple[int, ...]  #: Line of each row.
    header: bool  #: Whether there is a header.
    notes: tuple[str, ...] = ()  #: What else was seen.


@dataclass(frozen=True)
class _Split:
    """Lines cut into cells in one way, and how many numbers that gives in lines of one width."""

    delimiter: str
    decimal: str
    rows: Rows
    width: int
    numbers: int


def guess_layout(path: Path) -> GuessedLayout:
    """Return how a table seems to be laid out.

    Raises:
        InputError: If no way to cut it into cells gives rows of numbers.
    """
    if is_workbook(path):
        return _of_workbook(path)
    text, encoding = _decoded(path)
    refuse_beyond("rows", text.count("\n"), where=str(path))
    lines = _first_lines(text)
    comment = _comment(lines)
    best = max(
        (_split(lines, comment, delimiter, decimal) for delimiter in _DELIMITERS for decimal in (".", ",")),
        key=lambda split: split.numbers,
    )
    if best.numbers == 0:
        raise InputError(
            "this does not look like a table: no way to cut its lines gives rows of numbers",
            where=str(path),
            allowed="lines of numbers between commas, semicolons, tabs or blanks, or an Excel workbook",
        )
    entries: dict[str, tuple[str | int, str]] = {
        "delimiter": (best.delimiter, f"it gives the most numbers, {best.numbers} in lines of {best.width} cells"),
        "decimal": ("comma" if best.decimal == "," else "point", "numbers are written so"),
    }
    if encoding != "utf-8":
        entries["encoding"] = (encoding, "it is no UTF-8 text")
    if comment is not None:
        entries["comment"] = (comment, "lines begin with it")
    behind = _lines_behind(text, lines)
    some = islice(behind, max(_MOST_LINES - len(lines), 0))
    layout = _with_header(replace(best, rows=[*best.rows, *_cut(some, comment, best.delimiter)]), entries, path)
    if next(behind, None) is None:
        return layout
    seen = f"only the first {_MOST_LINES} lines were looked at; an import refuses by its cell what does not fit below"
    return replace(layout, notes=(*layout.notes, seen))


def _lines_behind(text: str, lines: Sequence[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Return the lines behind the first ones that are not blank, with their numbers."""
    last = lines[-1][0] if lines else 0
    for number, line in islice(enumerate(lines_of(text), 1), last, None):
        if line.strip():
            yield number, line.rstrip("\r\n")


def _first_lines(text: str) -> list[tuple[int, str]]:
    """Return the first lines that are not blank, as many as are looked at, with their numbers."""
    first: list[tuple[int, str]] = []
    left = _CHARACTERS
    for number, line in enumerate(islice(lines_of(text), _LOOKED_AT), 1):
        left -= len(line)
        if left < 0 and first:
            break
        if line.strip():
            first.append((number, line.rstrip("\r\n")[:_CHARACTERS]))
    return first


def _decoded(path: Path) -> tuple[str, str]:
    content = read_bytes(path)
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        ways = ["utf-16"]
    elif (wide := wide_encoding(content)) is not None:
        ways = [wide]
    else:
        ways = ["utf-8-sig", "cp1252", "latin-1"]
    for way in ways:
        try:
            text = content.decode(way)
        except UnicodeDecodeError:
            continue
        if not text.strip():
            raise InputError("the file is empty", where=str(path), cure="Check that it was exported whole.")
        return text, way.removesuffix("-sig")
    raise InputError("this is no text", where=str(path), allowed="UTF-8, UTF-16 or Windows (cp1252) text")


def _comment(lines: Rows | list[tuple[int, str]]) -> str | None:
    """Return the sign with which some of the lines begin, but not all."""
    for sign in _COMMENTS:
        marked = sum(str(line).lstrip().startswith(sign) for _, line in lines)
        if 0 < marked < len(lines):
            return sign
    return None


def _cut(lines: Iterable[tuple[int, str]], comment: str | None, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of lines with their numbers, those of comments below zero."""
    sign = _DELIMITERS[delimiter]
    for number, line in lines:
        bare = line.lstrip()
        is_comment = comment is not None and bare.startswith(comment)
        cut = bare[len(comment or "") :] if is_comment else line
        if sign is None:
            cells = split_line(cut)
        else:
            try:
                cells = [cell.strip() for cell in next(csv.reader([cut], delimiter=sign, skipinitialspace=True), [])]
            except csv.Error:
                continue
        yield -number if is_comment else number, cells


def _split(lines: Sequence[tuple[int, str]], comment: str | None, delimiter: str, decimal: str) -> _Split:
    rows = list(_cut(lines, comment, delimiter))
    widths = Counter(len(cells) for number, cells in rows if number > 0 and _numbers(cells, decimal) >= 2)
    width, _ = max(widths.items(), key=lambda item: item[0] * item[1], default=(0, 0))
    count = sum(_numbers(cells, decimal) for number, cells in rows if number > 0 and len(cells) == width)
    return _Split(delimiter, decimal, rows, width, count)


def _numbers(cells: Sequence[str], decimal: str) -> int:
    return sum(number_of(cell, decimal) is not None for cell in cells)


def number_of(text: str, decimal: str) -> float | None:
    """Return the number that a text is with this decimal sign, None if it is none."""
    if decimal == ",":
        return None if "." in text else as_number(text.replace(",", "."))
    return as_number(text)


def _with_header(split: _Split, entries: dict[str, tuple[str | int, str]], path: Path) -> GuessedLayout:
    """Find the first line with data, and the names and units above it."""
    first_rows = split.rows[:_LOOKED_AT]
    counts = sorted(_numbers(cells, split.decimal) for n, cells in first_rows if n > 0 and len(cells) == split.width)
    enough = max(_ENOUGH, counts[len(counts) // 2] / 2)
    whole = [n > 0 and len(cells) == split.width for n, cells in first_rows]
    data = [i for i, (_, cells) in enumerate(first_rows) if whole[i] and _numbers(cells, split.decimal) >= enough]
    headed = [i for i, count in enumerate(whole[:_HEADED]) if count and _is_heading(split.rows[i][1], split.decimal)]
    place = next((i for i in data if i > max(headed, default=-1)), data[0])
    above = [
        (abs(n), cells)
        for n, cells in split.rows[:place]
        if len(cells) == split.width and _numbers(cells, split.decimal) == 0
    ]
    units = ("",) * split.width
    if above and _is_units(above[-1][1]):
        units = tuple(UNITS.get(_bare(cell), "") for cell in above.pop()[1])
    below = [(n, cells) for n, cells in split.rows[place:] if n > 0]
    rows = [(n, cells) for n, cells in below if len(cells) == split.width]
    columns = tuple(zip(*(cells for _, cells in rows), strict=True))
    other = [(n, len(cells)) for n, cells in below if len(cells) != split.width and any(cells)]
    notes: tuple[str, ...] = ()
    if other:
        more = f", and so have {len(other) - 1} lines more" if len(other) > 1 else ""
        notes = (f"line {other[0][0]} has {counted(other[0][1], 'cell')} where others have {split.width}{more}",)
    first = split.rows[place][0]
    lines = tuple(n for n, _ in rows)
    layout = GuessedLayout(entries, split.decimal, (), (), units, columns, lines, header=bool(above), notes=notes)
    numbers = tuple(str(n) for n in range(1, split.width + 1))
    if not above:
        entries["header"] = ("none", "no line of names stands above the numbers")
        if first > 1:
            entries["first_row"] = (first, "the first line of numbers")
        return replace(layout, names=numbers, headings=numbers)
    line, names = above[-1]
    upper = above[-2][1] if len(above) > 1 else [""] * split.width
    stated = [name for name in names if name]
    if len(set(stated)) < len(stated):
        entries["header"] = ("none", f"line {line} has names twice, so that columns go by number")
        entries["first_row"] = (first, "the first line of numbers")
        headings = tuple(f"{over} {name}".strip() for over, name in zip(upper, names, strict=True))
        return replace(layout, names=numbers, headings=headings)
    if any(not name and any(column) for name, column in zip(names, columns, strict=True)):
        entries["header"] = ("none", f"line {line} leaves a column without a name, so that columns go by number")
        entries["first_row"] = (first, "the first line of numbers")
        return replace(layout, names=numbers, headings=tuple(n or over for over, n in zip(upper, names, strict=True)))
    entries["header"] = (line, "the last line of names above the numbers")
    if first != line + 1:
        entries["first_row"] = (first, "the first line of numbers")
    if len(above) > 1 and sum(map(bool, above[-2][1])) > 1:
        notes = (f"line {above[-2][0]} looks like a second line of headings", *notes)
    return replace(layout, names=tuple(names), headings=tuple(names), notes=notes)


def _is_heading(cells: Sequence[str], decimal: str) -> bool:
    """Return whether a line holds names: no number, and several different texts."""
    texts = {cell for cell in cells if cell and not NOTHING.fullmatch(cell)}
    return _numbers(cells, decimal) == 0 and len(texts) >= _DIFFERENT


def _bare(text: str) -> str:
    return text.strip(" []()").strip()


def _is_units(cells: Sequence[str]) -> bool:
    units = [_bare(cell) for cell in cells if _bare(cell) not in ("", "-", "1")]
    return bool(units) and all(cell in UNITS for cell in units)


def _of_workbook(path: Path) -> GuessedLayout:
    """Return the layout of the sheet that has the most numbers, or refuse one that has more and cannot be read."""
    best: tuple[_Split, str] | None = None
    book = open_workbook(path)
    left: dict[str, tuple[int, InputError]] = {}
    for name in book.names:
        shown = texts_of(book, name, _LOOKED_AT)
        cells = _cells_below_titles(book, name, shown)
        if isinstance(cells, InputError):
            if any(map(any, shown)):
                left[name] = sum(_numbers(row, ".") for row in shown), cells
            continue
        rows: Rows = [(number, [column[row] for column in cells.columns]) for row, number in enumerate(cells.lines)]
        split = _measured(rows)
        if split.numbers and (best is None or split.numbers > best[0].numbers):
            best = split, name
    larger = max(left.values(), key=lambda candidate: candidate[0], default=None)
    if larger is not None and (best is None or larger[0] >= best[0].numbers):
        raise larger[1]
    if best is None:
        raise InputError(
            "no sheet looks like a table of numbers",
            where=str(path),
            allowed="a sheet with names above columns, and at least two cells with numbers in a row",
            cure="Write numbers as numbers: those that stand in their cells as texts, such as '12,5', are none.",
        )
    entries: dict[str, tuple[str | int, str]] = {}
    if len(book.names) > 1:
        because = f"it has the most numbers of {len(book.names)} sheets"
        entries["sheet"] = (best[1], because + (" that can be read" if left else ""))
    layout = _with_header(best[0], entries, path)
    unread = tuple(f"the sheet {name} was not read: {str(error).rstrip('.')}" for name, (_, error) in left.items())
    return replace(layout, notes=layout.notes + unread)


def _fewest(counts: Sequence[int]) -> float:
    """Return how many numbers a line of data has at least, by the numbers in all lines."""
    data = sorted(count for count in counts if count >= _ENOUGH) or [_ENOUGH]
    return max(_ENOUGH, data[len(data) // 2] / 2)


def _cells_below_titles(book: Workbook, name: str, shown: Sequence[Sequence[str]]) -> Cells | InputError:
    """Return the cells of a sheet, those below titles whose cells are merged, or why it cannot be read.

    A row with as many numbers as others is no title.
    """
    counts = [_numbers(row, ".") for row in shown]
    enough = _fewest(counts)
    refusal: InputError | None = None
    for first in range(1, _TITLES + 1):
        try:
            return sheet_cells(book, name, Layout(header=None, first_row=first), str(book.path))
        except InputError as error:
            refusal = error if refusal is None or first <= len(shown) else refusal
        if first <= len(shown) and counts[first - 1] >= enough:
            break
    assert refusal is not None
    return refusal


def _measured(rows: Rows) -> _Split:
    """Return rows of cells of a sheet, as a text that was cut; empty cells at the end are cells too."""
    width = max((len(cells) for _, cells in rows), default=0)
    numbers = [_numbers(cells, ".") for _, cells in rows]
    return _Split("", ".", rows, width, sum(count for count in numbers if count >= _ENOUGH))
