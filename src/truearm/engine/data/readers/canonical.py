"""The canonical CSV: one row a reading, with its configuration, joints, target and units in the header."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.base.files import read_text
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, SMALL_ANGLE_UNITS, YES, checked_unit, written
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.engine.data.readers.rows import (
    ROLES,
    Readings,
    before_each,
    check_mark,
    dataset_of,
    order_of,
    order_of_labels,
    roles_of,
    row_configurations,
    same_everywhere,
    scale_sigma_of,
    visits_of,
)
from truearm.engine.robot.chain import Array
from truearm.engine.robot.urdf_writing import COLUMN, JOINT_COLUMN, joint_names

#: What a row may say of a fixture.
_OF_SETUP: Final = ("target", "role", "fixture", "x", "y", "z", "distance", "height", "sigma")


def check_lengths(cells: Cells, readings: Readings, places: Mapping[str, int]) -> None:
    """Refuse distances and heights from nothing, below what they can be, or beside another length.

    Args:
        places: The column of each name.
    """
    position = np.isfinite(readings.position).any(axis=1)
    lengths: dict[str, Array] = {}
    if readings.distance is not None:
        lengths["distance"] = readings.distance
    if readings.height is not None:
        lengths["height"] = readings.height
    present = [position, *(np.isfinite(values) for values in lengths.values())]
    for row in np.flatnonzero(np.sum(present, axis=0) > 1).tolist():
        raise InputError(
            "the row holds more than one reading",
            where=f"{readings.source}, line {readings.lines[row]}",
            came="two or more of a position, a distance and a height",
            allowed="one of them",
            cure="Give each a row of its own, with the same configuration.",
        )
    for name, values in lengths.items():
        for row in np.flatnonzero(np.isfinite(values)).tolist():
            if readings.fixture is None or not readings.fixture[row]:
                raise InputError(
                    f"the {name} names no fixture that it is measured from",
                    where=cells.place(row, places[name]),
                    allowed="a fixture in the column fixture",
                    cure="Name what it is measured from, with any name.",
                )
            if name == "distance" and values[row] <= 0.0:
                raise _no_distance(
                    cells, row, places[name], "Of a target held at a point give x, y and z from that point, 0, 0, 0."
                )
    if readings.fixture is not None:
        for row in np.flatnonzero(readings.reference).tolist():
            if readings.fixture[row]:
                raise InputError(
                    "a reference point is measured in the instrument's frame",
                    where=cells.place(row, places["fixture"]),
                    came=readings.fixture[row],
                    allowed="nothing in the column fixture",
                )


def _no_distance(cells: Cells, row: int, place: int, cure: str | None = None) -> InputError:
    came = cells.columns[place][row]
    where = cells.place(row, place)
    return InputError("a distance must be above zero", where=where, came=came, allowed="a number above 0", cure=cure)


def read_setup(cells: Cells, columns: Mapping[str, tuple[int, str]], data: Dataset) -> Dataset:
    """Read what is known of the fixtures: where they stand, how far from each other or how high over one, and how well.

    Args:
        cells: The rows of the role ``fixture``.
        columns: Place and unit of each column.
        data: What is measured against them.
    """
    for heading, (place, _) in columns.items():
        if heading not in _OF_SETUP:
            for row, cell in enumerate(cells.columns[place]):
                if cell:
                    raise InputError(
                        "this cell does not apply to a fixture, which stands still beside the robot",
                        where=cells.place(row, place),
                        came=cell,
                        allowed=f"cells filled in {', '.join(_OF_SETUP)} alone",
                        cure="Empty the cell, or give the row the role target.",
                    )

    def numbers(name: str, *, deviation: bool = False) -> Array:
        if name not in columns:
            return np.full(len(cells.lines), np.nan)
        place, unit = columns[name]
        return cells.numbers(place, unit, missing=True, deviation=deviation)

    names = cells.texts(columns["target"][0])
    others = cells.texts(columns["fixture"][0], missing=True) if "fixture" in columns else ("",) * len(names)
    position = np.column_stack([numbers(axis) for axis in "xyz"])
    distance, height, sigma = numbers("distance"), numbers("height"), numbers("sigma", deviation=True)
    for row, (name, other) in enumerate(zip(names, others, strict=True)):
        where = f"{cells.source}, line {cells.lines[row]}"
        placed, apart, over = (bool(np.isfinite(values[row]).any()) for values in (position, distance, height))
        for point in filter(None, (name, other)):
            if point not in data.fixtures:
                near = nearest_names(point, data.fixtures)
                raise InputError(
                    "nothing is measured against this fixture",
                    where=f"{where}, column {'target' if point == name else 'fixture'}",
                    came=point,
                    allowed=", ".join(data.fixtures) or "no row names a fixture",
                    cure=f"Did you mean {' or '.join(near)}?" if near else "Remove the row.",
                )
        part_missing = placed and not np.isfinite(position[row]).all()
        if placed + apart + over != 1 or part_missing or placed == bool(other) or name == other:
            raise InputError(
                "the row does not say where the fixture is",
                where=where,
                allowed="x, y and z of its place in the instrument's frame, its distance from another fixture, or its"
                " height over one that is a plane",
                cure="Fill in x, y, z, or fixture and distance, or fixture and height.",
            )
        if distance[row] <= 0.0:
            raise _no_distance(cells, row, columns["distance"][0])
        if np.isnan(sigma[row]):
            raise InputError(
                "the row of a fixture has no standard deviation",
                where=f"{where}, column sigma",
                allowed="a standard deviation above 0",
                cure="Fill in sigma, for example 0.001 mm of a ground scale bar.",
            )
    targets = tuple(dict.fromkeys(names))
    against = np.array([data.fixtures.index(other) if other else -1 for other in others], dtype=np.intp)
    return Dataset(
        source=cells.source,
        labels=("",),
        joints=np.zeros((1, data.joints.shape[1])),
        joint_kinds=data.joint_kinds,
        targets=targets,
        configuration=np.zeros(len(names), dtype=np.intp),
        target=np.array([targets.index(name) for name in names], dtype=np.intp),
        position=position,
        distance=distance if np.isfinite(distance).any() else None,
        height=height if np.isfinite(height).any() else None,
        fixtures=data.fixtures,
        fixture=against if (against >= 0).any() else None,
        sigma=sigma,
    )


# Rows of the role ``fixture`` are of no configuration: they say what is known of what stands beside the robot.
_POSITION: Final = ("x", "y", "z")
_QUATERNION: Final = ("qw", "qx", "qy", "qz")
_LENGTHS: Final = ("distance", "height")
_FORCE: Final = ("force_x", "force_y", "force_z")
_MOMENT: Final = ("moment_x", "moment_y", "moment_z")
_UNITS: Final[dict[str, tuple[str, ...]]] = (
    dict.fromkeys((*_POSITION, *_LENGTHS, "sigma"), LENGTH_UNITS)
    | {"sigma_rot": SMALL_ANGLE_UNITS, "scale_sigma": ("ppm",), "temperature": ("degC",)}
    | dict.fromkeys(_FORCE, ("N",))
    | dict.fromkeys(_MOMENT, ("N m",))
)
_PLAIN: Final = ("configuration", "order", "target", "role", "fixture", "visit", SIMULATED, *_QUATERNION)
#: Every column as one writes it, for messages.
_SHOWN: Final = (
    {
        "configuration": "configuration",
        "joint_1": "joint_1 [deg]",
        "axis_1": "axis_1 [deg]",
        "target": "target",
        "role": "role",
    }
    | {"order": "order", "visit": "visit", "fixture": "fixture", "distance": "distance [mm]", "height": "height [mm]"}
    | {axis: f"{axis} [mm]" for axis in _POSITION}
    | {part: part for part in _QUATERNION}
    | {"sigma": "sigma [mm]", "sigma_rot": "sigma_rot [mrad]"}
    | {"scale_sigma": "scale_sigma [ppm]", "temperature": "temperature [degC]"}
    | {name: f"{name} [N]" for name in _FORCE}
    | {name: f"{name} [N m]" for name in _MOMENT}
    | {SIMULATED: SIMULATED}
)
_ALLOWED: Final = ", ".join(_SHOWN.values()).replace("[deg]", "[deg] ..")
_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
#: Highest place in the order that a file holds.
_LAST_PLACE: Final = 999_999_999
_SEPARATORS: Final = {";": "semicolons", "\t": "tabs", "|": "vertical bars"}


@dataclass(frozen=True)
class _Column:
    place: int
    unit: str


def read_csv(path: Path) -> Dataset:
    """Read a canonical CSV.

    A row with an empty x, y or z has no position, and one with an empty qw, qx, qy or qz no orientation: it
    stays, as a missing reading. Quaternions must have length 1 within 1e-3 and are then normalised.

    Returns:
        Dataset: Configurations in order of first appearance; rows of the role ``reference`` are in ``references``.
    """
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}", ", or import it with `truearm import table`")
    cells = read_cells(text, str(path), Layout(header=header))
    columns = _columns(cells)
    if SIMULATED in columns:
        check_mark(cells, columns[SIMULATED].place)
    setup = None
    if "role" in columns and "fixture" in (roles := roles_of(cells, columns["role"].place)):
        beside = [role == "fixture" for role in roles]
        setup, cells = cells.some(beside), cells.some([not is_beside for is_beside in beside])
        if not cells.lines:
            raise InputError(
                "all rows are fixtures, there is no target",
                where=str(path),
                cure="Give the points on the robot the role `target`.",
            )
    joints_are, names = joint_names(columns, f"{path}, line {header}")
    joints = [columns[name] for name in names]
    labels = cells.texts(columns["configuration"].place)
    configurations = row_configurations(cells, labels, [j.place for j in joints], [j.unit for j in joints], joints_are)

    def numbers(*names: str, deviation: bool = False) -> Array:
        wanted = [columns[name] for name in names]
        return np.column_stack(
            [cells.numbers(column.place, column.unit, missing=True, deviation=deviation) for column in wanted]
        )

    role = columns["role"].place if "role" in columns else None
    readings = Readings(
        source=str(path),
        lines=cells.lines,
        configuration=configurations.of_row,
        targets=cells.texts(columns["target"].place),
        reference=np.array(roles_of(cells, role)) == "reference",
        position=numbers(*_POSITION) if "x" in columns else np.full((len(cells.lines), 3), np.nan),
        quaternion=numbers(*_QUATERNION) if "qw" in columns else None,
        sigma=numbers("sigma", deviation=True)[:, 0] if "sigma" in columns else None,
        sigma_rot=numbers("sigma_rot", deviation=True)[:, 0] if "sigma_rot" in columns else None,
        fixture=cells.texts(columns["fixture"].place, missing=True) if "fixture" in columns else None,
        distance=numbers("distance")[:, 0] if "distance" in columns else None,
        height=numbers("height")[:, 0] if "height" in columns else None,
        visit=visits_of(cells, columns["visit"].place) if "visit" in columns else None,
    )
    check_lengths(cells, readings, {name: column.place for name, column in columns.items()})

    def circumstance(name: str) -> Array:
        column = columns[name]
        return same_everywhere(cells, configurations, column.place, column.unit)

    wrench = None
    if "force_x" in columns:
        still = np.zeros(len(configurations.labels))
        wrench = np.column_stack([circumstance(n) if n in columns else still for n in (*_FORCE, *_MOMENT)])
    order = order_of(cells, configurations, columns["order"].place) if "order" in columns else None
    dataset = dataset_of(readings, configurations, order)
    places = {name: (column.place, column.unit) for name, column in columns.items()}
    return replace(
        dataset,
        setup=None if setup is None else read_setup(setup, places, dataset),
        scale_sigma=scale_sigma_of(cells, *scale) if (scale := places.get("scale_sigma")) else None,
        temperature=circumstance("temperature") if "temperature" in columns else None,
        wrench=wrench,
    )


def refuse_other_separators(text: str, where: str, otherwise: str = "") -> None:
    """Refuse a text whose header is not separated by commas.

    Args:
        where: Names the header.
        otherwise: What can be done besides saving it again, for the end of that sentence.
    """
    heading = next(line for line in lines_of(text) if line.strip())
    seen = next((name for sign, name in _SEPARATORS.items() if sign in heading), None)
    if seen is None and "," not in heading and len(heading.split()) > 3:
        seen = "blanks"
    if seen is not None:
        raise InputError(
            "the columns are not separated by commas",
            where=where,
            came=seen,
            allowed="commas",
            cure=f"Save the file with commas and decimal points{otherwise}.",
        )


def _columns(cells: Cells) -> dict[str, _Column]:
    """Return the place and the unit of every column by its name, or refuse the header."""
    columns: dict[str, _Column] = {}
    for place, heading in enumerate(cells.names):
        where = f"{cells.source}, line {cells.header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        units = _UNITS.get(name)
        if JOINT_COLUMN.fullmatch(name):
            units = (*ANGLE_UNITS, *LENGTH_UNITS)
        if units is None and name not in _PLAIN:
            word = re.split(r"[^A-Za-z]", name)[0]
            near = nearest_names(name, _SHOWN, 1) or nearest_names(word, _SHOWN, 1)
            raise InputError(
                "the column is not known" if heading else "the column has no name",
                where=where,
                came=heading,
                allowed=_ALLOWED,
                cure=f"Did you mean {_SHOWN[near[0]]}?" if near else "Rename it, or leave it out.",
            )
        if name in columns:
            raise InputError(
                f"the column {name} appears twice",
                where=f"{where} as well as column {columns[name].place + 1}",
                came=heading,
                cure="Remove one of them.",
            )
        if units is not None:
            unit = checked_unit(unit, units, f"{where}, {heading}")
        elif unit is not None:
            raise InputError(
                "this column takes no unit", where=where, came=heading, allowed=name, cure="Remove the unit."
            )
        columns[name] = _Column(place, unit or "1")
    _refuse_missing(cells, columns)
    return columns


def _refuse_missing(cells: Cells, columns: dict[str, _Column]) -> None:
    where = f"{cells.source}, line {cells.header}"
    joint_names(columns, where)
    lengths = [name for name in _LENGTHS if name in columns]
    positions = () if lengths and not any(axis in columns for axis in _POSITION) else _POSITION
    for name in ("configuration", "target", *positions, *(["fixture"] if lengths else [])):
        if name not in columns:
            raise InputError(
                f"the column {name} is missing", where=where, allowed=_ALLOWED, cure=f"Add {_SHOWN[name]}."
            )
    present = [name for name in _QUATERNION if name in columns]
    if present and len(present) < 4:
        raise InputError(
            "the quaternion is not complete",
            where=where,
            came=", ".join(present),
            allowed="qw, qx, qy, qz, or none of them",
            cure=f"Add {', '.join(n for n in _QUATERNION if n not in present)}.",
        )
    for needed, group in ((_FORCE, (*_FORCE, *_MOMENT)), (_MOMENT, _MOMENT)):
        if any(name in columns for name in group):
            for name in needed:
                if name not in columns:
                    raise InputError(
                        f"the column {name} is missing",
                        where=where,
                        allowed=f"{', '.join(_SHOWN[n] for n in needed)}, or none of them",
                        cure=f"Add {_SHOWN[name]}; it may be zero.",
                    )
    if "sigma_rot" in columns and not present:
        raise InputError(
            "the column sigma_rot is there, and no orientation",
            where=where,
            allowed="sigma_rot together with qw, qx, qy, qz",
            cure="Add the quaternion, or remove sigma_rot.",
        )


# -- writing -------------------------------------------------------------------------------------------


def csv_text(dataset: Dataset, length_unit: str = "mm", angle_unit: str = "deg") -> str:
    """Return a dataset as the text of a canonical CSV.

    Rows come configuration by configuration, in each one the targets first and then the reference points; what is
    known of fixtures comes last.
    What was read from such a text is written as the same text again. ``sigma_rot`` is always in mrad.
    """
    checked_unit(length_unit, LENGTH_UNITS, "length unit")
    checked_unit(angle_unit, ANGLE_UNITS, "angle unit")
    parts = [dataset] if dataset.references is None else [dataset, dataset.references]
    units = [angle_unit if kind == "revolute" else length_unit for kind in dataset.joint_kinds]
    column = COLUMN["controller" if dataset.joints_are == "controller" else "model"]
    circumstances = {} if dataset.temperature is None else {"temperature": dataset.temperature}
    if dataset.wrench is not None:
        circumstances |= dict(zip((*_FORCE, *_MOMENT), dataset.wrench.T, strict=True))
    order = _order_beside_labels(dataset)
    columns = _reading_columns(dataset, parts, length_unit)
    before = ["configuration", *([] if order is None else ["order"])]
    before += [f"{column}_{number} [{unit}]" for number, unit in enumerate(units, 1)]
    behind = [*(_SHOWN[name] for name in circumstances), *([SIMULATED] if dataset.simulated else [])]
    mark = [YES] if dataset.simulated else []
    joints = [[_shown(v, unit) for v, unit in zip(row, units, strict=True)] for row in dataset.joints.tolist()]
    rows: list[list[list[str]]] = [[] for _ in dataset.labels]
    for part, role in zip(parts, ROLES, strict=False):
        for reading, configuration in enumerate(part.configuration.tolist()):
            place = [] if order is None else [order[configuration]]
            row = [dataset.labels[configuration], *place, *joints[configuration]]
            row += [cell for _, cells_of in columns for cell in cells_of(part, role, reading)]
            row += [_shown(float(values[configuration]), "1") for values in circumstances.values()]
            rows[configuration].append(row + mark)
    unmeasured = next((label for label, readings in zip(dataset.labels, rows, strict=True) if not readings), None)
    if unmeasured is not None:
        raise InputError(
            "a configuration without a reading cannot be written to a file",
            where=f"{dataset.source}, configuration {unmeasured}",
            cure="Leave it out, or give it missing readings.",
        )
    if (setup := dataset.setup) is not None:
        for reading in range(len(setup.target)):
            cells = [cell for _, cells_of in columns for cell in cells_of(setup, "fixture", reading)]
            rows.append([[""] * len(before) + cells + [""] * len(behind)])
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*before, *(heading for headings, _ in columns for heading in headings), *behind])
    writer.writerows(row for readings in rows for row in readings)
    return stream.getvalue()


#: Returns the cells of a reading from its dataset, its role and its index.
_CellsOf = Callable[[Dataset, str, int], list[str]]


def _reading_columns(dataset: Dataset, parts: Sequence[Dataset], unit: str) -> list[tuple[Sequence[str], _CellsOf]]:
    """Return the columns that differ from reading to reading: their headings, and what gives the cells of a reading."""
    setup = dataset.setup
    every = [part for part in (*parts, setup) if part is not None]

    def fixture(part: Dataset, role: str, reading: int) -> list[str]:
        other = int(part.against[reading])
        return [part.fixtures[other] if other >= 0 else ""]

    def visit(part: Dataset, role: str, reading: int) -> list[str]:
        once = "" if role == "fixture" else "1"
        return [once if part.visit is None else str(int(part.visit[reading]))]

    def scale(part: Dataset, role: str, reading: int) -> list[str]:
        return ["" if role == "fixture" or dataset.scale_sigma is None else _shown(dataset.scale_sigma, "ppm")]

    def numbers(field: str, unit: str, count: int) -> _CellsOf:
        return lambda part, role, reading: _cells(getattr(part, field), reading, unit, count)

    lengths = [name for name in _LENGTHS if any(getattr(part, name) is not None for part in every)]
    oriented = any(part.quaternion is not None or part.sigma_rot is not None for part in parts)
    positions = not lengths or any(np.isfinite(part.position).any() for part in every)
    columns: list[tuple[bool, Sequence[str], _CellsOf]] = [
        (True, ["target"], lambda part, role, reading: [part.targets[part.target[reading]]]),
        (len(every) > 1, ["role"], lambda part, role, reading: [role]),
        (any(part.visit is not None for part in parts), ["visit"], visit),
        (any(part.fixtures for part in every), ["fixture"], fixture),
        (positions, [f"{axis} [{unit}]" for axis in _POSITION], numbers("position", unit, 3)),
        (oriented, _QUATERNION, numbers("quaternion", "1", 4)),
        *((True, [f"{name} [{unit}]"], numbers(name, unit, 1)) for name in lengths),
        (any(p is setup or p.sigma is not None for p in every), [f"sigma [{unit}]"], numbers("sigma", unit, 1)),
        (any(part.sigma_rot is not None for part in parts), ["sigma_rot [mrad]"], numbers("sigma_rot", "mrad", 1)),
        (dataset.scale_sigma is not None, [_SHOWN["scale_sigma"]], scale),
    ]
    return [(headings, cells) for shown, headings, cells in columns if shown]


def _order_beside_labels(dataset: Dataset) -> list[str] | None:
    """Return the place of each configuration in the order of measurement, None if it is not known or labels tell it."""
    if dataset.number is None:
        return None
    order = order_of_labels(dataset.labels)
    if order is not None and np.array_equal(before_each(order), dataset.number):
        return None
    places = [str(int(number) + 1) for number in dataset.number.tolist()]
    is_order = len(set(places)) == len(places) and bool((dataset.number == np.floor(dataset.number)).all())
    return places if is_order and dataset.number.min() >= 0 and dataset.number.max() < _LAST_PLACE else None


def _cells(values: Array | None, reading: int, unit: str, count: int) -> list[str]:
    if values is None:
        return [""] * count
    return [_shown(v, unit) for v in np.atleast_1d(values[reading]).tolist()]


def _shown(value: float, unit: str) -> str:
    return "" if np.isnan(value) else repr(written(value, unit))
