"""The entry `reach` of a robot file: how far the arm reaches, as its maker says."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, Field, StringConstraints

from truearm.errors import InputError
from truearm.modeling.formats.entries import STRICT, Positive
from truearm.modeling.parts import Reach, ReachPoint
from truearm.units import sized_si, written


class ReachEntry(BaseModel):
    """A distance from the line of an axis to a point; neither is there where the maker says none."""

    model_config = STRICT
    distance: Positive
    axis: Annotated[str, StringConstraints(strict=True, pattern="^axis-[1-9][0-9]{0,2}$")] | None = Field(
        None, alias="from"
    )
    to: ReachPoint | None = None

    def reach(self, joints: int, length: str, where: str) -> Reach:
        """Return the reach that the entry describes.

        Args:
            joints: How many the robot has.
            length: Unit of the file.
            where: Names the entry in messages.

        Raises:
            InputError: If the robot has no such axis, or one of axis and point is missing.
        """
        distance = sized_si(self.distance, length, f"{where}.distance")
        if self.axis is None and self.to is None:
            return Reach(distance)
        if self.axis is None or self.to is None:
            raise InputError(
                "a reach is from an axis to a point",
                where=where,
                came="no `from`" if self.axis is None else "no `to`",
                cure="Give both, or neither if the maker names none.",
            )
        number = int(self.axis.removeprefix("axis-"))
        if number > joints:
            raise InputError(
                "the robot has no such axis",
                where=f"{where}.from",
                came=self.axis,
                allowed=", ".join(f"axis-{place}" for place in range(1, joints + 1)),
            )
        return Reach(distance, number, self.to)


def reach_entry(reach: Reach) -> dict[str, Any]:
    """Return the entry of a reach, in mm."""
    made: dict[str, Any] = {"distance": written(reach.distance, "mm")}
    return made if reach.point is None else made | {"from": f"axis-{reach.axis}", "to": reach.point}


def reach_summary(reach: Reach | None) -> dict[str, Any]:
    """Return a reach as JSON holds it beside other things."""
    entry = {} if reach is None else reach_entry(reach)
    return {"reach_mm": entry.get("distance"), "reach_from": entry.get("from"), "reach_to": entry.get("to")}
