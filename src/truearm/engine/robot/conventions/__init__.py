"""Kinematic conventions: each says which elementary transforms a link is made of, and in which order.

============================ ============================================ =================================
convention                   link i                                       source
============================ ============================================ =================================
``standard-dh``              Rz(theta) Tz(d) Tx(a) Rx(alpha)              Denavit and Hartenberg 1955
``modified-dh``              Rx(alpha) Tx(a) Rz(theta) Tz(d)              Craig 1986
``hayati``                   Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)     Hayati 1983
``modified-hayati``          Rx(alpha) Ry(beta) Tx(a) Rz(theta) Tz(d)     Patel, section 3.2
``s-model``                  Rz(theta) Tz(d) Tx(a) Rx(alpha) Rz(gamma)    Stone, Kinematic Modeling,
                             Tz(b)                                        Identification and Control, 1987
``cpc``                      Rz(theta) R(b) small Rx Ry, Tx(l_x) Ty(l_y); Zhuang, Roth and Hamano 1992
                             the last link also Rz(beta) and Tz(l_z)
``mcpc``                     Rz(theta) Rx(alpha) Ry(beta) Tx(x) Ty(y);    Zhuang, Wang and Roth 1993
                             the last link also Rz(gamma) and Tz(z)
``zero-reference``           Trans(p) small R, R(axis, theta) Trans(-p)   Mooring 1983; Gupta 1986
``product-of-exponentials``  exp(xi theta), the same with p = w x v       Brockett 1984; Okamura, Park 1996
``translations``             Tx(x) Ty(y) Tz(z) Rx(rx) Ry(ry) Rz(theta)    KR5 paper, equation 1
``joint-errors``             Tx Ty Tz Rx Ry Rz as designed, errors Tx(ex)  KR5 paper, equations 5 and 7
                             Ty(ey) Tz(ez) Rx(egamma) Ry(ebeta), Rz(theta)
``urdf``                     Tx Ty Tz Rz(yaw) Ry(pitch) Rx(roll), then     ROS, URDF specification
                             small Rx Ry Rz, then the joint's own axis
============================ ============================================ =================================

Nubiola's section 1.4 swaps the names of standard and modified DH; the table above has them right. Hayati's beta
is what a small angle between two nominally parallel axes needs: without it a DH link would have to jump to a
common normal kilometres away. Where a `hayati` link gives d as well as beta, the d of two parallel axes cannot be
told apart from its neighbour's; identification names that. Stone's gamma and b say where on the next axis a link's
frame stands; the a and alpha of the S-model are still those of the common normal, and jump with it. MCPC's beta is
an angle to the next axis, not Hayati's; it loses alpha where the next axis lies along x.
"""

from __future__ import annotations

from typing import Final

from truearm.engine.robot.chain import Motion
from truearm.engine.robot.conventions.convention import JOINT, Convention, JointKind, parallel_joints_without_beta
from truearm.engine.robot.conventions.cpc import CpcConvention
from truearm.engine.robot.conventions.exponentials import ExponentialsConvention
from truearm.engine.robot.conventions.joint_errors import JointErrorsConvention
from truearm.engine.robot.conventions.origin import OriginConvention
from truearm.engine.robot.conventions.zero_reference import ZeroReferenceConvention

__all__ = ["CONVENTIONS", "JOINT", "Convention", "JointKind", "convention", "parallel_joints_without_beta"]

_DH: Final[tuple[tuple[str, Motion], ...]] = ((JOINT, "Rz"), ("d", "Tz"), ("a", "Tx"), ("alpha", "Rx"))
_POINT: Final[tuple[tuple[str, Motion], ...]] = (("x", "Tx"), ("y", "Ty"), ("z", "Tz"))

CONVENTIONS: Final = (
    Convention("standard-dh", _DH),
    Convention("modified-dh", (("alpha", "Rx"), ("a", "Tx"), (JOINT, "Rz"), ("d", "Tz"))),
    Convention("hayati", (*_DH, ("beta", "Ry")), optional=("beta",)),
    Convention(
        "modified-hayati",
        (("alpha", "Rx"), ("beta", "Ry"), ("a", "Tx"), (JOINT, "Rz"), ("d", "Tz")),
        optional=("beta",),
    ),
    Convention("s-model", (*_DH, ("gamma", "Rz"), ("b", "Tz"))),
    CpcConvention(
        "cpc", ((JOINT, "Rz"), ("beta", "Rz"), ("l_x", "Tx"), ("l_y", "Ty"), ("l_z", "Tz")), optional=("beta", "l_z")
    ),
    Convention(
        "mcpc", ((JOINT, "Rz"), ("alpha", "Rx"), ("beta", "Ry"), ("gamma", "Rz"), *_POINT), optional=("gamma", "z")
    ),
    ZeroReferenceConvention("zero-reference", _POINT),
    ExponentialsConvention("product-of-exponentials", ()),
    Convention("translations", (*_POINT, ("rx", "Rx"), ("ry", "Ry"), (JOINT, "Rz"))),
    JointErrorsConvention(
        "joint-errors",
        (
            *(*_POINT, ("rx", "Rx"), ("ry", "Ry"), ("rz", "Rz")),
            *(("ex", "Tx"), ("ey", "Ty"), ("ez", "Tz"), ("egamma", "Rx"), ("ebeta", "Ry")),
            (JOINT, "Rz"),
        ),
    ),
    OriginConvention("urdf", (*_POINT, ("yaw", "Rz"), ("pitch", "Ry"), ("roll", "Rx"))),
)


def convention(name: str) -> Convention:
    """Return the registered convention called `name`; KeyError if there is none."""
    return {c.name: c for c in CONVENTIONS}[name]
