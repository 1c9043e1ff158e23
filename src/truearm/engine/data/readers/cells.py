"""Delimited text as a grid of cells that know their line and column.

Everything that reads a table of measurements reads it through this module, so that a refusal always names the
file, the line and the column.
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, is_one_line
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.base.units import YES, as_number, sized_si
from truearm.engine.robot.chain import Array

#: A number with a decimal comma.
WITH_COMMA: Final = re.compile(r"[+-]?[0-9]*,[0-9]+(?:[eE][+-]?[0-9]+)?")
#: Makes a decimal comma a point, and a point what is no part of a number.
_SWAPPED: Final = str.maketrans(".,", ",.")
_LINE: Final = re.compile(r"[^\r\n]*+(?:\r\n?|\n)|[^\r\n]++")
_NOT_FINITE: Final = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)


@dataclass(frozen=True)
class Layout:
    """How the text of a table is laid out."""

    delimiter: str | None = ","  #: The character between two cells; None for any run of blanks.
    decimal: str = "."  #: The decimal sign, ``.`` or ``,``.
    #: Line that holds the column names, counted from 1; None if there is none and columns go by number.
    header: int | None = 1
    first_row: int | None = None  #: First line that may hold data; None for the one after the header.
    comment: str | None = None  #: Lines that begin with this text are skipped; None if there are no comments.


@dataclass(frozen=True)
class Cells:
    """The cells of a table, column by column, without the blanks around them."""

    source: str  #: The file, for messages.
    header: int | None  #: Line of the column names; None if there is none.
    names: tuple[str, ...]  #: Name of each column as the file has it; its number if there is no header.
    lines: tuple[int, ...]  #: Line of each row.
    columns: tuple[tuple[str, ...], ...]  #: The cells, ``columns[column][row]``.
    decimal: str = "."  #: The decimal sign.
    #: Texts that mean that nothing was measured, besides an empty cell; None where a file can name none.
    absent: tuple[str, ...] | None = None
    sheet: str | None = None  #: Sheet of a workbook that they come from; None for a text.

    def some(self, selected: Sequence[bool]) -> Cells:
        """Return some of the rows."""
        return replace(
            self,
            lines=tuple(compress(self.lines, selected)),
            columns=tuple(tuple(compress(column, selected)) for column in self.columns),
        )

    @property
    def simulated(self) -> bool:
        """Whether a virtual instrument read any of the rows, as a column of its own says."""
        marks = [column for name, column in zip(self.names, self.columns, strict=True) if name == SIMULATED]
        return any(cell.lower() == YES for column in marks for cell in column)

    def place(self, row: int, column: int) -> str:
        """Return the file, line and column of a cell, or the file and its place in a sheet, for messages."""
        if self.sheet is not None:
            return sheet_place(self.source, self.sheet, self.lines[row], column)
        return f"{self.source}, line {self.lines[row]}, column {self.names[column]}"

    def texts(self, column: int, *, missing: bool = False) -> tuple[str, ...]:
        """Return a column of texts, one line each, none of them empty unless they may be `missing`."""
        cells = self.columns[column]
        if "" in cells and not missing:
            raise InputError(
                "the cell is empty",
                where=self.place(cells.index(""), column),
                allowed="any text",
                cure="Only readings may be missing: fill the cell, or remove the row.",
            )
        for text in dict.fromkeys(cells):
            if text and not is_one_line(text):
                raise InputError(
                    "the text has a line break or another control character",
                    where=self.place(cells.index(text), column),
                    came=text,
                    allowed="text on one line",
                    cure="Check for a quote that is opened and not closed, or rename it.",
                )
        return cells

    def numbers(self, column: int, unit: str, *, missing: bool = False, deviation: bool = False) -> Array:
        """Return a column of numbers in SI units [m, rad or 1], ``(rows,)``.

        Args:
            column: Which one.
            unit: The unit of the column.
            missing: Whether a cell may be empty; it is then NaN.
            deviation: Whether they are standard deviations, all of them above zero.
        """
        cells = self.columns[column]
        if self.decimal == ",":
            cells = tuple(cell.translate(_SWAPPED) for cell in cells)
        parsed = {"": math.nan, **dict.fromkeys(self._absent, math.nan)} if missing else {}
        for row, cell in enumerate(cells):
            if cell in parsed:
                continue
            value, where, came = as_number(cell), self.place(row, column), self.columns[column][row]
            if value is None:
                raise self._not_a_number(row, column, missing=missing)
            if deviation and value <= 0:
                raise InputError(
                    "a standard deviation must be above zero",
                    where=where,
                    came=came,
                    allowed="a number above 0, or nothing",
                    cure="Write the standard deviation of the instrument, or leave the whole column out.",
                )
            parsed[cell] = sized_si(value, unit, where, came=came, deviation=deviation)
        return np.array([parsed[cell] for cell in cells])

    @property
    def _absent(self) -> tuple[str, ...]:
        """Return the texts that mean nothing, as numbers are compared."""
        texts = self.absent or ()
        return tuple(text.translate(_SWAPPED) for text in texts) if self.decimal == "," else texts

    def values(self, column: int) -> Array:
        """Return a column of numbers of any size without a unit, ``(rows,)``, NaN where nothing is."""
        swapped = (cell.translate(_SWAPPED) if self.decimal == "," else cell for cell in self.columns[column])
        numbers = [math.nan if cell in ("", *self._absent) else as_number(cell) for cell in swapped]
        if None in numbers:
            raise self._not_a_number(numbers.index(None), column, missing=True)
        return np.array(numbers, dtype=float)

    def _not_a_number(self, row: int, column: int, *, missing: bool) -> InputError:
        cell, where = self.columns[column][row], self.place(row, column)
        if self.decimal == "," and as_number(cell.replace(".", "").replace(",", ".")) is not None:
            return InputError(
                "the number has a point, and this file has decimal commas",
                where=where,
                came=cell,
                allowed="a number with a decimal comma and no thousands separator",
                cure="Remove the thousands separators, or name the other decimal sign."
                if self.absent is None
                else "Say decimal: point in the mapping, or remove the thousands separators.",
            )
        if not cell:
            return InputError(
                "the cell is empty",
                where=where,
                allowed="a number",
                cure="Only readings may be missing: fill the cell, or remove the row.",
            )
        allowed = "a finite number, or nothing" if missing else "a finite number"
        if _NOT_FINITE.fullmatch(cell):
            what = "NaN and infinity are not readings"
            cure = "Leave the cell empty where there is no reading." if missing else "Fill in the number."
            if missing and self.absent is not None:
                cure = "Name this text under missing in the mapping if it means that nothing was measured."
        elif self.decimal == "." and WITH_COMMA.fullmatch(cell):
            what = "the number has a decimal comma"
            cure = "Write a decimal point, or import the file with `truearm import table` and decimal: comma."
        else:
            what, cure = "a number belongs here", "Correct the cell."
            if missing and self.absent is not None:
                cure = "Correct the cell, or name its text under missing in the mapping if nothing was measured there."
        return InputError(what, where=where, came=cell, allowed=allowed, cure=cure)


def sheet_place(source: str, sheet: str, row: int, column: int) -> str:
    """Return the file and the place of a cell as spreadsheets show it, such as ``Points!B7``.

    Args:
        source: The file, with or without its sheet.
        row, column: The row counted from 1, the column counted from 0.
    """
    name = sheet if re.fullmatch(r"\w+", sheet) else f"'{sheet}'"
    return f"{source.removesuffix(f', sheet {sheet}')}, {name}!{column_letters(column)}{row}"


def column_letters(column: int) -> str:
    """Return the letters of a column that is counted from 0: A, B, .. Z, AA, AB."""
    letters = ""
    while column >= 0:
        letters = chr(ord("A") + column % 26) + letters
        column = column // 26 - 1
    return letters


def read_cells(text: str, source: str, layout: Layout) -> Cells:
    """Split the text of a table into cells.

    Blank lines and comment lines are skipped; all other lines must have as many cells as the header, or as
    the first row where there is no header.
    """
    refuse_long(text, source, layout.delimiter)
    records = _records(text, source, layout)
    first = next(records, None)
    if first is None:
        raise _no_header(source, layout.header)
    if layout.header is None:
        names = tuple(str(number) for number in range(1, len(first[1]) + 1))
        rows = [first]
    else:
        names = tuple(first[1])
        rows = []
    refuse_beyond("columns", len(names), where=f"{source}, line {first[0]}")
    most = limit("cells") // len(names)
    for record in records:
        rows.append(record)
        if len(rows) > most:
            refuse_beyond("cells", len(rows) * len(names), where=f"{source}, line {record[0]}")
    if not rows:
        raise InputError("the file holds a header and no rows", where=source, cure="Check that it was exported whole.")
    for line, row in rows:
        if len(row) != len(names):
            raise _ragged(f"{source}, line {line}", row, names, layout)
    return Cells(
        source=source,
        header=None if layout.header is None else first[0],
        names=names,
        lines=tuple(line for line, _ in rows),
        columns=tuple(zip(*(row for _, row in rows), strict=True)),
        decimal=layout.decimal,
    )


def refuse_long(text: str, source: str, delimiter: str | None) -> None:
    """Refuse the text of a table that has too many lines, or too many cells as far as its delimiters tell."""
    refuse_beyond("rows", text.count("\n") + text.count("\r") - text.count("\r\n"), where=source)
    if delimiter is not None:
        refuse_beyond("cells", text.count(delimiter), where=source)


def lines_of(text: str) -> Iterator[str]:
    """Yield lines with what ends them: unlike those of `str.splitlines` not at a form feed and its like."""
    return (match[0] for match in _LINE.finditer(text))


def split_line(line: str) -> list[str]:
    """Return what blanks separate in a line; of a line that is far too long more pieces than there may be columns."""
    return line.split(maxsplit=limit("columns"))


def _no_header(source: str, line: int | None) -> InputError:
    return InputError(
        "the file holds no rows" if line is None else "the line that should hold the header is empty",
        where=source if line is None else f"{source}, line {line}",
        cure="Check the number of the header line, and the text that marks comments.",
    )


def _ragged(where: str, row: Sequence[str], names: Sequence[str], layout: Layout) -> InputError:
    """Refuse a row by the first cell that has no column, or the first column that has no cell."""
    came, wanted = len(row), len(names)
    if came < wanted:
        where += f", column {names[came]}"
        cure = "The row ends before this column: check for a missing cell."
    else:
        where += f", cell {wanted + 1}"
        if layout.delimiter is None:
            cure = "A name with blanks in it is split: export the file with another separator."
        elif layout.delimiter == ",":
            cure = "Check for decimal commas, or for a comma in a name without quotes around it."
        else:
            cure = "Check for a separator inside a name without quotes around it."
    what = f"the row does not have as many cells as {'the first row' if layout.header is None else 'the header'}"
    return InputError(what, where=where, came=f"{came} cells", allowed=f"{wanted} cells", cure=cure)


def _opened_quote(lines: Sequence[tuple[int, str]], delimiter: str) -> str:
    """Return the line and the cell in which a quote is opened that is never closed, as far as it can be told."""
    for number, line in lines:
        inside, cell, start, opened, before = False, 1, True, 1, ""
        for sign in line:
            doubled = sign == before == '"'  # a quote inside of a quoted cell
            before = sign
            if sign == '"' and (inside or start or doubled):
                inside, opened = not inside, cell
            elif sign == delimiter and not inside:
                cell, start = cell + 1, True
                continue
            start = start and sign in " \t"
        if inside:
            return f"line {number}, cell {opened}"
    return f"line {lines[-1][0] if lines else 1}"


def _records(text: str, source: str, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield the line number and the cells of each line that is neither blank nor a comment."""
    current = 0
    record: list[tuple[int, str]] = []
    start = layout.first_row or (layout.header or 0) + 1

    def lines() -> Iterator[str]:
        nonlocal current
        for number, line in enumerate(lines_of(text), 1):
            is_comment = layout.comment is not None and line.lstrip().startswith(layout.comment)
            if number == layout.header:
                current = number
                heading = line.lstrip().removeprefix(layout.comment or "") if is_comment else line
                if not heading.strip():
                    raise _no_header(source, number)
                record.append((number, heading))
                yield heading
            elif number >= start and not is_comment:
                current = number
                record.append((number, line))
                yield line

    if layout.delimiter is None:
        yield from ((current, cells) for line in lines() if (cells := split_line(line)))
        return
    reader = csv.reader(lines(), delimiter=layout.delimiter, skipinitialspace=True, strict=True)
    try:
        for row in reader:
            record.clear()
            cells = [cell.strip() for cell in row]
            if len(cells) > 1 or (cells and cells[0]):
                yield current, cells
    except csv.Error as error:
        where = f"{source}, {_opened_quote(record, layout.delimiter)}"
        if "field larger" in str(error):
            raise InputError(
                "a cell is too long",
                where=where,
                allowed=f"{csv.field_size_limit()} characters",
                cure="Check for a quote that is opened and not closed.",
            ) from error
        raise InputError(
            f"the quotes do not fit together ({error})",
            where=where,
            cure="Close every quote, and write a quote inside a quoted cell twice.",
        ) from error
