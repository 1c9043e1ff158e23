"""Can what was fitted be this robot: the rule behind the status ``implausible``.

A fit converges on anything. Readings that have nothing to do with the robot leave it at its nominal values, with
residuals as large as the arm; readings in a wrong unit bend it into another robot that agrees with them to the last
hundredth of a millimetre. So both are looked at, what is left and how far the robot moved. The limits are an order of
magnitude beyond what robots do: calibrated ones leave less than 0.1 % of their reach, and parameters drawn at three
times their priors have moved by 3 of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Final

import numpy as np

from truearm.identification.judging.left_over import LeftOver
from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import errors_of
from truearm.modeling.transform import Transform
from truearm.notices import Notice

#: Share of the reach that half of the readings may be off by at most.
LARGEST_SHARE_LEFT: Final = 0.01
#: Angle that half of the measured orientations may be off by at most [rad].
LARGEST_ANGLE_LEFT: Final = 0.1
#: Deviations declared of orientations that are allowed beside it: half of such angles are below 1.5.
_NOISE: Final = 2.0
#: How far the geometry may have moved, as a root mean square over its free parameters [priors].
LARGEST_MOVE: Final = 5.0
#: How far a joint zero may have moved [rad]: marks are missed by a tooth of the gear, never by a quarter of a turn.
LARGEST_ZERO: Final = math.radians(30.0)
#: Prior deviations over the one that the readings leave, of a direction that these see.
_SEEN: Final = 1.0
#: Deviations by which a parameter may be where it is without having moved.
_UNKNOWN: Final = 2.0

#: Codes of faults that make a fit implausible, the most decisive first.
CAUSES: Final = (
    "unit-length",
    "unit-angle",
    "mirrored",
    "joint-sign",
    "rows-shifted",
    "rows-unrelated",
    "quaternion-order",
    "orientation-order",
    "fixtures-unlikely",
    "wrong-robot",
)


def implausible(fit: Fit, data: Dataset) -> str | None:
    """Return in words why a fit cannot be this robot, None if it can.

    Args:
        data: The readings it was made from.
    """
    errors, robot = errors_of(fit.robot, data), fit.robot
    reach = float(
        np.linalg.norm(fit.start.with_frames(Transform(), {}).world_poses(data.postures)[0], axis=1).max(initial=0.0)
    )
    lengths = np.concatenate([errors.position_norms, errors.length_norms])
    left = float(np.median(lengths)) if len(lengths) else 0.0
    if left > LARGEST_SHARE_LEFT * reach:
        return (
            f"half of the readings are off by more than {left * 1e3:.3g} mm, {left / reach:.2g} of the "
            f"{reach * 1e3:.0f} mm that the arm reaches (allowed: {LARGEST_SHARE_LEFT:g})"
        )
    turned = float(np.median(errors.orientation_norms)) if len(errors.orientation_norms) else 0.0
    allowed = LARGEST_ANGLE_LEFT
    if data.sigma_rot is not None and np.isfinite(data.sigma_rot[data.has_orientation]).any():
        allowed += _NOISE * float(np.nanmedian(data.sigma_rot[data.has_orientation]))
    if turned > allowed:
        return (
            f"half of the orientations are off by more than {math.degrees(turned):.3g} deg (allowed: "
            f"{math.degrees(allowed):.2g})"
        )
    size = _geometry_moved(fit, data)
    if size > LARGEST_MOVE:
        return (
            f"its geometry moved by {size:.2g} standard deviations of its priors, as a root mean square (allowed: "
            f"{LARGEST_MOVE:g})"
        )
    zeros = {}
    for name in fit.free.names:
        p = robot.parameters[name]
        if p.group == "joint zero" and p.unit == "rad":
            zeros[name] = abs(p.value - p.nominal) - _UNKNOWN * (p.deviation or 0.0)
    farthest = max(zeros, key=lambda name: zeros[name], default=None)
    if farthest is not None and zeros[farthest] > LARGEST_ZERO:
        return (
            f"{farthest} moved by {math.degrees(zeros[farthest]):.3g} deg (allowed: {math.degrees(LARGEST_ZERO):.2g})"
        )
    return None


def _geometry_moved(fit: Fit, data: Dataset) -> float:
    """Return how far the geometry moved, as a root mean square over its free parameters [priors].

    Of all robots that the readings cannot tell from the one found, that one counts whose geometry moved least: what
    moves along a direction that they do not see costs nothing, nor do base, targets and joint zeros. An arm that was
    never mastered has its zeros in a twist as well, if its convention lets them be there.
    """
    own = np.array([p.group == "geometry" for p in fit.free.parameters], dtype=bool)
    if not own.any():
        return 0.0
    values = np.array([fit.robot.values[name] for name in fit.free.names])
    moves = (values - fit.free.nominal) / fit.free.prior
    if np.sqrt(np.mean(moves[own] ** 2)) <= LARGEST_MOVE:
        return 0.0
    left = LeftOver.of(fit, data)
    seen = left.turns[left.strength > _SEEN]
    unseen = np.linalg.svd(seen, full_matrices=True)[2][len(seen) :].T
    least = moves[own] - unseen[own] @ np.linalg.lstsq(unseen[own], moves[own], rcond=1e-10)[0]
    return float(np.sqrt(np.mean(least**2)))


def check_plausible(fit: Fit, data: Dataset, others: Iterable[Notice] = ()) -> list[Notice]:
    """Return a notice if a fit cannot be this robot.

    Args:
        others: What else was noticed: the cause is looked for there.
    """
    why = implausible(fit, data)
    if why is None:
        return []
    codes = {notice.code for notice in others}
    cause = next((code for code in CAUSES if code in codes), None)
    cure = (
        "Check that it is this robot, and units, joint order, signs and targets of the data."
        if cause is None
        else f"The cause is most likely what {cause} says; mend that and calibrate again."
    )
    return [Notice("implausible", f"What was fitted cannot be this robot: {why}. {cure}", "error")]
