"""Sheets of Excel workbooks as cells that know their place, such as ``Points!B7``."""

from __future__ import annotations

import io
import warnings
import zipfile
from dataclasses import dataclass
from datetime import date, datetime, time
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from truearm.errors import InputError, did_you_mean
from truearm.files import read_bytes
from truearm.limits import refuse_beyond
from truearm.measurement.readers.cells import Cells, Layout, sheet_place

if TYPE_CHECKING:
    from openpyxl.worksheet.worksheet import Worksheet

#: Endings of workbooks that are read.
WORKBOOKS: Final = (".xlsx", ".xlsm")
#: Endings of spreadsheets that are not.
OTHER_WORKBOOKS: Final = (".xls", ".xlsb", ".ods", ".numbers")


#: What a cell without a formula holds, besides texts.
_VALUES: Final = (int, float, datetime, date, time)


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
    """A workbook, once with the values of its formulas and once with the formulas.

    Attributes
    ----------
    path
        The file.
    values, formulas
        What openpyxl made of it.
    """

    path: Path
    values: Any
    formulas: Any

    @property
    def names(self) -> list[str]:
        """Return the names of the sheets that hold cells."""
        return [sheet.title for sheet in self.values.worksheets]


def open_workbook(path: Path) -> Workbook:
    """Open a workbook, or refuse a file that is none."""
    return Workbook(path, _opened(path, formulas=False), _opened(path, formulas=True))


def read_sheet(path: Path, name: str | None, layout: Layout, entry: str) -> Cells:
    """Return the cells of a sheet of a workbook, see :func:`sheet_cells`."""
    return sheet_cells(open_workbook(path), name, layout, entry)


def sheet_cells(book: Workbook, name: str | None, layout: Layout, entry: str) -> Cells:
    """Return the cells of a sheet as texts: numbers with a decimal point, times as ISO 8601.

    Rows without any content are skipped, and so are columns behind the last one with a name.

    Parameters
    ----------
    name
        Of the sheet; None for the only one.
    layout
        Its header and first row; the rest is of texts.
    entry
        Where the name of the sheet was given, for messages.

    Raises
    ------
    InputError
        If it is no workbook, has no such sheet, a formula has no value, or cells of the table are merged.
    """
    sheet = _chosen(book, name, entry)
    source = f"{book.path}, sheet {sheet.title}"
    first = layout.first_row or (layout.header or 0) + 1
    read = (layout.header, first)
    refuse_beyond("rows", sheet.max_row, where=source)
    refuse_beyond("cells", sheet.max_row * sheet.max_column, where=source)
    _refuse_merged(sheet, source, read)
    _refuse_formulas(book.formulas[sheet.title], sheet, source, read)
    rows: list[tuple[int, list[str]]] = []
    names: list[str] | None = None
    for number, values in enumerate(sheet.iter_rows(values_only=True), 1):
        if number != layout.header and number < first:
            continue
        texts = [_text(value) for value in values]
        if number == layout.header:
            names = _without_end(texts)
            refuse_beyond("columns", len(names), where=f"{source}, line {number}")
        elif any(texts):
            rows.append((number, texts))
    if layout.header is not None and not names:
        raise InputError(
            "the line that should hold the header is empty",
            where=f"{source}, line {layout.header}",
            cure="Check the number of the header line.",
        )
    if not rows:
        raise InputError("the sheet holds no rows", where=source, cure="Check the sheet, and the line of its header.")
    if names is None:
        names = [str(number) for number in range(1, max(len(_without_end(texts)) for _, texts in rows) + 1)]
    width = len(names)
    for number, texts in rows:
        beyond = next((column for column, text in enumerate(texts) if text and column >= width), None)
        if beyond is not None:
            raise InputError(
                "this cell has no name in the header",
                where=sheet_place(source, sheet.title, number, beyond),
                came=texts[beyond],
                cure="Check the line of the header, or remove the cell.",
            )
    padded = [(texts + [""] * width)[:width] for _, texts in rows]
    return Cells(
        source=source,
        header=layout.header,
        names=tuple(names),
        lines=tuple(number for number, _ in rows),
        columns=tuple(zip(*padded, strict=True)),
        sheet=sheet.title,
    )


def _opened(path: Path, *, formulas: bool) -> Any:
    try:
        import openpyxl
    except ImportError as error:
        raise InputError(
            "workbooks are read by openpyxl, and it is not installed",
            where=str(path),
            cure='Install it with truearm: pip install "truearm[excel]". A sheet that is saved as CSV needs nothing.',
        ) from error
    content = read_bytes(path)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as parts:
            refuse_beyond("sheet_size", sum(part.file_size for part in parts.infolist()), where=str(path))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of styles and validations that it leaves out
            return openpyxl.load_workbook(io.BytesIO(content), data_only=not formulas)
    except InputError:
        raise
    except Exception as error:  # whatever a damaged part of the file leads to
        raise InputError(
            "this is no Excel workbook that can be read", where=str(path), cure="Save it again as .xlsx, or as CSV."
        ) from error


def _chosen(book: Workbook, name: str | None, entry: str) -> Worksheet:
    sheets = {sheet.title: sheet for sheet in book.values.worksheets}
    if name is None and len(sheets) == 1:
        return next(iter(sheets.values()))
    if name is None or name not in sheets:
        raise InputError(
            f"{book.path} has {'several sheets' if name is None and sheets else 'no such sheet'}",
            where=entry,
            came=name,
            allowed=", ".join(sheets) or None,
            cure=(did_you_mean(name, sheets) if name else None) or "Name the sheet under layout.sheet in the mapping.",
        )
    return sheets[name]


def _refuse_merged(sheet: Worksheet, source: str, read: tuple[int | None, int]) -> None:
    """Refuse cells that are merged, in the header or below: which column or row they belong to is not said."""
    header, first = read
    for merged in sheet.merged_cells.ranges:
        if merged.max_row >= first or (header is not None and merged.min_row <= header <= merged.max_row):
            place = sheet_place(source, sheet.title, merged.min_row, merged.min_col - 1)
            raise InputError(
                "these cells are merged",
                where=place,
                came=str(merged.coord),
                allowed="one line of headings, and one cell for each value",
                cure="Split the cells, and write each value into its own; or name another header line.",
            )


def _refuse_formulas(formulas: Worksheet, values: Worksheet, source: str, read: tuple[int | None, int]) -> None:
    """Refuse a formula whose value the file does not hold: the program that wrote it has not computed it."""
    header, first = read
    for number, row in enumerate(formulas.iter_rows(values_only=True), 1):
        if number < first and number != header:
            continue
        for column, value in enumerate(row, 1):
            if value is None or isinstance(value, _VALUES) or (isinstance(value, str) and not value.startswith("=")):
                continue
            has_formula = formulas.cell(number, column).data_type == "f"
            if has_formula and values.cell(number, column).value is None:
                raise InputError(
                    "the formula has no value in the file",
                    where=sheet_place(source, values.title, number, column - 1),
                    came=value[:80] if isinstance(value, str) else None,
                    allowed="a value, or a formula that was computed before the file was saved",
                    cure="Open the workbook in Excel or LibreOffice and save it, or paste the values.",
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
