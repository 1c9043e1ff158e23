"""What data say about the joints' curves: which joints got none, and where those that were found are known."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.modeling.effects.fourier import Fourier
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.notices import Notice
from truearm.shown import counted

#: A joint that turned through less [rad] can hardly tell a curve from geometry.
_LITTLE: Final = math.radians(30.0)
#: What is not measured of a turn, from which it is said that the curve is not known there [rad].
_GAP: Final = math.radians(20.0)
#: Training configurations from which on errors that follow the joints' angles are told from others.
ENOUGH: Final = 200


def has_curves(fit: Fit) -> bool:
    """Return whether a fit found a curve of any joint."""
    return any(parameter.group == JointCurve.name for parameter in fit.free.parameters)


def about_curves(fit: Fit, configurations: int) -> str:
    """Say what is not known of joint curves, where a fit has none; empty where they are known to be none.

    Args:
        configurations: That the fit was made from.
    """
    if has_curves(fit) or not JointCurve(fit.robot.layout).parameters:
        return ""
    tried = JointCurve.name in fit.model.tried
    if configurations < ENOUGH:
        left_out = "cross-validation left `joint-curve` out, but " if tried else ""
        words = (
            f"{left_out}errors that follow a joint's angle, as those of gears and encoders do, cannot be told from "
            f"{counted(configurations, 'training configuration')}: measure about {ENOUGH}, and compare with "
            f"`effects={JointCurve.name}`"
        )
    elif tried:
        words = (
            f"cross-validation tried `{JointCurve.name}` and left it out, because it gained no more than chance may or "
            f"was not borne out; to see what it does all the same, compare with `effects={JointCurve.name}`"
        )
    elif JointCurve.name in fit.model.effects:
        return ""
    else:
        words = (
            f"errors that follow a joint's angle in more than two periods a turn were not looked for: compare with "
            f"`effects={JointCurve.name}`"
        )
    return words[0].upper() + words[1:] + "."


def check_curves(fit: Fit, training: Dataset) -> list[Notice]:
    """Say which joints got no curve, and where the others are known.

    Args:
        training: The readings that were fitted.
    """
    if JointCurve.name not in fit.model.effects:
        return []
    robot, joints = fit.robot, training.postures.joints
    effect = next(effect for effect in robot.effects if isinstance(effect, JointCurve))
    free = set(fit.free.names)
    little, none, partly = list[str](), list[str](), list[str]()
    for i, names in effect.terms.items():
        low, high = float(joints[:, i].min()), float(joints[:, i].max())
        name = robot.joints[i].name
        if free.isdisjoint(names):
            (little if high - low < _LITTLE else none).append(f"{name} ({np.rad2deg(high - low):.0f} deg)")
        elif high - low < 2.0 * math.pi - _GAP:
            partly.append(f"{name} from {np.rad2deg(low):.0f} to {np.rad2deg(high):.0f} deg")
    found = []
    if little or none:
        words = []
        if none:
            words.append(f"these readings show no error that follows the angle of {', '.join(none)}")
        if little:
            words.append(f"{', '.join(little)} turned too little to tell such an error from geometry")
        sentence = "; ".join(words)
        found.append(
            Notice(
                "curve-left-out",
                f"Joints without a curve (in brackets how far each turned): {sentence}. More configurations, through "
                "more of the turn, may show one.",
                "note",
            )
        )
    if Fourier.name in fit.model.effects:
        found.append(
            Notice(
                "curves-and-fourier",
                "The model has curves of the joints and the effect fourier, whose one and two periods a turn curves "
                "contain. The readings do not tell the two apart: leave fourier out.",
                "note",
            )
        )
    if partly:
        found.append(
            Notice(
                "curve-range",
                f"Curves of joints are known where these were measured: {'; '.join(partly)}. Outside they are what "
                "was found there, continued. The expected error over the workspace contains what that may be off by, "
                "as far as other joints and ordinary encoders tell.",
                "note",
            )
        )
    return found
