"""An external force and moment at the tool, as machining, screwing and pressing make them.

It is what acts *on* the tool: a drill that pushes down is pushed up. The data's ``force_x`` to ``moment_z`` have the
same sign (:class:`truearm.engine.robot.postures.Postures`), but act at the flange's origin. Here the force acts at the
tool's point, which goes along with the bent arm, and its axes stay those of the base, the world or the controller's
base, or turn with the tool.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from truearm.engine.base.arrays import number_array
from truearm.engine.base.errors import InputError, did_you_mean, wrong_kind
from truearm.engine.base.units import as_number
from truearm.engine.robot.chain import Array, ForwardKinematics
from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.transform import IDENTITY, Transform

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot

#: Whose axes force and moment are given in: the robot's base, the tool, the world (the instrument's frame), or the
#: base frame of the robot's controller.
WrenchFrame = Literal["base", "tool", "world", "controller"]
WRENCH_FRAMES: Final[tuple[WrenchFrame, ...]] = ("base", "tool", "world", "controller")
#: Units of a force and of a moment, in N and in N m.
FORCE_UNITS: Final = {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605}
MOMENT_UNITS: Final = {"N m": 1.0, "Nm": 1.0, "N mm": 1e-3, "Nmm": 1e-3}
#: No tool is pushed harder [N, N m].
_LARGEST: Final = 1e5
_EXAMPLE: Final = "0,0,80,0,0,1.5 or 0N,0N,80N,0Nm,0Nm,1.5Nm"
#: Acceleration that makes a rated load a force [m/s^2].
STANDARD_GRAVITY: Final = 9.80665


@dataclass(frozen=True)
class Wrench:
    """What acts on the tool."""

    force: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: [N].
    moment: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: About the tool's point [N m].
    frame: WrenchFrame = "base"  #: Whose axes both are given in.
    tool: Transform = IDENTITY  #: The tool on the flange: the force acts at its origin.

    def __post_init__(self) -> None:
        """Refuse what is no number, is too large, or is in no known frame; keep plain numbers."""
        for name in ("force", "moment"):
            numbers = number_array(getattr(self, name), name, (3,), largest=_LARGEST)
            object.__setattr__(self, name, tuple(numbers.tolist()))
        if self.frame not in WRENCH_FRAMES:
            raise InputError(
                "there is no frame of this name",
                parameter="frame",
                came=self.frame,
                allowed=", ".join(WRENCH_FRAMES),
                cure=did_you_mean(self.frame, WRENCH_FRAMES) if isinstance(self.frame, str) else None,
            )

    @property
    def text(self) -> str:
        """As :meth:`of_text` reads it."""
        return ",".join([*(f"{v:.15g}N" for v in self.force), *(f"{v:.15g}Nm" for v in self.moment)])

    @property
    def acts(self) -> bool:
        """Whether there is anything of it."""
        return any(self.force) or any(self.moment)

    def at(self, tool: Transform) -> Wrench:
        """Return it at another tool."""
        return replace(self, tool=tool)

    @classmethod
    def of(cls, wrench: object, frame: WrenchFrame = "base", parameter: str = "wrench") -> Wrench:
        """Return the wrench of a text, see :meth:`of_text`, or of six numbers [N, N m]."""
        if isinstance(wrench, str):
            return cls.of_text(wrench, frame, parameter)
        if isinstance(wrench, Sequence | np.ndarray):
            allowed = "six numbers: a force [N], then a moment [N m]"
            fx, fy, fz, mx, my, mz = number_array(wrench, parameter, (6,), allowed=allowed, largest=_LARGEST).tolist()
            return cls((fx, fy, fz), (mx, my, mz), frame)
        raise wrong_kind("a wrench belongs here", wrench, parameter, f"a Wrench, six numbers, or a text: {_EXAMPLE}")

    @classmethod
    def of_text(cls, text: str, frame: WrenchFrame = "base", parameter: str = "wrench") -> Wrench:
        """Return the wrench that a text such as ``0,0,80,0,0,1.5`` names: in N and N m, or with units.

        Raises:
            InputError: If these are not six numbers, or a unit is none of a force or moment.
        """
        parts = text.split(",")
        if len(parts) != 6:
            raise InputError(
                "three forces and three moments belong here", parameter=parameter, came=text, allowed=_EXAMPLE
            )
        numbers = [
            _quantity(part, FORCE_UNITS if number < 3 else MOMENT_UNITS, parameter) for number, part in enumerate(parts)
        ]
        return cls.of(numbers, frame, parameter)


def _quantity(text: str, units: dict[str, float], parameter: str) -> float:
    match = re.fullmatch(r"\s*(?P<number>[^a-zA-Z]*?(?:[eE][-+0-9]+)?)\s*(?P<unit>[a-zA-Z][a-zA-Z ]*?)?\s*", text)
    number = None if match is None else as_number(match["number"].strip())
    unit = None if match is None else match["unit"]
    if match is None or number is None:
        raise InputError("a number belongs here", parameter=parameter, came=text, allowed=_EXAMPLE)
    if unit is not None and unit not in units:
        raise InputError(
            f"this is no unit of a {'force' if units is FORCE_UNITS else 'moment'}",
            parameter=parameter,
            came=text,
            allowed=", ".join(units),
            cure=f"A number without a unit is in {next(iter(units))}.",
        )
    return number * (1.0 if unit is None else units[unit])


def in_base(robot: Robot, wrench: Wrench) -> tuple[Array, Array]:
    """Return force and moment in the axes of the robot's base, ``(3,)`` each; the frame must not be the tool's.

    Raises:
        InputError: If they are in the controller's axes, and it is not known where those are.
    """
    turned = np.eye(3)
    if wrench.frame == "world":
        turned = robot.base.rotation.T
    elif wrench.frame == "controller":
        if robot.controller == AS_THE_MODEL:
            raise InputError(
                f"it is not known where the controller of {robot.name} has its frames",
                parameter="wrench_frame",
                allowed="a robot file with the entry controller",
                cure="Say under controller where its base is, or give the force in another frame.",
            )
        turned = robot.controller.base.rotation
    return turned @ np.array(wrench.force), turned @ np.array(wrench.moment)


def wrench_on_flange(robot: Robot, wrench: Wrench, flange: ForwardKinematics) -> Array:
    """Return what a wrench at the tool is on the flange: about its origin and in the axes of the base, ``(6, n)``.

    Args:
        flange: Kinematics of the arm from the base to the flange as it stands.
    """
    R = np.moveaxis(flange.matrix(), (-2, -1), (0, 1))
    arm = np.einsum("ijn,j->in", R, np.array(wrench.tool.translation))
    if wrench.frame == "tool":
        force, moment = (
            np.einsum("ijn,j->in", R, wrench.tool.rotation @ np.array(part)) for part in (wrench.force, wrench.moment)
        )
    else:
        force, moment = (np.repeat(part[:, None], R.shape[2], axis=1) for part in in_base(robot, wrench))
    return np.concatenate([force, moment + np.cross(arm, force, axis=0)])


def refuse_pushed(robot: Robot) -> None:
    """Refuse to write a robot on whose tool something acts: no file would hold that.

    Raises:
        InputError: If there is anything.
    """
    if robot.wrench is not None:
        raise InputError(
            "no file of a robot holds an external force",
            parameter="robot",
            where=robot.name,
            came=robot.wrench.text,
            cure="Take it away first: robot.with_wrench(None).",
        )
