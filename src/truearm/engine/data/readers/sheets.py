"""Sheets of Excel workbooks as cells that know their place, and columns of small tables by their names."""

from __future__ import annotations

import io
import re
import warnings
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, replace
from datetime import date, datetime, time
from pathlib import Path
from typing import Any, Final

from truearm.engine.base.errors import InputError, did_you_mean, nearest_names
from truearm.engine.base.files import read_bytes, read_text
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.data.readers.canonical import refuse_other_separators
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells, sheet_place
from truearm.engine.data.readers.configurations import stops_in
from truearm.engine.data.readers.rows import Configurations, row_configurations
from truearm.engine.robot.urdf_writing import JOINT_COLUMN, joint_names

#: Endings of workbooks that are read.
WORKBOOKS: Final = (".xlsx", ".xlsm")
#: Endings of spreadsheets that are not.
OTHER_WORKBOOKS: Final = (".xls", ".xlsb", ".ods", ".numbers")


_ROW: Final = re.compile(rb"<(?:\w+:)?row\b[^>]*?\sr\s*=\s*[\"']([^\"']*)")
_CELL: Final = re.compile(rb"<(?:\w+:)?c\b[^>]*?\sr\s*=\s*[\"']([^\"']*)")
_MERGED: Final = re.compile(rb"<(?:\w+:)?mergeCell\b[^>]*?\sref\s*=\s*[\"']([^\"']*)")
#: A number of so many digits is no number of a row.
_DIGITS: Final = 10
_CORNER: Final = re.compile("([A-Z]{1,3})([0-9]{1,9})")


def is_workbook(path: Path) -> bool:
    """Return whether a file is a workbook by its ending, or refuse one that cannot be read."""
    ending = path.suffix.lower()
    if ending in OTHER_WORKBOOKS:
        raise InputError(
            "workbooks of this kind are not read",
            where=str(path),
            came=ending,
            allowed=" or ".join(WORKBOOKS),
            cure="Save it as an Excel workbook (.xlsx), or as CSV.",
        )
    return ending in WORKBOOKS


@dataclass(frozen=True)
class Workbook:
    """A workbook, once with the values of its formulas and once with the formulas."""

    path: Path  #: The file.
    values: Any  #: values, formulas: what openpyxl made of it; both read their sheets when they are asked for.
    formulas: Any

    @property
    def names(self) -> list[str]:
        """Return the names of the sheets that hold cells."""
        return [sheet.title for sheet in self.values.worksheets]


