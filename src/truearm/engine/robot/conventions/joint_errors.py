"""Errors of the joints' assembly: what a link was designed to be, and five small errors where its joint is seated.

Source: KR5 paper, equations 1, 5 and 7. A link is ``P E Rz(theta)``: ``P = Trans(x, y, z) Rx Ry Rz`` as designed and
``E = Trans(ex, ey, ez) Rx(egamma) Ry(ebeta)``. E has no turn about the joint axis, which mastering takes care of:
that is the joint's zero. Only E and the zero are parameters. What one E does its neighbour can partly do as well, so
that not all of them can be told apart, whatever is measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from truearm.engine.robot.chain import Element
from truearm.engine.robot.conventions.convention import Convention, JointKind


@dataclass(frozen=True)
class JointErrorsConvention(Convention):
    """Links ``Tx Ty Tz Rx Ry Rz`` as designed, ``Tx(ex) Ty(ey) Tz(ez) Rx(egamma) Ry(ebeta)``, and the joint."""

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the design, which stays, the errors and the joint."""
        elements = super().elements(number, row, kind)
        return tuple(replace(e, parameter=None) for e in elements[:6]) + elements[6:]
