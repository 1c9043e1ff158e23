"""Inclinations: a CSV with one row a reading of one inclinometer, its columns named as in the canonical CSV."""

from __future__ import annotations

import csv
import io
import math
import re
from pathlib import Path
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.base.files import read_text
from truearm.engine.base.units import ANGLE_UNITS, LENGTH_UNITS, SMALL_ANGLE_UNITS, YES, checked_unit, from_si, written
from truearm.engine.base.units import COLUMN as SIMULATED
from truearm.engine.data.dataset import IntArray
from truearm.engine.data.inclinations import Inclinations, Instruments
from truearm.engine.data.readers.canonical import refuse_other_separators
from truearm.engine.data.readers.cells import Cells, Layout, lines_of, read_cells
from truearm.engine.data.readers.rows import Configurations, row_configurations, same_everywhere
from truearm.engine.robot.chain import Array
from truearm.engine.robot.urdf_writing import COLUMN, JOINT_COLUMN, joint_names

_AXES: Final = ("x", "y", "z")
_FORCE: Final = ("force_x", "force_y", "force_z")
_MOMENT: Final = ("moment_x", "moment_y", "moment_z")
_COG: Final = ("payload_x", "payload_y", "payload_z")
_UNITS: Final[dict[str, tuple[str, ...]]] = (
    dict.fromkeys((*_AXES, "sigma"), SMALL_ANGLE_UNITS)
    | dict.fromkeys(_FORCE, ("N",))
    | dict.fromkeys(_MOMENT, ("N m",))
    | {"payload": ("kg", "g")}
    | dict.fromkeys(_COG, LENGTH_UNITS)
)
_PLAIN: Final = ("configuration", "order", "link", "sensor", SIMULATED)
#: Columns of the canonical CSV that this file has not.
_OF_TARGETS: Final = ("target", "fixture", "distance", "height", "role", "qw")
#: Every column as one writes it, for messages.
_SHOWN: Final = (
    {"configuration": "configuration", "order": "order"}
    | {"joint_1": "joint_1 [deg]", "axis_1": "axis_1 [deg]", "link": "link", "sensor": "sensor"}
    | {axis: f"{axis} [deg]" for axis in _AXES}
    | {"sigma": "sigma [deg]", "payload": "payload [kg]"}
    | {name: f"{name} [mm]" for name in _COG}
    | {name: f"{name} [N]" for name in _FORCE}
    | {name: f"{name} [N m]" for name in _MOMENT}
    | {SIMULATED: SIMULATED}
)
_ALLOWED: Final = ", ".join(_SHOWN.values()).replace("_1 [deg]", "_1 [deg] ..")
_HEADING: Final = re.compile(r"(?P<name>[^\[]*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
#: Rounding of a right angle in degrees or radians [rad].
_ROUNDING: Final = 1e-6


def read_inclinations(path: Path) -> Inclinations:
    """Read what inclinometers on the links of an arm read.

    One row is one reading of one instrument: ``configuration``, all joints, the number of the ``link`` (that behind
    joint i has number i), the name of the ``sensor`` where a link carries several, the angles ``x``, ``y`` and ``z`` of
    those axes of the link that the instrument has above the horizontal, and ``sigma``. ``order``, ``payload`` (with its
    centre of gravity) and a force on the flange (with a moment) are of the whole configuration. An empty angle is a
    missing reading.

    Raises:
        InputError: Naming file, line and column of what cannot be used.
    """
    text = read_text(path)
    header = 1 + next(number for number, line in enumerate(lines_of(text)) if line.strip())
    refuse_other_separators(text, f"{path}, line {header}")
    cells = read_cells(text, str(path), Layout(header=header))
    columns = _columns(cells)
    joints_are, names = joint_names(columns, f"{path}, line {header}")
    configurations = row_configurations(
        cells,
        cells.texts(columns["configuration"][0]),
        [columns[name][0] for name in names],
        [columns[name][1] for name in names],
        joints_are,
    )
    count = len(configurations.labels)

    def circumstances(*wanted: str) -> Array:
        return np.column_stack(
            [same_everywhere(cells, configurations, *columns[n]) if n in columns else np.zeros(count) for n in wanted]
        )

    payload = circumstances("payload", *_COG)
    if (payload[:, 0] < 0.0).any():
        row = int(np.flatnonzero(payload[configurations.of_row, 0] < 0.0)[0])
        place = columns["payload"][0]
        raise InputError("a mass cannot be negative", where=cells.place(row, place), came=cells.columns[place][row])
    instruments, of_row = _instruments(cells, columns, len(names))
    angle = np.full((count, len(instruments), 3), np.nan)
    sigma = np.full((count, len(instruments)), np.nan)
    at = configurations.of_row, of_row
    _refuse_twice(cells, configurations, of_row, instruments)
    for number, axis in enumerate(_AXES):
        if axis in columns:
            angle[(*at, number)] = _angles(cells, *columns[axis])
    sigma[at] = cells.numbers(*columns["sigma"], deviation=True)
    return Inclinations(
        source=str(path),
        labels=configurations.labels,
        joints=configurations.joints,
        joint_kinds=configurations.kinds,
        instruments=instruments,
        angle=angle,
        sigma=sigma,
        order=_order(cells, columns, configurations),
        wrench=circumstances(*_FORCE, *_MOMENT),
        payload=payload,
        joints_are=joints_are,
        simulated=cells.simulated,
    )


def _columns(cells: Cells) -> dict[str, tuple[int, str]]:
    """Return place and unit of every column by its name, or refuse the header."""
    columns: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        location = f"{cells.source}, line {cells.header}, column {place + 1}"
        match = _HEADING.fullmatch(heading)
        name, unit = (match["name"], match["unit"]) if match else (heading, None)
        units = (*ANGLE_UNITS, *LENGTH_UNITS) if JOINT_COLUMN.fullmatch(name) else _UNITS.get(name)
        if units is None and name not in _PLAIN:
            near = nearest_names(name, _SHOWN, 1)
            cure = f"Did you mean {_SHOWN[near[0]]}?" if near else "Rename it, or leave it out."
            if name in _OF_TARGETS:
                cure = "This looks like readings of targets, which are given as `poses`."
            raise InputError(
                "the column is not known" if heading else "the column has no name",
                where=location,
                came=heading,
                allowed=_ALLOWED,
                cure=cure,
            )
        if name in columns:
            raise InputError(f"the column {name} appears twice", where=location, cure="Remove one of them.")
        if units is not None:
            unit = checked_unit(unit, units, f"{location}, {heading}")
        elif unit is not None:
            raise InputError("this column takes no unit", where=location, came=heading, allowed=name)
        columns[name] = (place, unit or "1")
    location = f"{cells.source}, line {cells.header}"
    joint_names(columns, location)
    needed = ["configuration", "link", *(() if any(axis in columns for axis in _AXES) else ("x", "y")), "sigma"]
    for group in (_FORCE, _MOMENT, ("payload", *_COG)):
        if any(name in columns for name in (*group, *(_MOMENT if group == _FORCE else ()))):
            needed += group if group != ("payload", *_COG) or any(n in columns for n in _COG) else ["payload"]
    missing = [name for name in needed if name not in columns]
    if missing:
        raise InputError(
            f"the column {missing[0]} is missing",
            where=location,
            allowed=_ALLOWED,
            cure=f"Add {', '.join(_SHOWN[name] for name in missing)}.",
        )
    return columns


def _instruments(cells: Cells, columns: dict[str, tuple[int, str]], joints: int) -> tuple[Instruments, IntArray]:
    """Return the instruments, and which of them each row is of."""
    place = columns["link"][0]
    texts = cells.texts(place)
    for row, text in enumerate(texts):
        if not re.fullmatch("[0-9]{1,4}", text) or not 0 <= int(text) <= joints:
            raise InputError(
                "there is no such link",
                where=cells.place(row, place),
                came=text,
                allowed=f"1 to {joints}, the number of the joint before the link",
            )
        if int(text) == 0:
            raise InputError(
                "this is the base: no joint moves it, and an inclinometer on it tells nothing of the joints",
                where=cells.place(row, place),
                came=text,
                allowed=f"1 to {joints}, the number of the joint before the link",
                cure="Leave its rows out, or correct the link.",
            )
    sensors = cells.texts(columns["sensor"][0], missing=True) if "sensor" in columns else ("",) * len(texts)
    known: dict[tuple[int, str], int] = {}
    of_row = np.array(
        [known.setdefault((int(link), sensor), len(known)) for link, sensor in zip(texts, sensors, strict=True)],
        dtype=np.intp,
    )
    names = tuple(f"link {link}" + (f", sensor {sensor}" if sensor else "") for link, sensor in known)
    mounts = np.tile(np.eye(3), (len(known), 1, 1))
    return Instruments(names, tuple(link - 1 for link, _ in known), mounts), of_row


def _refuse_twice(cells: Cells, configurations: Configurations, of_row: IntArray, instruments: Instruments) -> None:
    """Refuse two rows of the same instrument in the same configuration."""
    first: dict[tuple[int, int], int] = {}
    for row, key in enumerate(zip(configurations.of_row.tolist(), of_row.tolist(), strict=True)):
        before = first.setdefault(key, row)
        if before != row:
            raise InputError(
                f"{instruments.names[key[1]]} was read twice in configuration {configurations.labels[key[0]]!r}",
                where=f"{cells.source}, lines {cells.lines[before]} and {cells.lines[row]}",
                cure="Name the instruments in the column sensor, or give the second reading a configuration.",
            )


def _angles(cells: Cells, place: int, unit: str) -> Array:
    """Return angles above the horizontal [rad], NaN where none was read."""
    angles = cells.numbers(place, unit, missing=True)
    steep = np.flatnonzero(np.abs(angles) > math.pi / 2 + _ROUNDING)
    if len(steep):
        row, most = int(steep[0]), from_si(math.pi / 2, unit)
        raise InputError(
            "no axis can stand so high above the horizontal",
            where=cells.place(row, place),
            came=f"{cells.columns[place][row]} {unit}",
            allowed=f"-{most:.6g} to {most:.6g} {unit}",
            cure="Write the angle of the axis above the horizontal plane, and check the unit.",
        )
    return np.asarray(np.clip(angles, -math.pi / 2, math.pi / 2))


def _order(cells: Cells, columns: dict[str, tuple[int, str]], configurations: Configurations) -> IntArray:
    """Return the number of each configuration in the sequence of measurement, that of the file if it does not say."""
    if "order" not in columns:
        return np.arange(1, len(configurations.labels) + 1)
    place = columns["order"][0]
    for row, text in enumerate(cells.texts(place)):
        if not re.fullmatch("[1-9][0-9]{0,8}", text):
            raise InputError(
                "this is no place in the order of measurement",
                where=cells.place(row, place),
                came=text,
                allowed="a whole number from 1",
            )
    order = same_everywhere(cells, configurations, place, "1").astype(np.intp)
    seen: dict[int, str] = {}
    for label, number in zip(configurations.labels, order.tolist(), strict=True):
        if seen.setdefault(number, label) != label:
            raise InputError(
                f"the configurations {seen[number]!r} and {label!r} have the same place in the order of measurement",
                where=f"{cells.source}, column order",
                came=number,
                cure="Number them as they were measured.",
            )
    return order


def inclinations_text(read: Inclinations) -> str:
    """Return inclinations as the text of such a CSV, in deg, N and kg, in the order of measurement."""
    units = ["deg" if kind == "revolute" else "mm" for kind in read.joint_kinds]
    column = COLUMN["controller" if read.joints_are == "controller" else "model"]
    forced, moved, carried = read.wrench.any(), read.wrench[:, 3:].any(), read.payload.any()
    axes = [number for number in range(3) if np.isfinite(read.angle[..., number]).any()]
    mark = [YES] if read.simulated else []
    sensors = [name.partition(", sensor ")[2] for name in read.instruments.names]
    beside = {
        **(dict(zip(_FORCE, read.wrench[:, :3].T, strict=True)) if forced else {}),
        **(dict(zip(_MOMENT, read.wrench[:, 3:].T, strict=True)) if moved else {}),
        **(dict(zip(("payload", *_COG), read.payload.T, strict=True)) if carried else {}),
    }
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [
            *("configuration", "order"),
            *(f"{column}_{number} [{unit}]" for number, unit in enumerate(units, 1)),
            *(_SHOWN[name] for name in beside),
            *("link", *(["sensor"] if any(sensors) else [])),
            *(_SHOWN[_AXES[number]] for number in axes),
            _SHOWN["sigma"],
            *([SIMULATED] if read.simulated else []),
        ]
    )

    def shown(value: float, unit: str) -> str:
        return "" if math.isnan(value) else repr(written(float(value), unit))

    for at in np.argsort(read.order, kind="stable").tolist():
        still = [
            *(read.labels[at], str(int(read.order[at]))),
            *(shown(value, unit) for value, unit in zip(read.joints[at], units, strict=True)),
            *(shown(values[at], _SHOWN[name].partition("[")[2].rstrip("]")) for name, values in beside.items()),
        ]
        for number, link in enumerate(read.instruments.links):
            if np.isfinite(read.sigma[at, number]):
                angles = [shown(read.angle[at, number, axis], "deg") for axis in axes]
                sensor = [sensors[number]] if any(sensors) else []
                sigma = shown(read.sigma[at, number], "deg")
                writer.writerow([*still, str(link + 1), *sensor, *angles, sigma, *mark])
    return stream.getvalue()