def open_workbook(path: Path) -> Workbook:
    """Open a workbook, or refuse a file that is none."""
    try:
        import openpyxl
    except ImportError as error:
        raise InputError(
            "workbooks are read by openpyxl, and it is not installed",
            where=str(path),
            cure='Install it with truearm: pip install "truearm[excel]". A sheet that is saved as CSV needs nothing.',
        ) from error
    content = read_bytes(path)
    with _readable(path):
        with zipfile.ZipFile(io.BytesIO(content)) as parts:
            refuse_beyond("sheet_size", sum(part.file_size for part in parts.infolist()), where=str(path))
        values, formulas = (
            openpyxl.load_workbook(io.BytesIO(content), read_only=True, data_only=data_only)
            for data_only in (True, False)
        )
    return Workbook(path, values, formulas)


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Refuse what openpyxl cannot read, whatever it is that it stumbles upon."""
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()):  # it prints what is wrong with styles
            warnings.simplefilter("ignore")  # of styles and validations that it leaves out
            yield
    except InputError:
        raise
    except Exception as error:  # whatever a damaged part of the file leads to
        raise InputError(
            "this is no Excel workbook that can be read", where=str(path), cure="Save it again as .xlsx, or as CSV."
        ) from error


def texts_of(book: Workbook, title: str, most: int) -> list[list[str]]:
    """Return the first rows of a sheet as texts, whatever :func:`sheet_cells` would refuse in them."""
    with _readable(book.path):
        sheet = book.values[title]
        sheet.reset_dimensions()
        return [[_text(value) for value in row] for row in sheet.iter_rows(max_row=most, values_only=True)]


def read_sheet(path: Path, name: str | None, layout: Layout, entry: str) -> Cells:
    """Return the cells of a sheet of a workbook, see :func:`sheet_cells`."""
    return sheet_cells(open_workbook(path), name, layout, entry)


def sheet_cells(book: Workbook, name: str | None, layout: Layout, entry: str) -> Cells:
    """Return the cells of a sheet as texts: numbers with a decimal point, times as ISO 8601.

    Rows without any content are skipped, and so are columns behind the last one with a name.

    Args:
        name: Of the sheet; None for the only one.
        layout: Its header and first row; the rest is of texts.
        entry: Where the name of the sheet was given, for messages.

    Raises:
        InputError: If it is no workbook, has no such sheet, a formula has no value, or cells of the table are merged.
    """
    title = _chosen(book, name, entry)
    with _readable(book.path):
        rows = list(_rows(book, title, layout))
    source = f"{book.path}, sheet {title}"
    names: list[str] | None = None
    if layout.header is not None:
        names = _without_end(rows.pop(0)[1]) if rows and rows[0][0] == layout.header else []
        refuse_beyond("columns", len(names), where=f"{source}, line {layout.header}")
        if not names:
            raise InputError(
                "the line that should hold the header is empty",
                where=f"{source}, line {layout.header}",
                cure="Check the number of the header line.",
            )
    if not rows:
        raise InputError("the sheet holds no rows", where=source, cure="Check the sheet, and the line of its header.")
    if names is None:
        names = [str(number) for number in range(1, max(len(texts) for _, texts in rows) + 1)]
    width = len(names)
    for number, texts in rows:
        beyond = next((column for column, text in enumerate(texts) if text and column >= width), None)
        if beyond is not None:
            raise InputError(
                "this cell has no name in the header",
                where=sheet_place(source, title, number, beyond),
                came=texts[beyond],
                cure="Check the line of the header, or remove the cell.",
            )
    refuse_beyond("cells", width * len(rows), where=source)
    padded = [(texts + [""] * width)[:width] for _, texts in rows]
    return Cells(
        source=source,
        header=layout.header,
        names=tuple(names),
        lines=tuple(number for number, _ in rows),
        columns=tuple(zip(*padded, strict=True)),
        sheet=title,
    )


def _chosen(book: Workbook, name: str | None, entry: str) -> str:
    names = book.names
    if name is None and len(names) == 1:
        return names[0]
    if name is None or name not in names:
        raise InputError(
            f"{book.path} has {'several sheets' if name is None and names else 'no such sheet'}",
            where=entry,
            came=name,
            allowed=", ".join(names) or None,
            cure=(did_you_mean(name, names) if name else None) or "Name the sheet under layout.sheet in the mapping.",
        )
    return name


def _rows(book: Workbook, title: str, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a sheet that hold anything, the header first, with their numbers; no text ends with nothing."""
    source = f"{book.path}, sheet {title}"
    first = layout.first_row or (layout.header or 0) + 1
    values, formulas = book.values[title], book.formulas[title]
    _refuse_merged(_checked(values, source), source, title, layout.header, first)
    for sheet in (values, formulas):
        sheet.reset_dimensions()  # programs write wrong ones
    seen = 0
    pairs = zip(values.iter_rows(values_only=True), formulas.iter_rows(), strict=True)
    for number, (row, cells) in enumerate(pairs, 1):
        seen += 1 + len(row)
        refuse_beyond("cells", seen, where=f"{source}, line {number}")
        if number < first and number != layout.header:
            continue
        for column, (value, cell) in enumerate(zip(row, cells, strict=True)):
            if value is None and cell.data_type == "f":
                raise InputError(
                    "the formula has no value in the file",
                    where=sheet_place(source, title, number, column),
                    came=cell.value[:80] if isinstance(cell.value, str) else None,
                    allowed="a value, or a formula that was computed before the file was saved",
                    cure="Open the workbook in Excel or LibreOffice and save it, or paste the values.",
                )
        texts = _without_end([_text(value) for value in row])
        if texts:
            yield number, texts


