"""Rows of the canonical CSV that have to do with fixtures: what stands beside the robot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from truearm.errors import InputError, nearest_names
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.cells import Cells
from truearm.measurement.readers.rows import Readings
from truearm.modeling.chain import Array

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
    held = [position, *(np.isfinite(values) for values in lengths.values())]
    for row in np.flatnonzero(np.sum(held, axis=0) > 1).tolist():
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
                raise InputError(
                    "a distance must be above zero",
                    where=cells.place(row, places[name]),
                    came=cells.columns[places[name]][row],
                    allowed="a number above 0",
                    cure="Of a target held at a point give x, y and z from that point, 0, 0, 0.",
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
        placed, apart = bool(np.isfinite(position[row]).any()), bool(np.isfinite(distance[row]))
        over = bool(np.isfinite(height[row]))
        for one in filter(None, (name, other)):
            if one not in data.fixtures:
                near = nearest_names(one, data.fixtures)
                raise InputError(
                    "nothing is measured against this fixture",
                    where=f"{where}, column {'target' if one == name else 'fixture'}",
                    came=one,
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
            raise InputError(
                "a distance must be above zero",
                where=cells.place(row, columns["distance"][0]),
                came=cells.columns[columns["distance"][0]][row],
                allowed="a number above 0",
            )
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
