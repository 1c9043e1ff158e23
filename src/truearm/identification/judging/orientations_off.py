"""Orientations that a robust fit leaves far off, where the positions are right."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.identification.judging.far_off import OUTLIER_RATIO
from truearm.identification.judging.orientation_slips import slips_in_rows
from truearm.identification.solving.fit import Fit
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.modeling.chain import Array
from truearm.notices import Notice
from truearm.shown import degrees, listed

#: The code of the notice.
ORIENTATION_OUTLIERS: Final = "orientation-outliers"
#: An orientation is doubted if it is at least so far off [rad].
_LEAST_TURNED: Final = math.radians(0.5)
#: A joint turns a reading alike if the turn is about its axis but for this share, and hardly moves it if the target is
#: so near the axis [m].
_ALIKE: Final = 0.05
_ON_THE_AXIS: Final = 5e-3


def orientations_off(errors: Errors) -> NDArray[np.bool_]:
    """Return which orientations are so far off that they are doubted, ``(readings,)``.

    Args:
        errors: Of a robust fit.
    """
    turned = errors.orientation_errors
    if turned is None or not len(errors.orientation_norms):
        return np.zeros(len(errors.position_errors), dtype=bool)
    allowed = max(_LEAST_TURNED, OUTLIER_RATIO * float(np.median(errors.orientation_norms)))
    return np.asarray(np.nan_to_num(np.linalg.norm(turned, axis=1)) > allowed)


def check_orientations(fit: Fit, data: Dataset, errors: Errors, doubted: NDArray[np.bool_]) -> list[Notice]:
    """Say which orientations are far off, and which of them would not be if their numbers were read otherwise.

    Args:
        errors: Of the fit.
        doubted: The orientations that are far off, where the positions are not, ``(readings,)``.
    """
    if data.quaternion is None or errors.orientation_errors is None or not doubted.any():
        return []
    rows = np.flatnonzero(doubted)
    predicted = np.empty((len(rows), 3, 3))
    for t in np.unique(data.target[rows]).tolist():
        mine = data.target[rows] == t
        predicted[mine] = fit.robot.world_poses(data.postures, data.targets[t])[1][data.configuration[rows[mine]]]
    mended, code, words = slips_in_rows(data.quaternion[rows], predicted)
    at = [(data.labels[data.configuration[r]], data.targets[data.target[r]]) for r in rows.tolist()]
    where = ["/".join(one) for one in at]
    found = []
    if mended.any():
        some = listed([name for name, one in zip(where, mended.tolist(), strict=True) if one])
        found.append(
            Notice(
                code,
                f"Some orientations do not turn as the robot does (configuration/target): {some}. They would if their "
                f"numbers were read otherwise: {words}. Those of the other readings are right. Mend these rows.",
                "error",
                at=tuple(one for one, known in zip(at, mended.tolist(), strict=True) if known),
            )
        )
    if not mended.all():
        size = np.linalg.norm(errors.orientation_errors[rows], axis=1).tolist()
        joint = [_as_if_turned(fit, data, r, errors.orientation_errors[r]) for r in rows.tolist()]
        others = [f"{where[i]} ({degrees(size[i])} deg{joint[i]})" for i in np.flatnonzero(~mended).tolist()]
        one = len(others) == 1
        what, them = ("orientation is", "it") if one else ("orientations are", "them")
        quaternions = "its quaternion" if one else "their quaternions"
        found.append(
            Notice(
                ORIENTATION_OUTLIERS,
                f"{len(others)} {what} far off, and the positions are not (configuration/target): {listed(others)}. "
                f"Measure {them} again, or leave {quaternions} empty; `loss=cauchy` lets {them} count little.",
                at=tuple(at[i] for i in np.flatnonzero(~mended).tolist()),
            )
        )
    return found


def _as_if_turned(fit: Fit, data: Dataset, reading: int, by: Array) -> str:
    """Say if a joint that were off would turn a reading alike, and hardly move it; nothing if none would.

    Args:
        by: What the orientation is off by, as a rotation vector [rad], ``(3,)``.
    """
    one = data.of_configurations(data.configuration[[reading]])
    moves = fit.robot.joint_jacobian(one.postures, data.targets[data.target[reading]])[0]
    for number, (linear, angular) in enumerate(zip(moves[:3].T, moves[3:].T, strict=True), 1):
        angle = float(by @ angular)
        if np.linalg.norm(by - angle * angular) < _ALIKE * abs(angle) and np.linalg.norm(linear) < _ON_THE_AXIS:
            return f", as if joint {number} were"
    return ""


def without_orientations(data: Dataset, doubted: NDArray[np.bool_]) -> Dataset:
    """Return the data without some orientations.

    Args:
        doubted: Which, ``(readings,)``.
    """
    if data.quaternion is None or not doubted.any():
        return data
    return replace(data, quaternion=np.where(doubted[:, None], np.nan, data.quaternion))