def _checked(sheet: Any, source: str) -> list[tuple[str, int, int, int]]:
    """Return the merged ranges of a sheet, each with its first row, last row and first column.

    Refused are rows and cells in another order than that of the sheet, of which openpyxl would leave out some.
    """
    with sheet._get_source() as part:  # neither merged cells nor the order are told otherwise without loading it whole
        xml = part.read()
    row = 0
    for match in _ROW.finditer(xml):
        number = int(match[1]) if match[1].isdigit() and len(match[1]) < _DIGITS else 0
        refuse_beyond("rows", number, where=source)
        if number <= row:
            raise ValueError("rows are not in order")
        row = number
    at = (0, 0)
    for match in _CELL.finditer(xml):
        corner = _CORNER.fullmatch(match[1].decode())
        position = (0, 0) if corner is None else (int(corner[2]), _column(corner[1]))
        if position <= at:
            raise ValueError("cells are not in order")
        at = position
    merged = []
    for match in _MERGED.finditer(xml):
        corners = [_CORNER.fullmatch(corner) for corner in match[1].decode().split(":")]
        if len(corners) == 2 and corners[0] and corners[1]:
            rows = sorted(int(corner[2]) for corner in corners if corner)
            merged.append((match[1].decode(), rows[0], rows[1], _column(corners[0][1])))
    return merged


def _column(letters: str) -> int:
    number = 0
    for letter in letters:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number


def _refuse_merged(
    merged: list[tuple[str, int, int, int]], source: str, title: str, header: int | None, first: int
) -> None:
    """Refuse cells that are merged, in the header or below: which column or row they belong to is not said."""
    for shown, top, bottom, left in merged:
        if bottom >= first or (header is not None and top <= header <= bottom):
            raise InputError(
                "these cells are merged",
                where=sheet_place(source, title, top, left - 1),
                came=shown,
                allowed="one line of headings, and one cell for each value",
                cure="Split the cells, and write each value into its own; or name another header line.",
            )


def _text(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if isinstance(value, float):
        return repr(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime):
        return value.isoformat(sep=" ")
    if isinstance(value, date | time):
        return value.isoformat()
    return str(value).strip()


def _without_end(texts: list[str]) -> list[str]:
    """Return texts without the empty ones at the end."""
    last = max((place for place, text in enumerate(texts) if text), default=-1)
    return texts[: last + 1]


_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
#: So alike a name that is not known must be for another to be offered: "note" is no "pose".
_ALIKE: Final = 0.6
_JOINTS: Final = "joint_1 [deg] .. or axis_1 [deg] .."

Columns = dict[str, tuple[int, str]]


def read_named(path: Path) -> Cells:
    """Return the cells of a CSV with a header."""
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    return read_cells(text, str(path), Layout(header=header))


def columns_beside_joints(
    cells: Cells, shown: Mapping[str, str], units: Mapping[str, tuple[str, ...]], optional: Sequence[str] = ()
) -> Columns:
    """Return place and unit of every column by its name, joint positions among them, or refuse the header.

    Args:
        shown: The columns besides joint positions, as one writes them.
        units: The units of those that need one.
        optional: Those that may be left out.
    """
    columns = _columns_of(cells, shown, units, _JOINTS)
    joint_names(columns, f"{cells.source}, line {cells.header}")
    return _complete(cells, columns, shown, optional, _JOINTS)


def named_columns(
    cells: Cells, shown: Mapping[str, str], units: Mapping[str, tuple[str, ...]], optional: Sequence[str] = ()
) -> Columns:
    """Return place and unit of every column by its name in a table without joint positions, or refuse the header.

    Args:
        shown, units, optional: As for :func:`columns_beside_joints`.
    """
    return _complete(cells, _columns_of(cells, shown, units), shown, optional)


def _columns_of(cells: Cells, shown: Mapping[str, str], units: Mapping[str, tuple[str, ...]], *more: str) -> Columns:
    columns: Columns = {}
    header = f"{cells.source}, line {cells.header}"
    allowed = ", ".join([*shown.values(), *more])
    for place, heading in enumerate(cells.names):
        where = f"{header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        fitting = (*ANGLE_UNITS, *LENGTH_UNITS) if more and JOINT_COLUMN.fullmatch(name) else units.get(name)
        if name == SIMULATED:  # every table of measurements may have it, and none needs it
            continue
        if fitting is None and name not in shown:
            near = nearest_names(name, shown, 1, _ALIKE)
            raise InputError(
                "the column is not known" if heading else "the column has no name",
                where=where,
                came=heading or None,
                allowed=allowed,
                cure=f"Did you mean {shown[near[0]]}?" if near else "Rename it, or leave it out.",
            )
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, came=heading, cure="Remove one of them.")
        if fitting is not None:
            unit = checked_unit(unit, fitting, f"{where}, {heading}")
        elif unit is not None:
            raise InputError(
                "this column takes no unit", where=where, came=heading, allowed=name, cure="Remove the unit."
            )
        columns[name] = (place, unit or "1")
    return columns


