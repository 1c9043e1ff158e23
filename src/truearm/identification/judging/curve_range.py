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

#: A joint that turned through less [rad] can hardly tell a curve from geometry.
_LITTLE: Final = math.radians(30.0)
#: What is not measured of a turn, from which it is said that the curve is not known there [rad].
_GAP: Final = math.radians(20.0)


def check_curves(fit: Fit, training: Dataset) -> list[Notice]:
    """Say which joints got no curve, and where the others are known.

    Parameters
    ----------
    training
        The readings that were fitted.
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
