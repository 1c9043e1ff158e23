"""What results say of a tour, and where its stops are written."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from truearm.modeling.controller import JointsOf
from truearm.modeling.robot import Robot
from truearm.planning.driving.tour import Tour
from truearm.planning.driving.tour_table import home_shown


def ways_beside(table: Path) -> Path:
    """Return where the stops of a plan are written, beside its table."""
    return table.with_name(f"{table.stem}-ways.csv")


def sheet_beside(table: Path) -> Path:
    """Return where the sheet for the operator of a plan is written, beside its table."""
    return table.with_name(f"{table.stem}-sheet.html")


def tour_summary(tour: Tour, robot: Robot, joints_are: JointsOf) -> dict[str, Any]:
    """Return a tour as JSON holds it: lengths in mm, joints in deg or mm as the file counts them."""
    return {
        "moves": len(tour.stops) - 1,
        "via_points": sum(stop.kind == "via" for stop in tour.stops),
        "home": home_shown(tour.home, robot, joints_are),
        "floor_mm": None if tour.floor is None else 1e3 * tour.floor,
        "clearance_mm": 1e3 * tour.clearance,
        "room_mm": 1e3 * tour.room if math.isfinite(tour.room) else None,
        "distances_mm": {what: 1e3 * room for what, room in tour.distances.items()},
    }