def _complete(cells: Cells, columns: Columns, shown: Mapping[str, str], optional: Sequence[str], *more: str) -> Columns:
    """Return columns if none is missing that may not be."""
    for name in shown:
        if name not in columns and name not in optional:
            raise InputError(
                f"the column {name} is missing",
                where=f"{cells.source}, line {cells.header}",
                allowed=", ".join([*shown.values(), *more]),
                cure=f"Add {shown[name]}.",
            )
    return columns


def configurations_of(cells: Cells, columns: Columns) -> Configurations:
    """Return the configurations of a table whose column ``configuration`` names them."""
    joints_are, names = joint_names(columns, f"{cells.source}, line {cells.header}")
    joints = [columns[name] for name in names]
    labels = cells.texts(columns["configuration"][0])
    return row_configurations(cells, labels, [place for place, _ in joints], [unit for _, unit in joints], joints_are)


def joints_in_file(path: Path) -> tuple[Cells, Configurations]:
    """Return the configurations of a CSV with the columns of the canonical CSV for them, whatever else it holds.

    These are ``configuration`` and ``joint_1 [deg]`` .. or ``axis_1 [deg]`` ..: a canonical CSV, a plan, or what the
    controller wrote.
    """
    cells = read_sheet(path, None, Layout(), str(path)) if is_workbook(path) else read_named(path)
    where = f"{cells.source}, line {cells.header}"
    columns: Columns = {}
    for place, heading in enumerate(cells.names):
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        if name != "configuration" and not JOINT_COLUMN.fullmatch(name):
            continue
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=where, came=heading, cure="Remove one of them.")
        if name != "configuration":
            unit = checked_unit(unit, (*ANGLE_UNITS, *LENGTH_UNITS), f"{where}, column {place + 1}, {heading}")
        columns[name] = (place, unit or "1")
    joint_names(columns, where)
    if "configuration" not in columns:
        raise InputError(
            "the column configuration is missing",
            where=where,
            allowed=f"configuration, {_JOINTS}",
            cure="Add it: it holds the labels that the measurements name.",
        )
    configurations = configurations_of(cells, columns)
    return cells, replace(configurations, before=stops_in(cells, configurations))


def refuse_repeated(cells: Cells, configurations: Configurations, cure: str) -> None:
    """Refuse a configuration that has more rows than one."""
    first: dict[int, int] = {}
    for row, of in enumerate(configurations.of_row.tolist()):
        if (before := first.setdefault(of, row)) != row:
            raise InputError(
                f"the configuration {configurations.labels[of]!r} appears twice",
                where=f"{cells.source}, lines {cells.lines[before]} and {cells.lines[row]}",
                cure=cure,
            )
