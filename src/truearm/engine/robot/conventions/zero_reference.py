"""The zero-reference model: every joint axis by its direction and one of its points, robot at zero joint positions.

Source: B. W. Mooring, "The effect of joint axis misalignment on robot positioning accuracy", ASME Computers in
Engineering, 1983; K. C. Gupta, "Kinematic analysis of manipulators using the zero reference position description",
International Journal of Robotics Research 5(2), 1986. The pose is ``D_1(q_1) ... D_n(q_n) M`` with ``D = Trans(p) R(u,
q) Trans(-p)``: u and p are direction and point of the axis in the base frame and M is the flange, all at zero joint
positions. No link frame has to be laid anywhere: at zero joint positions every link's frame is the base frame.

A parameter stands in the chain once, so what identification changes are slides and small turns before the joint,
``Trans(p + dp) Rx(rx) Ry(ry) R(u, q) Trans(-p)`` without those closest to the axis, which move it nowhere. They carry
everything beyond along, as a bent link does, whereas the published numbers of one joint leave the other axes where
they are. The family of robots is the same; :func:`truearm.engine.robot.conversion.converted` to this convention again
gives the published directions and points of a calibrated robot.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from truearm.engine.robot.chain import Element
from truearm.engine.robot.conventions.convention import Convention, JointKind, direction
from truearm.engine.robot.conventions.displaced import joint, slides_across, slides_back, small_turns


@dataclass(frozen=True)
class ZeroReferenceConvention(Convention):
    """Links ``Trans(x, y, z) small turns R(axis, theta) Trans(-x, -y, -z)`` in directions of the base frame."""

    @property
    def vectors(self) -> tuple[str, ...]:
        """The direction of the axis."""
        return ("axis",)

    def row_units(self, kind: JointKind) -> dict[str, str]:
        """Return the columns of a joint, with their SI units."""
        return super().row_units("revolute") | {f"axis_{a}": "1" for a in "xyz"}

    def fault(self, row: Mapping[str, float], kind: JointKind) -> str | None:
        """Refuse a joint without an axis."""
        return None if "axis_x" in row else "the joint has no axis: give its direction in the base frame"

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the way to the axis, the joint, and the way back."""
        return displaced_joint(number, kind, direction(row, "axis"), [row.get(a, 0.0) for a in "xyz"], self.zero(kind))


def displaced_joint(
    number: int, kind: JointKind, axis: tuple[float, float, float], point: list[float], zero: str
) -> tuple[Element, ...]:
    """Return the elements of a joint about an axis of the base frame, as given at zero joint positions.

    Args:
        axis, point: Unit vector along the axis and a point of it [m], in the base frame.
        zero: Column that is the joint's zero.
    """
    return (
        *slides_across(number, axis, point),
        *small_turns(number, axis),
        joint(zero, number, kind, axis),
        *slides_back(point),
    )
