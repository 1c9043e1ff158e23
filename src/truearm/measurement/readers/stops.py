"""Where an arm stops right before each configuration: the columns ``approach_i`` of a plan."""

from __future__ import annotations

import re
from typing import Final

from truearm.errors import InputError
from truearm.measurement.readers.cells import Cells
from truearm.measurement.readers.rows import Configurations, found_configurations
from truearm.units import ANGLE_UNITS, LENGTH_UNITS, checked_unit

STOP_COLUMN: Final = re.compile(r"(?P<name>approach_[1-9][0-9]{0,3})\s*(?:\[(?P<unit>[^\]]*)\])?")


def stops_in(cells: Cells, found: Configurations) -> Configurations | None:
    """Return the joint positions of these stops, counted as those of the configurations; None where there are none.

    Raises:
        InputError: If some columns are missing, have no unit or are there twice, or a cell cannot be used.
    """
    where = f"{cells.source}, line {cells.header}"
    there: dict[str, tuple[int, str]] = {}
    for place, heading in enumerate(cells.names):
        match = STOP_COLUMN.fullmatch(heading)
        if match:
            at = f"{where}, column {place + 1}, {heading}"
            if match["name"] in there:
                raise InputError("the column appears twice", where=at, cure="Remove one of them.")
            there[match["name"]] = place, checked_unit(match["unit"], (*ANGLE_UNITS, *LENGTH_UNITS), at)
    if not there:
        return None
    names = [f"approach_{number}" for number in range(1, found.joints.shape[1] + 1)]
    if {*there} != {*names}:
        raise InputError(
            "the stops before the configurations are not those of the joints",
            where=where,
            came=", ".join(there),
            allowed=", ".join(names),
            cure="Give one to each joint, or leave all of them out.",
        )
    places, units = zip(*(there[name] for name in names), strict=True)
    return found_configurations(cells, [found.labels[at] for at in found.of_row], places, units, found.joints_are)
