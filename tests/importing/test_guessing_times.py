"""What a guess takes for the order of measurement where a table has times."""

from __future__ import annotations

from datetime import date, time
from pathlib import Path

import pytest

import truearm


def guessed(folder: Path, heading: str, cells: list[str]) -> str:
    """Return what is guessed of a table with numbered labels in another order than its times."""
    rows = [f"P{(5 * n) % 7};{100 + n};{20 - n};{800 + n};2;{30 + n};{cell}" for n, cell in enumerate(cells, 1)]
    (folder / "table.csv").write_text("\n".join([f"label;J1;J2;X;Y;Z;{heading}", *rows]) + "\n")
    return truearm.import_guess(folder / "table.csv").text


@pytest.mark.parametrize(
    ("times", "way"),
    [
        (["04.03.26 09:00:47", "04.03.26 09:01:47"], "'%d.%m.%y %H:%M:%S'"),
        (["04.03.2026 09:00", "04.03.2026 09:05"], "'%d.%m.%Y %H:%M'"),
        (["03-Apr-2026 23:50:00", "03-Apr-2026 23:51:00"], "'%d-%b-%Y %H:%M:%S'"),
        (["04/23/2026 11:50:00 PM", "04/23/2026 11:51:00 PM"], "'%m/%d/%Y %I:%M:%S %p'"),
        (["2026/04/23 23:50:00", "2026/04/23 23:51:00"], "'%Y/%m/%d %H:%M:%S'"),
        (["23:50:00,5", "23:51:00,5"], "'%H:%M:%S,%f'"),
        (["2026-04-23T23:50:00Z", "2026-04-23T23:51:00Z"], "iso"),
    ],
)
def test_formats_of_times(tmp_path: Path, times: list[str], way: str) -> None:
    text = guessed(tmp_path, "Time", times)
    assert f"order: {{column: Time, time: {way}}}" in text
    made = truearm.import_guess(tmp_path / "table.csv").guessed
    assert (made.refusal, made.configurations) == (None, 2)


@pytest.mark.parametrize(
    ("heading", "cells"),
    [
        ("Time", ["am Dienstag", "am Mittwoch"]),
        ("Date;Time", ["03/04/2026;10:00:00", "05/02/2026;10:00:00"]),
        ("Date;Time", ["03.04.2026;23:59:30", "04.04.2026;"]),
        ("Time", ["03/04/2026 10:00:00", "05/02/2026 10:00:00"]),
        ("Date", ["03.04.2026", "04.04.2026"]),
        ("t [s]", ["12.5", "3.25"]),
    ],
)
def test_times_that_do_not_tell_the_order_are_asked_for(tmp_path: Path, heading: str, cells: list[str]) -> None:
    text = guessed(tmp_path, heading, cells)
    assert "order: '?'  # guess: " in text
    assert "by: labels" not in text
    assert f"# Not used: {heading.replace(';', ', ')}" in text
    assert "order" in truearm.import_guess(tmp_path / "table.csv").guessed.open


def test_one_day_leaves_the_order_to_its_times(tmp_path: Path) -> None:
    text = guessed(tmp_path, "Date;Time", ["03.04.2026;09:59:30", "03.04.2026;10:00:17"])
    assert "order: {column: Time, time: '%H:%M:%S'}" in text
    assert "# Not used: Date" in text


def test_a_running_time_that_rises_tells_the_order(tmp_path: Path) -> None:
    assert 'order: {column: "t [s]"}' in guessed(tmp_path, "t [s]", ["0.00", "47.25", "94.5"])


def test_a_day_and_a_time_in_two_columns_are_taken_together(tmp_path: Path) -> None:
    text = guessed(tmp_path, "Date;Time", ["03.04.2026;23:59:30", "04.04.2026;00:00:17"])
    assert "order: {columns: [Date, Time], time: '%d.%m.%Y %H:%M:%S'}  # guess: their names and their texts" in text


def test_days_of_a_workbook_and_its_times_are_taken_together(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.append(["Info", "of nothing"])
    sheet = book.create_sheet("Data")
    sheet.append(["Pose", "Day", "Clock", "J1", "J2", "X", "Y", "Z"])
    for n, day in ((1, 24), (2, 23)):
        sheet.append([f"P{n}", date(2026, 11, day), time(10, n, 5), 10.5 * n, -20 - n, 1000.5, 2 * n, 3])
    book.save(tmp_path / "table.xlsx")
    made = truearm.import_guess(tmp_path / "table.xlsx")
    assert "order: {columns: [Day, Clock], time: iso}" in made.text
    mapping = tmp_path / "map.yaml"
    mapping.write_text(made.text.replace("confirmed: no", "confirmed: yes").replace("unit: '?'", "unit: deg"))
    data = truearm.import_table(tmp_path / "table.xlsx", mapping).data
    assert data.number is not None
    assert data.number.tolist() == [1, 0]
