"""Which parameters a model frees. Base, targets and fixtures are always free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.robot.effects.fourier import HARMONICS, Fourier
from truearm.engine.robot.effects.joint_curve import HIGHEST, PRIOR, JointCurve, curve_names
from truearm.engine.robot.parameters import SCALE_GROUP, FreeParameters, Group
from truearm.engine.robot.robot import Robot


@dataclass(frozen=True)
class Model:
    """A family of robots to look in."""

    name: str  #: As the command line spells it.
    summary: str  #: What it frees, in words.
    groups: tuple[Group, ...]  #: Parameter groups that are free besides base, targets, fixtures and the effects' own.
    effects: tuple[str, ...] = ()  #: Joint effects that are added and free.
    #: Joint effects that could have been, had the data said that they help; bounds may name their parameters.
    tried: tuple[str, ...] = ()
    weighed: bool = False  #: Whether the data tell how large each effect is.
    highest: int = HIGHEST  #: Periods in a turn of the term of the joints' curves that errs most often.

    def also(self, effects: Sequence[str]) -> Model:
        """Return the model with some joint effects added."""
        added = [name for name in dict.fromkeys(effects) if name not in self.effects]
        if not added:
            return self
        return replace(self, summary=f"{self.summary}; also {', '.join(added)}", effects=(*self.effects, *added))

    def prepared(self, robot: Robot) -> Robot:
        """Return the robot with the model's effects, every parameter starting anew from its current value.

        Curves of joints that are free start from zero: what is expected of them is found from the data, and those
        that the robot has were found from data too, perhaps from the same.
        """
        known = robot.with_effects(self.effects)
        anew = JointCurve.name if JointCurve.name in self.effects else None
        return known.with_parameters(
            replace(p.restarted(0.0), prior=PRIOR) if p.group == anew else p.restarted(p.value)
            for p in known.known.values()
        )

    def free(self, robot: Robot) -> FreeParameters:
        """Return the free parameters of a robot, base first, targets and fixtures last."""
        groups = ("base", "target", "fixture", SCALE_GROUP, *self.groups, *self.effects)
        lowest = max(HARMONICS) if Fourier.name in self.effects else 0  # these are in the Fourier series
        turns = range(1, len(robot.joints) + 1)
        fixed = {name for n in turns for k, name in enumerate(curve_names(n)) if not lowest <= k // 2 < self.highest}
        free = (p for p in robot.parameters.values() if p.group in groups and p.name not in fixed)
        return FreeParameters(tuple(free))


_LEVEL_2: Final[tuple[Group, ...]] = ("joint zero", "geometry")

FRAMES: Final = Model("frames", "where the robot stands and where its targets are", ())
MODELS: Final = (
    Model("offsets", "joint zeros", ("joint zero",)),
    Model("joints", "joint zeros and gains (level 1)", ("joint zero",), ("gain",)),
    Model("geometric", "every geometric parameter and the joint zeros (level 2)", _LEVEL_2),
    Model("elastic", "geometric, and linear compliance of the joints (level 3)", _LEVEL_2, ("compliance",)),
    Model(
        "tilting",
        "elastic, and clearance tilt and backlash by the sign of the load",
        _LEVEL_2,
        ("compliance", "clearance", "backlash"),
    ),
    Model(
        "full",
        "geometric, and hardening compliance, Fourier series, backlash and approach direction of the joints",
        _LEVEL_2,
        ("compliance", "hardening", "fourier", "backlash", "approach"),
    ),
)


def named_model(name: str) -> Model:
    """Return the model of this name.

    Raises:
        InputError: If there is none.
    """
    for model in MODELS:
        if model.name == name:
            return model
    names = [model.name for model in MODELS]
    raise InputError(
        "there is no model of this name",
        parameter="model",
        came=name,
        allowed=", ".join(names),
        cure=did_you_mean(name, names),
    )
