"""A kinematic convention: which elementary transforms a link is made of, and in which order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from truearm.engine.robot.chain import Element, Motion

JointKind = Literal["revolute", "prismatic"]
JOINT: Final = "theta_offset"


@dataclass(frozen=True)
class Convention:
    """The order of a link's elementary transforms."""

    name: str  #: As robot files spell it.
    #: Column name and motion of each transform, in order; the joint turns at ``theta_offset``.
    link: tuple[tuple[str, Motion], ...]
    optional: tuple[str, ...] = ()  #: Columns that a link has only when its row gives them.

    @property
    def columns(self) -> tuple[str, ...]:
        """Column names of a link's row, in the order of the transforms."""
        return tuple(column for column, _ in self.link)

    @property
    def vectors(self) -> tuple[str, ...]:
        """Entries that a row gives as three numbers; the row holds them as ``v_x``, ``v_y``, ``v_z``."""
        return ()

    @property
    def slide(self) -> str:
        """The column a prismatic joint moves: d, or an extra slide along the joint axis."""
        return "d" if "d" in self.columns else "d_offset"

    def row_units(self, kind: JointKind) -> dict[str, str]:
        """Return the columns that a joint's row may have, with their SI units."""
        units = {column: "rad" if motion[0] == "R" else "m" for column, motion in self.link}
        if kind == "prismatic":
            units.setdefault(self.slide, "m")
        return units

    def fault(self, row: Mapping[str, float], kind: JointKind) -> str | None:
        """Say why a row does not describe a joint of this kind, if it does not."""
        return None

    def zero(self, kind: JointKind) -> str:
        """Return the column that is the zero of a joint of this kind."""
        return JOINT if kind == "revolute" else self.slide

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the elements of link `number` (from 1); its joint reads variable ``number - 1``.

        Args:
            row: Nominal value of each column [m and rad]; absent columns are zero.
        """
        link = list(self.link)
        if kind == "prismatic" and self.slide not in self.columns:
            link.insert(self.columns.index(JOINT) + 1, (self.slide, "Tz"))
        moving = self.zero(kind)
        return tuple(
            Element(
                motion,
                value=row.get(column, 0.0),
                parameter=f"{column}_{number}",
                variable=number - 1 if column == moving else None,
            )
            for column, motion in link
            if column in row or column not in self.optional
        )


def direction(row: Mapping[str, float], name: str) -> tuple[float, float, float]:
    """Return a row's vector as a unit vector, z if the row has none; files may round it."""
    x, y, z = (row.get(f"{name}_{a}", default) for a, default in zip("xyz", (0.0, 0.0, 1.0), strict=True))
    length = math.hypot(x, y, z)
    return x / length, y / length, z / length


def parallel_joints_without_beta(convention_: Convention, rows: list[Mapping[str, float]]) -> list[tuple[int, int]]:
    """Return the pairs of neighbouring joints (from 1) whose axes are parallel while their link has no beta.

    For standard forms the alpha between joints i and i + 1 stands in row i, for modified forms in row i + 1.
    """
    columns = convention_.columns
    if "alpha" not in columns or ("beta" in columns and "beta" not in convention_.optional):
        return []
    first = 0 if columns[0] == JOINT else 1
    return [
        (i + 1, i + 2)
        for i in range(len(rows) - 1)
        for row in [rows[i + first]]
        if abs(math.sin(row.get("alpha", 0.0))) < 1e-9 and "beta" not in row
    ]
