"""Measurements from circles that the robot drew: scanned pages, and tables of what was read on the way round."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truearm.drawn_circle.scan import DrawnCircle, drawn_circle, read_circle
from truearm.engine.base.errors import InputError, refusals_of
from truearm.engine.base.files import read_text
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit
from truearm.engine.base.writing import write_text
from truearm.engine.command.arguments import file_for
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import csv_text, refuse_other_separators
from truearm.engine.data.readers.cells import Cells, Layout, read_cells
from truearm.engine.data.readers.rows import Configurations, in_order, row_configurations
from truearm.engine.document.records import ImportedCircles
from truearm.engine.robot.urdf_writing import joint_names

if TYPE_CHECKING:
    from truearm.drawn_circle.import_circle import ImportCircle

_HEADING: Final = re.compile(r"(configuration|(?:joint|axis)_[1-9][0-9]{0,3}|angle|height)\s*(?:\[([^\]]*)\])?")
_ALLOWED: Final = "configuration, joint_1 [deg] .. or axis_1 [deg] .., angle [deg], height [mm]"
#: How well the middle of a circle lies in its paper [m].
_PAPER_DEVIATION: Final = 1e-5


@dataclass(frozen=True)
class Page:
    """A page and what was read while the circle on it was drawn."""

    scan: Path  #: Image of the page.
    #: CSV with the columns ``configuration``, ``joint_1 [deg]`` .. (or ``axis_1 [deg]`` .., as the controller shows
    #: them), ``angle [deg]`` on the page and ``height [mm]`` over it.
    points: Path


def read_drawn_circles(
    pages: Mapping[str, Page], dpi: float | tuple[float, float] | None = None, sigma: float | None = None
) -> Dataset:
    """Read drawn circles as distances from their centres and heights over their papers.

    Args:
        pages: By name.
        dpi: Resolution of the scans, or that along x and that along y; what the files say if None.
        sigma: Standard deviation of radius and height [m]; nothing is declared if None.

    Returns:
        Dataset: Its target is the tip of the ``pencil``; fixtures are the points ``centre_NAME`` and the planes
            ``paper_NAME``, and the one lies in the other. A gap in the line is a missing distance.

    Raises:
        InputError: If a page shows no circle, a table cannot be used, or two pages have a configuration of the same
            name.
    """
    drawn = {name: _page(page, dpi) for name, page in pages.items()}
    _refuse_twice(pages, drawn)
    labels = tuple(label for configurations, _ in drawn.values() for label in configurations.labels)
    joints = np.concatenate([configurations.joints for configurations, _ in drawn.values()])
    each = [len(configurations.labels) for configurations, _ in drawn.values()]
    distance = np.concatenate([circle.distance for _, circle in drawn.values()])
    height = np.concatenate([circle.height for _, circle in drawn.values()])
    page, none = np.repeat(np.arange(len(pages)), each), np.full(len(labels), np.nan)
    rows = np.argsort(np.tile(np.arange(len(labels)), 2), kind="stable")
    centres, papers = (tuple(f"{kind}_{name}" for name in pages) for kind in ("centre", "paper"))
    kinds, joints_are = next(iter(drawn.values()))[0].kinds, next(iter(drawn.values()))[0].joints_are
    data = Dataset(
        source=" and ".join(str(page_of_circle.points) for page_of_circle in pages.values()),
        labels=labels,
        joints=joints,
        joint_kinds=kinds,
        joints_are=joints_are,
        targets=("pencil",),
        configuration=np.tile(np.arange(len(labels)), 2)[rows],
        target=np.zeros(2 * len(labels), dtype=np.intp),
        position=np.full((2 * len(labels), 3), np.nan),
        distance=np.concatenate([distance, none])[rows],
        height=np.concatenate([none, height])[rows],
        fixtures=(*centres, *papers),
        fixture=np.concatenate([page, len(pages) + page])[rows],
        sigma=None if sigma is None else np.full(2 * len(labels), sigma),
    )
    known = Dataset(
        source=data.source,
        labels=("",),
        joints=np.zeros((1, joints.shape[1])),
        joint_kinds=kinds,
        targets=centres,
        configuration=np.zeros(len(pages), dtype=np.intp),
        target=np.arange(len(pages)),
        position=np.full((len(pages), 3), np.nan),
        height=np.zeros(len(pages)),
        fixtures=data.fixtures,
        fixture=len(pages) + np.arange(len(pages)),
        sigma=np.full(len(pages), _PAPER_DEVIATION),
    )
    return in_order(replace(data, setup=known))


def _page(page: Page, dpi: float | tuple[float, float] | None) -> tuple[Configurations, DrawnCircle]:
    """Return the configurations of a page, and what was drawn in them."""
    text = read_text(page.points)
    refuse_other_separators(text, f"{page.points}, line 1")
    cells = read_cells(text, str(page.points), Layout())
    columns = _columns(cells)
    joints_are, names = joint_names(columns, f"{page.points}, line {cells.header}")
    joints = [columns[name] for name in names]
    labels = cells.texts(columns["configuration"][0])
    configurations = row_configurations(
        cells, labels, [place for place, _ in joints], [unit for _, unit in joints], joints_are
    )
    if len(configurations.labels) < len(labels):
        again = Counter(labels).most_common(1)[0][0]
        raise InputError(
            "a configuration appears twice",
            where=f"{page.points}, column configuration",
            came=again,
            cure="Number the configurations through, in the order in which they were drawn.",
        )
    angle, height = (cells.numbers(*columns[name]) for name in ("angle", "height"))
    return configurations, drawn_circle(read_circle(page.scan, dpi), angle, configurations.joints, height)


def _columns(cells: Cells) -> dict[str, tuple[int, str]]:
    """Return place and unit of each column, or refuse the header."""
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        location = f"{cells.source}, line {cells.header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        if match is None or match[1] in columns:
            message = "the column is not known" if match is None else f"the column {match[1]} appears twice"
            raise InputError(message, where=location, came=heading, allowed=_ALLOWED)
        units = {"angle": ANGLE_UNITS, "height": LENGTH_UNITS}.get(match[1], (*ANGLE_UNITS, *LENGTH_UNITS))
        unit = "1" if match[1] == "configuration" else checked_unit(match[2], units, f"{location}, {heading}")
        columns[match[1]] = place, unit
    for name in ("configuration", "angle", "height"):
        if name not in columns:
            raise InputError(
                f"the column {name} is missing", where=f"{cells.source}, line {cells.header}", allowed=_ALLOWED
            )
    return columns


def _refuse_twice(pages: Mapping[str, Page], drawn: Mapping[str, tuple[Configurations, DrawnCircle]]) -> None:
    first: dict[str, str] = {}
    count = {len(part.kinds) for part, _ in drawn.values()}
    if len({part.joints_are for part, _ in drawn.values()}) > 1:
        raise InputError(
            "the pages have joint positions of two kinds",
            where=" and ".join(str(page.points) for page in pages.values()),
            came="axis_1 [deg] .. and joint_1 [deg] ..",
            cure="Name the columns of all pages alike.",
        )
    if len(count) > 1:
        raise InputError(
            "the pages are of robots with different joints",
            where=" and ".join(str(page.points) for page in pages.values()),
            came=f"{' and '.join(map(str, sorted(count)))} joints",
        )
    for name, (configurations, _) in drawn.items():
        for label in configurations.labels:
            if label in first:
                raise InputError(
                    "a configuration is on two pages",
                    where=f"{pages[name].points} and {pages[first[label]].points}",
                    came=label,
                    cure="Number the configurations through all pages, in the order in which they were drawn.",
                )
            first[label] = name


def of_pages(asked: ImportCircle) -> ImportedCircles:
    """Read the pages that are asked for, and write them as canonical CSV."""
    pages = {name: Page(Path(scan), Path(asked.points[name])) for name, scan in asked.scans.items()}
    read = [file for page in pages.values() for file in (page.scan, page.points)]
    out = None if asked.out is None else file_for(asked.out, *read)
    dpi: Any = asked.dpi
    with refusals_of("scans, points"):
        data = read_drawn_circles(pages, dpi, asked.sigma)
    if out is not None:
        write_text(out, csv_text(data))
    return ImportedCircles(data, tuple(pages), out)
