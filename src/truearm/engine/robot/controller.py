"""How a robot's controller counts its joints, and where it has its frames.

Programs and teach pendants speak in the controller's joint positions and frames, which need not be the model's: a joint
may count the other way, from another zero, or together with another joint, as the third of a FANUC robot counts the
second.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError
from truearm.engine.robot.chain import Array
from truearm.engine.robot.transform import IDENTITY, Transform

#: Whose joint positions numbers are: the ``controller``'s, as its pendant shows them, or the ``model``'s.
JointsOf = Literal["controller", "model"]
#: Accepts kinematics of a controller that are another arm's.
OTHER_ARM: Final = "other-kinematics"
#: With what a controller computes poses: nobody said; the table of the robot file; rows of its own, which are known;
#: a model that nobody outside can read.
KinematicsKind = Literal["unknown", "nominal", "own", "proprietary"]


@dataclass(frozen=True)
class ControllerKinematics:
    """With what the controller turns poses into joint positions."""

    kind: KinematicsKind = "unknown"  #: ``nominal`` if it is the table of the robot file, ``own`` if it is `rows`.
    #: Of ``own``: rows of the convention ``hayati``, from the robot's base frame to its flange, one a joint.
    rows: tuple[Mapping[str, float], ...] = ()
    source: str = ""  #: Where this is known from.
    #: What its maker knows the kinematics by, such as checksums, as they were read.
    identity: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Controller:
    """What a robot's controller shows of the joints, and where its frames stand in those of the model.

    ``count_i = zero_i + sign_i * (joint_i + sum_j coupling_ij * joint_j)``
    """

    signs: tuple[int, ...] = ()  #: 1 or -1 for each joint; empty if all are 1.
    #: What the controller counts where the joint is zero, and all that it is coupled with [rad or m]; empty if all are
    #: 0.
    zeros: tuple[float, ...] = ()
    #: For a joint how much of others its count includes, by joint numbers from 1: ``{3: {2: 1.0}}`` if the count of
    #: joint 3 includes joint 2.
    couplings: Mapping[int, Mapping[int, float]] = field(default_factory=dict)
    #: Pulses of the motor per unit of the count [1/rad or 1/m], None where unknown; empty if all are.
    pulses: tuple[float | None, ...] = ()
    base: Transform = IDENTITY  #: ``T_base_controllerbase``: the controller's base frame in the robot's.
    flange: Transform = IDENTITY  #: ``T_flange_controllerflange``: the controller's flange frame in the robot's.
    source: str = ""  #: Where this is known from.
    kinematics: ControllerKinematics = ControllerKinematics()  #: With what the controller computes poses.

    @property
    def counts_known(self) -> bool:
        """Whether it is said how the joints are counted, be it as the model does; a source says so."""
        return self.counts_otherwise or any(self.pulses) or bool(self.source)

    @property
    def counts_otherwise(self) -> bool:
        """Whether the joints are counted otherwise than by the model."""
        return bool(self.signs or any(self.zeros) or self.couplings)

    def coupling(self, count: int) -> Array:
        """Return which joints the counts of `count` joints include, before signs and zeros, ``(count, count)``."""
        matrix = np.eye(count)
        for joint, others in self.couplings.items():
            for other, share in others.items():
                matrix[joint - 1, other - 1] = share
        return matrix

    def from_model(self, joints: Array) -> Array:
        """Return joints ``(n, joints)`` [rad or m] as the controller counts them, from those of the model."""
        counted = joints @ self.coupling(joints.shape[1]).T if self.couplings else joints
        turned = counted * self.signs if self.signs else counted
        return turned + self.zeros if self.zeros else turned

    def to_model(self, counted: Array) -> Array:
        """Return the joints ``(n, joints)`` [rad or m] of the model from joints as the controller counts them."""
        turned = counted - self.zeros if self.zeros else counted
        coupled = turned * self.signs if self.signs else turned
        if not self.couplings:
            return coupled
        # Summed row by row: equal readings give joint positions that are equal to the last digit, wherever they stand.
        undone = np.linalg.inv(self.coupling(counted.shape[1]))
        return np.asarray((undone * coupled[:, None, :]).sum(axis=2), float)

    def check_counts(self, robot: str, where: str | None = None) -> None:
        """Refuse joint positions of a controller of which it is not said how it counts.

        Args:
            robot: Whose controller it is, for the message.
            where: Names the joint positions in it, if they come from a file.

        Raises:
            InputError: If nothing is said.
        """
        if not self.counts_known:
            raise InputError(
                f"it is not known how the controller of {robot} counts the joints",
                where=where,
                allowed="a robot file with the entry controller",
                cure="Say under controller, joints, how its readings follow from the model's joint positions, or give "
                "the source that says they are the same. Or use the model's joint positions, joint_1 [deg] and so on.",
            )

    def to_pulses(self, counted: Array) -> Array:
        """Return the pulses ``(n, joints)`` of the motors at joints ``(n, joints)`` [rad or m] of the controller.

        Raises:
            InputError: If a joint's pulses are not known.
        """
        return counted * self._known_pulses(counted.shape[1])

    def from_pulses(self, pulses: Array) -> Array:
        """Return joints ``(n, joints)`` [rad or m] as the controller counts them, at pulses of the motors.

        Raises:
            InputError: If a joint's pulses are not known.
        """
        return pulses / self._known_pulses(pulses.shape[1])

    def _known_pulses(self, count: int) -> Array:
        pulses = self.pulses or (None,) * count
        missing = [number for number, per_unit in enumerate(pulses, 1) if per_unit is None]
        if missing:
            raise InputError(
                "the number of motor pulses per degree or per mm is not known",
                where=f"joint {', '.join(map(str, missing))}",
                cure="Give pulses_per_degree or pulses_per_mm in the robot file, under controller, joints.",
            )
        return np.array(pulses, dtype=float)


#: A controller that counts joints and has its frames as the model does.
AS_THE_MODEL: Final = Controller()
