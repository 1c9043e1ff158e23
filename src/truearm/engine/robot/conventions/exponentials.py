"""Product of exponentials: every joint by its twist in the base frame, robot at zero joint positions.

Source: R. W. Brockett, "Robotic manipulators and the product of exponentials formula", 1984; K. Okamura and F. C. Park,
"Kinematic calibration using the product of exponentials formula", Robotica 14(4), 1996. The pose is
``exp(xi_1 q_1) ... exp(xi_n q_n) M`` with the flange M at zero joint positions. A joint that turns has the twist
``xi = (w, v)`` with the unit vector w along its axis and ``v = -w x p`` for any point p of it; one that slides has
``w = 0`` and the unit vector v. (Twists are angular part first.)

The exponential of a turning twist is ``Trans(p) R(w, q) Trans(-p)`` with ``p = w x v``, the point of the axis nearest
to the base frame's origin, so the chain and the parameters are those of :mod:`.zero_reference` at that point. To
first order they change the twist by ``dw = dr x w`` and ``dv = -dw x p - w x dp``, dr the small turns and dp the
slides, which keep ``|w| = 1`` and ``w . v = 0`` of themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from truearm.engine.robot.chain import Element
from truearm.engine.robot.conventions.convention import Convention, JointKind, direction
from truearm.engine.robot.conventions.zero_reference import displaced_joint

#: How far a turning twist may advance along its axis [m per rad] by rounding of the file.
_PITCH = 1e-6


@dataclass(frozen=True)
class ExponentialsConvention(Convention):
    """Links ``exp(xi theta)``, the twist in the base frame."""

    @property
    def vectors(self) -> tuple[str, ...]:
        """Angular and linear part of the twist."""
        return ("w", "v")

    def row_units(self, kind: JointKind) -> dict[str, str]:
        """Return the columns of a joint, with their SI units."""
        if kind == "prismatic":
            return {f"v_{a}": "1" for a in "xyz"}
        return {f"w_{a}": "1" for a in "xyz"} | {f"v_{a}": "m" for a in "xyz"}

    def fault(self, row: Mapping[str, float], kind: JointKind) -> str | None:
        """Refuse a twist without its direction, and one that turns and slides at once."""
        if kind == "prismatic":
            return None if "v_x" in row else "the joint has no twist: give its direction v"
        if "w_x" not in row:
            return "the joint has no twist: give its direction w"
        pitch = sum(row[f"w_{a}"] * row.get(f"v_{a}", 0.0) for a in "xyz")
        if abs(pitch) > _PITCH:
            return f"a joint that turns does not slide: w . v must be 0, here it is {pitch * 1e3:.6g} mm"
        return None

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the exponential around the point of the axis that is nearest to the origin."""
        if kind == "prismatic":
            return displaced_joint(number, kind, direction(row, "v"), [0.0, 0.0, 0.0], self.zero(kind))
        w, v = direction(row, "w"), [row.get(f"v_{a}", 0.0) for a in "xyz"]
        point = [w[1] * v[2] - w[2] * v[1], w[2] * v[0] - w[0] * v[2], w[0] * v[1] - w[1] * v[0]]
        return displaced_joint(number, kind, w, point, self.zero(kind))
