"""From readings row by row to a dataset: what every reader checks in the same way."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError
from truearm.engine.base.units import YES
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.dataset_fields import VISITS
from truearm.engine.data.readers.cells import Cells
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.postures import approach_of

#: How far the norm of a quaternion may be from 1; files round quaternions to four digits or more.
QUATERNION_TOLERANCE = 1e-3
#: Names of the columns of a quaternion, for messages.
_QUATERNION = "qw qx qy qz"
#: What the first configuration of a campaign is numbered, unless it is 0. A file may hold a later part.
_FIRST = 1


@dataclass(frozen=True)
class Configurations:
    """Configurations in order of first appearance."""

    labels: tuple[str, ...]  #: Their names.
    joints: Array  #: Joint positions [rad; m for prismatic joints], ``(configurations, joints)``.
    kinds: tuple[str, ...]  #: ``revolute`` or ``prismatic`` for each joint.
    of_row: IntArray  #: Configuration of each row they were found in, ``(rows,)``.
    joints_are: JointsOf = "model"  #: ``model``, or ``controller`` if it shows these joint positions.
    before: Configurations | None = None  #: Where the arm stops right before each, where a plan says so.
    simulated: bool = False  #: Whether a virtual instrument read any of their rows.


def row_configurations(
    cells: Cells, labels: Sequence[str], columns: Sequence[int], units: Sequence[str], joints_are: JointsOf = "model"
) -> Configurations:
    """Gather the configurations of a table in which every row has a label and all joints.

    The joints must be identical on all rows of a configuration.
    """
    joints = np.column_stack([cells.numbers(c, unit) for c, unit in zip(columns, units, strict=True)])
    place: dict[str, int] = {}
    of_row = np.array([place.setdefault(label, len(place)) for label in labels], dtype=np.intp)
    _, first = np.unique(of_row, return_index=True)
    differs = joints != joints[first[of_row]]
    if differs.any():
        row, joint = (int(i) for i in np.argwhere(differs)[0])
        before, column = int(first[of_row[row]]), columns[joint]
        raise InputError(
            f"the joints of configuration {labels[row]!r} differ from those on line {cells.lines[before]}",
            where=cells.place(row, column),
            came=cells.columns[column][row],
            allowed=f"{cells.columns[column][before]}, as on line {cells.lines[before]}",
            cure="A configuration is one standstill of the robot: give other joints another label.",
        )
    kinds = tuple("revolute" if unit in ("deg", "rad") else "prismatic" for unit in units)
    return Configurations(tuple(place), joints[first], kinds, of_row, joints_are, simulated=cells.simulated)


def same_everywhere(cells: Cells, configurations: Configurations, column: int, unit: str) -> Array:
    """Return a number for each configuration that every one of its rows repeats, ``(configurations,)``."""
    numbers = cells.numbers(column, unit)
    _, first = np.unique(configurations.of_row, return_index=True)
    differs = np.flatnonzero(numbers != numbers[first[configurations.of_row]])
    if len(differs):
        row = int(differs[0])
        before = int(first[configurations.of_row[row]])
        raise InputError(
            f"{cells.names[column]} differs from line {cells.lines[before]}, which has the same configuration",
            where=cells.place(row, column),
            came=cells.columns[column][row],
            allowed=f"{cells.columns[column][before]}, as on line {cells.lines[before]}",
            cure="A configuration is one standstill of the robot: give what changed another label.",
        )
    return np.asarray(numbers[first])


def order_of_labels(labels: Sequence[str]) -> IntArray | None:
    """Return the numbers of the configurations, if they are numbered as they were measured."""
    if not all(re.fullmatch("[0-9]{1,9}", label) for label in labels) or len({int(n) for n in labels}) < len(labels):
        return None
    return np.array([int(label) for label in labels])


@dataclass(frozen=True)
class Readings:
    """Readings as a file has them, in file order."""

    source: str  #: The file, for messages.
    lines: Sequence[int]  #: Line of each reading.
    configuration: IntArray  #: Index of its configuration, ``(readings,)``.
    targets: Sequence[str]  #: Name of its target.
    reference: NDArray[np.bool_]  #: Whether that is a reference point, ``(readings,)``.
    position: Array  #: [m], ``(readings, 3)``, NaN where a coordinate is missing.
    #: (w, x, y, z), ``(readings, 4)``, NaN where it is missing; None if the file has none.
    quaternion: Array | None = None
    #: sigma, sigma_rot: declared standard deviations [m], [rad], ``(readings,)``, NaN where missing; None if there are
    #: none.
    sigma: Array | None = None
    sigma_rot: Array | None = None
    #: Name of the fixture that each is measured against, empty for none; None if the file names none.
    fixture: Sequence[str] | None = None
    #: distance, height: from, or over, the fixture [m], ``(readings,)``, NaN where missing; None if the file has none.
    distance: Array | None = None
    height: Array | None = None
    #: Which visit of its configuration each was taken on, ``(readings,)``; None if the file does not say.
    visit: IntArray | None = None
    #: What the file calls its columns ``sigma``, ``sigma_rot`` and ``quaternion``, where that is something else.
    called: Mapping[str, str] = field(default_factory=dict)


def dataset_of(readings: Readings, configurations: Configurations, order: IntArray | None = None) -> Dataset:
    """Check the readings and return them as a dataset, reference points beside the targets.

    A position or a quaternion of which a part is missing is missing. Quaternions are normalised.

    Args:
        order: Number of each configuration in the order of measurement, ``(configurations,)``, each there once; None
            for what the labels tell.
    """
    _refuse_both_roles(readings)
    if readings.reference.all():
        raise InputError(
            "all rows are reference points, there is no target",
            where=readings.source,
            cure="Give the points on the robot the role `target`.",
        )
    position = np.where(np.isnan(readings.position).any(axis=1, keepdims=True), np.nan, readings.position)
    quaternion = None
    if readings.quaternion is not None:
        names = readings.called.get("quaternion", _QUATERNION)
        quaternion = unit_quaternions(readings.quaternion, readings.source, readings.lines, names)
    references = None
    if readings.reference.any():
        references = _part(readings, configurations, readings.reference, position, quaternion)
    targets = _part(readings, configurations, ~readings.reference, position, quaternion)
    return in_order(replace(targets, references=references), order)


def in_order(data: Dataset, order: IntArray | None = None) -> Dataset:
    """Return data with the order of measurement: that which is given, or which the labels tell."""
    order = order_of_labels(data.labels) if order is None else order
    return replace(
        data,
        approach=None if order is None else approach_of(data.joints, order),
        number=None if order is None else before_each(order),
    )


def places_after_stops(count: int) -> IntArray:
    """Return the places of configurations in an order in which a stop stands before each, ``(count,)``.

    Who reads them sees that no joint came from the configuration before.
    """
    return np.arange(2, 2 * count + 1, 2)


def before_each(order: IntArray) -> Array:
    """Return how many configurations of the campaign were measured before each, ``(configurations,)``."""
    return np.asarray(order - min(int(order.min()), _FIRST), float)


def _part(
    readings: Readings,
    configurations: Configurations,
    chosen: NDArray[np.bool_],
    position: Array,
    quaternion: Array | None,
) -> Dataset:
    place: dict[str, int] = {}
    rows: IntArray = np.flatnonzero(chosen)
    names = [readings.targets[row] for row in rows.tolist()]
    target = np.array([place.setdefault(name, len(place)) for name in names], dtype=np.intp)
    has_length = _whole(position)
    for lengths in (readings.distance, readings.height):
        has_length = has_length if lengths is None else has_length | np.isfinite(lengths)
    has_orientation: NDArray[np.bool_] = np.zeros(len(position), dtype=bool)
    if quaternion is not None:
        has_orientation = _whole(quaternion)
        quaternion = quaternion[rows] if has_orientation[rows].any() else None
    beside = [""] * len(rows) if readings.fixture is None else [readings.fixture[row] for row in rows.tolist()]
    fixtures = tuple(dict.fromkeys(name for name in beside if name))
    index = {name: number for number, name in enumerate(fixtures)}

    def lengths_of(values: Array | None) -> Array | None:
        return None if values is None or np.isnan(values[rows]).all() else values[rows]

    return Dataset(
        source=readings.source,
        labels=configurations.labels,
        joints=configurations.joints,
        joint_kinds=configurations.kinds,
        joints_are=configurations.joints_are,
        simulated=configurations.simulated,
        targets=tuple(place),
        configuration=readings.configuration[rows],
        target=target,
        position=position[rows],
        quaternion=quaternion,
        distance=lengths_of(readings.distance),
        height=lengths_of(readings.height),
        fixtures=fixtures,
        fixture=np.array([index.get(n, -1) for n in beside], dtype=np.intp) if fixtures else None,
        sigma=_declared(readings, rows, readings.sigma, has_length, "sigma"),
        sigma_rot=_declared(readings, rows, readings.sigma_rot, has_orientation, "sigma_rot"),
        visit=None if readings.visit is None else readings.visit[rows],
    )


def _whole(values: Array) -> NDArray[np.bool_]:
    return np.asarray(np.isfinite(values).all(axis=1))


def _declared(
    readings: Readings, rows: IntArray, sigma: Array | None, exists: NDArray[np.bool_], column: str
) -> Array | None:
    """Return the standard deviations of some rows, refusing them if only some of the readings have one."""
    if sigma is None or np.isnan(sigma[rows]).all():
        return None
    lacking = rows[exists[rows] & np.isnan(sigma[rows])]
    if len(lacking):
        raise InputError(
            f"this reading has no {column}, and others have one",
            where=f"{readings.source}, line {readings.lines[lacking[0]]}, column {readings.called.get(column, column)}",
            allowed=f"{column} for all readings, or for none",
            cure="Fill the column, or leave it out.",
        )
    return sigma[rows]


def _refuse_both_roles(readings: Readings) -> None:
    first: dict[str, int] = {}
    for row, name in enumerate(readings.targets):
        before = first.setdefault(name, row)
        if readings.reference[row] != readings.reference[before]:
            raise InputError(
                f"{name!r} is a target on one line and a reference point on another",
                where=f"{readings.source}, lines {readings.lines[before]} and {readings.lines[row]}",
                allowed="one role for each name",
                cure="Give the point on the robot and the one beside it different names.",
            )


def unit_quaternions(q: Array, source: str, lines: Sequence[int], names: str = _QUATERNION) -> Array:
    """Return quaternions ``(rows, 4)`` of length 1, or refuse one that is further from it than rounding.

    One that is already there to rounding stays as it is, so that reading what was written changes nothing.
    """
    norm = np.sqrt((q * q).sum(axis=1))
    bad = np.flatnonzero(np.abs(norm - 1.0) > QUATERNION_TOLERANCE)
    if len(bad):
        raise InputError(
            "the quaternion (qw, qx, qy, qz) does not have length 1",
            where=f"{source}, line {lines[bad[0]]}, columns {names}",
            came=f"length {norm[bad[0]]:.6g}",
            allowed=f"1 within {QUATERNION_TOLERANCE:g}",
            cure="Check the order of the columns, and that all digits were exported.",
        )
    rounded = np.abs(norm - 1.0) <= 1e-15
    normalized: Array = np.where(np.isnan(norm)[:, None], np.nan, np.where(rounded[:, None], q, q / norm[:, None]))
    return normalized


ROLES: Final = ("target", "reference", "fixture")
#: What the order of measurement is numbered with.
_ORDER: Final = "a whole number, 0 or more, of the configuration"


def roles_of(cells: Cells, place: int | None) -> tuple[str, ...]:
    """Return the role of each row; all are targets in a file without this column."""
    if place is None:
        return ("target",) * len(cells.lines)
    roles = cells.columns[place]
    for role in dict.fromkeys(roles):
        if role not in ROLES:
            raise InputError(
                "the role is not known" if role else "the cell is empty",
                where=cells.place(roles.index(role), place),
                came=role or None,
                allowed=f"{', '.join(ROLES[:-1])} or {ROLES[-1]}",
                cure="A target is fixed to the robot's tool, a reference stands beside the robot and is measured too, "
                "a fixture is what targets are measured against.",
            )
    return roles


def check_mark(cells: Cells, place: int) -> None:
    """Refuse rows of which it is not clear whether a virtual instrument read them."""
    for row, text in enumerate(cells.columns[place]):
        if text.lower() not in ("", YES, "no"):
            raise InputError(
                "this does not say whether a virtual instrument read the row",
                where=cells.place(row, place),
                came=text,
                allowed=f"{YES}, or nothing of a real instrument",
            )


def scale_sigma_of(cells: Cells, place: int, unit: str) -> float:
    """Return the one deviation of the scale, which every row repeats."""
    values = cells.numbers(place, unit, deviation=True)
    other = np.flatnonzero(values != values[0])
    if len(other):
        raise InputError(
            "the scale is of the instrument, and there is one of it",
            where=cells.place(int(other[0]), place),
            came=cells.columns[place][int(other[0])],
            allowed=f"{cells.columns[place][0]}, as on line {cells.lines[0]}",
        )
    return float(values[0])


def order_of(cells: Cells, configurations: Configurations, place: int) -> IntArray:
    """Return the number of each configuration in the order of measurement, which its rows repeat."""
    texts = cells.texts(place)
    of: dict[int, int] = {}
    rows: list[int] = []
    for row, (text, configuration) in enumerate(zip(texts, configurations.of_row.tolist(), strict=True)):
        if not re.fullmatch("[0-9]{1,9}", text):
            raise InputError("this is no place in an order", where=cells.place(row, place), came=text, allowed=_ORDER)
        if configuration == len(rows):
            rows.append(row)
        elif int(text) != int(texts[rows[configuration]]):
            raise InputError(
                f"order differs from line {cells.lines[rows[configuration]]}, which has the same configuration",
                where=cells.place(row, place),
                came=text,
                allowed=f"{texts[rows[configuration]]}, as on line {cells.lines[rows[configuration]]}",
            )
        if of.setdefault(int(text), configuration) != configuration:
            raise InputError(
                f"the configuration {configurations.labels[of[int(text)]]!r} has this place in the order",
                where=cells.place(row, place),
                came=text,
                allowed="another number for each configuration",
            )
    return np.array([int(texts[row]) for row in rows], dtype=np.intp)


def visits_of(cells: Cells, place: int) -> IntArray:
    """Return the number of the visit that each row was read on."""
    for line, text in enumerate(texts := cells.texts(place)):
        if not re.fullmatch("[0-9]{1,9}", text):
            raise InputError("this is no number of a visit", where=cells.place(line, place), came=text, allowed=VISITS)
    return np.array([int(text) for text in texts], dtype=np.intp)
