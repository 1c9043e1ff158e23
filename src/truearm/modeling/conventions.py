"""Kinematic conventions: each says which elementary transforms a link is made of, and in which order.

============================ ============================================ =================================
convention                   link i                                       source
============================ ============================================ =================================
``standard-dh``              Rz(theta) Tz(d) Tx(a) Rx(alpha)              Denavit and Hartenberg 1955
``modified-dh``              Rx(alpha) Tx(a) Rz(theta) Tz(d)              Craig 1986
``hayati``                   Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)     Hayati 1983
``modified-hayati``          Rx(alpha) Ry(beta) Tx(a) Rz(theta) Tz(d)     Patel, section 3.2
``translations``             Tx(x) Ty(y) Tz(z) Rx(rx) Ry(ry) Rz(theta)    KR5 paper, equation 1
``urdf``                     Tx Ty Tz Rz(yaw) Ry(pitch) Rx(roll), then     ROS, URDF specification
                             small Rx Ry Rz, then the joint's own axis
============================ ============================================ =================================

Nubiola's section 1.4 swaps the names of standard and modified DH; the table above has them right. Hayati's beta
is what a small angle between two nominally parallel axes needs: without it a DH link would have to jump to a
common normal kilometres away. Where a `hayati` link gives d as well as beta, the d of two parallel axes cannot be
told apart from its neighbour's; identification names that.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

from truearm.modeling.chain import Element, Motion

JointKind = Literal["revolute", "prismatic"]
JOINT: Final = "theta_offset"


@dataclass(frozen=True)
class Convention:
    """The order of a link's elementary transforms.

    Attributes
    ----------
    name
        As robot files spell it.
    link
        Column name and motion of each transform, in order; the joint turns at ``theta_offset``.
    optional
        Columns that a link has only when its row gives them.
    """

    name: str
    link: tuple[tuple[str, Motion], ...]
    optional: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        """Column names of a link's row, in the order of the transforms."""
        return tuple(column for column, _ in self.link)

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

    def zero(self, kind: JointKind) -> str:
        """Return the column that is the zero of a joint of this kind."""
        return JOINT if kind == "revolute" else self.slide

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the elements of link `number` (from 1); its joint reads variable ``number - 1``.

        Parameters
        ----------
        row
            Nominal value of each column [m and rad]; absent columns are zero.
        """
        link = self.link if self.slide in self.columns or kind == "revolute" else (*self.link, (self.slide, "Tz"))
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


@dataclass(frozen=True)
class OriginConvention(Convention):
    """A URDF joint: its origin in the parent link and an axis of any direction.

    The origin's angles stay as they are, because roll and yaw fall together where pitch is 90 deg, which URDF files
    like; small rotations behind them are the parameters, ``rx_i``, ``ry_i``, ``rz_i`` without the one that lies
    closest to the joint axis, where the joint zero does the same.
    """

    def row_units(self, kind: JointKind) -> dict[str, str]:
        """Return the columns of a URDF joint, with their SI units."""
        return super().row_units("revolute") | {f"axis_{a}": "1" for a in "xyz"}

    def zero(self, kind: JointKind) -> str:
        """Return the name of the joint's own zero."""
        return JOINT if kind == "revolute" else "d_offset"

    def elements(self, number: int, row: Mapping[str, float], kind: JointKind) -> tuple[Element, ...]:
        """Build the origin, its small rotations and the joint."""
        axis = [row.get(f"axis_{a}", default) for a, default in zip("xyz", (0.0, 0.0, 1.0), strict=True)]
        length = math.hypot(*axis)  # files may round it
        along = max("xyz", key=lambda a: abs(axis["xyz".index(a)]))
        place = [Element(m, row.get(c, 0.0), f"{c}_{number}") for c, m in self.link[:3]]
        turn = [Element(m, row.get(c, 0.0)) for c, m in self.link[3:]]
        small = [Element(m, parameter=f"r{a}_{number}") for a, m in _TURNS if a != along]
        joint = Element(
            "R" if kind == "revolute" else "T",
            parameter=f"{self.zero(kind)}_{number}",
            variable=number - 1,
            axis=(axis[0] / length, axis[1] / length, axis[2] / length),
        )
        return (*place, *turn, *small, joint)


_TURNS: Final[tuple[tuple[str, Motion], ...]] = (("x", "Rx"), ("y", "Ry"), ("z", "Rz"))
_DH: Final[tuple[tuple[str, Motion], ...]] = ((JOINT, "Rz"), ("d", "Tz"), ("a", "Tx"), ("alpha", "Rx"))

CONVENTIONS: Final = (
    Convention("standard-dh", _DH),
    Convention("modified-dh", (("alpha", "Rx"), ("a", "Tx"), (JOINT, "Rz"), ("d", "Tz"))),
    Convention("hayati", (*_DH, ("beta", "Ry")), optional=("beta",)),
    Convention(
        "modified-hayati",
        (("alpha", "Rx"), ("beta", "Ry"), ("a", "Tx"), (JOINT, "Rz"), ("d", "Tz")),
        optional=("beta",),
    ),
    Convention(
        "translations",
        (("x", "Tx"), ("y", "Ty"), ("z", "Tz"), ("rx", "Rx"), ("ry", "Ry"), (JOINT, "Rz")),
    ),
    OriginConvention("urdf", (("x", "Tx"), ("y", "Ty"), ("z", "Tz"), ("yaw", "Rz"), ("pitch", "Ry"), ("roll", "Rx"))),
)


def convention(name: str) -> Convention:
    """Return the registered convention called `name`; KeyError if there is none."""
    return {c.name: c for c in CONVENTIONS}[name]


def parallel_joints_without_beta(convention_: Convention, rows: list[Mapping[str, float]]) -> list[tuple[int, int]]:
    """Return the pairs of neighbouring joints (from 1) whose axes are parallel while their link has no beta.

    For standard forms the alpha between joints i and i + 1 stands in row i, for modified forms in row i + 1.
    """
    if "alpha" not in convention_.columns:
        return []
    first = 0 if convention_.columns[0] == JOINT else 1
    return [
        (i + 1, i + 2)
        for i in range(len(rows) - 1)
        for row in [rows[i + first]]
        if abs(math.sin(row.get("alpha", 0.0))) < 1e-9 and "beta" not in row
    ]
