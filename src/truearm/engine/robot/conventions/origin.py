"""URDF joints: an origin in the parent link and an axis of any direction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from truearm.engine.robot.chain import Element
from truearm.engine.robot.conventions.convention import Convention, JointKind, direction
from truearm.engine.robot.conventions.displaced import joint, small_turns


@dataclass(frozen=True)
class OriginConvention(Convention):
    """A URDF joint: its origin in the parent link and an axis of any direction.

    The origin's angles stay as they are, because roll and yaw fall together where pitch is 90 deg, which URDF files
    like; small rotations behind them are the parameters, ``rx_i``, ``ry_i``, ``rz_i`` without the one that lies
    closest to the joint axis, where the joint zero does the same.
    """

    @property
    def vectors(self) -> tuple[str, ...]:
        """The joint's axis."""
        return ("axis",)

    def row_units(self, kind: JointKind) -> dict[str, str]:
        """Return the columns of a URDF joint, with their SI units."""
        return super().row_units("revolute") | {f"axis_{a}": "1" for a in "xyz"}

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the origin, its small rotations and the joint."""
        axis = direction(row, "axis")
        place = [Element(m, row.get(c, 0.0), f"{c}_{number}") for c, m in self.link[:3]]
        turn = [Element(m, row.get(c, 0.0)) for c, m in self.link[3:]]
        return (*place, *turn, *small_turns(number, axis), joint(self.zero(kind), number, kind, axis))
