"""Measurements from circles that the robot drew with a pencil."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from truearm.arrays import finite_number
from truearm.errors import InputError, refusals_of
from truearm.jobs.arguments import deviation_argument, file_for, files_argument, numbers_argument
from truearm.measurement.readers.canonical import csv_text
from truearm.measurement.readers.drawn_circles import Page, read_drawn_circles
from truearm.results.imported import ImportedCircles
from truearm.writing import write_text


def import_circle(
    scans: Mapping[str, str | Path],
    points: Mapping[str, str | Path],
    *,
    dpi: float | Sequence[float] | None = None,
    sigma: float | None = None,
    out: str | Path | None = None,
) -> ImportedCircles:
    """Read circles that the robot drew with a pencil, from scanned pages and the potentiometer's readings.

    Parameters
    ----------
    scans
        Image of each page, by the name of the page.
    points
        CSV of joints, angle and height that were read while it was drawn, by the same names.
    dpi
        Dots per inch of the scans, one number or those along x and y; None for what the files say.
    sigma
        Standard deviation of radius and height [m]; None declares none.
    out
        Canonical CSV file to write; None writes nothing.

    Raises
    ------
    InputError
        If a page shows no circle, or a file cannot be used.
    """
    images, tables = files_argument(scans, "scans"), files_argument(points, "points")
    if not images:
        raise InputError("no page is given", parameter="scans", cure="Give at least one.")
    for name in (*images, *tables):
        if name not in images or name not in tables:
            raise InputError(
                "every page needs a scan and a table",
                parameter="points" if name in images else "scans",
                came=f"nothing for {name}",
                allowed="the same names in `scans` and `points`",
            )
    file = None if out is None else file_for(out, *images.values(), *tables.values())
    deviation = None if sigma is None else deviation_argument(sigma, "sigma")
    pages = {name: Page(images[name], tables[name]) for name in images}
    with refusals_of("scans, points"):
        data = read_drawn_circles(pages, _resolution(dpi), deviation)
    if file is not None:
        write_text(file, csv_text(data))
    return ImportedCircles(data, tuple(pages), file)


def _resolution(dpi: float | Sequence[float] | None) -> float | tuple[float, float] | None:
    """Return dots per inch, one number or two."""
    if dpi is None or not isinstance(dpi, Sequence) or isinstance(dpi, str):
        return None if dpi is None else finite_number(dpi, "dpi", allowed="a number above zero, or two")
    along, across = numbers_argument(dpi, "dpi", 2, "a number above zero, or two")
    return along, across
