"""What every joint effect can be asked."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from truearm.modeling.chain import Array
from truearm.modeling.conventions import JointKind


@dataclass(frozen=True)
class Effect(ABC):
    """A small deflection of every joint about or along its own axis.

    Parameters
    ----------
    joints
        Kind of each joint of the robot.
    """

    name: ClassVar[str]
    joints: tuple[JointKind, ...]

    @property
    @abstractmethod
    def nominal(self) -> Mapping[str, float]:
        """Parameter names and the values at which the effect does nothing."""

    @abstractmethod
    def deflection(self, q: Array, values: Mapping[str, float | Array]) -> Array:
        """Return what is added to the joint variables `q` [rad or m], ``(joints, ..., n)``."""

    @abstractmethod
    def derivative(self, q: Array, values: Mapping[str, float | Array]) -> Mapping[str, Mapping[int, Array]]:
        """Return, for each parameter, its derivative of the deflection of the joints it acts on, each ``(n,)``."""
