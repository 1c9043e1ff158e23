"""Are new readings in the frames of the calibration, with its tool, and of this robot at all.

Where readings are off, what explains them is looked for: the base stands elsewhere, the tool was mounted anew, single
targets were put on anew, or base and targets are all elsewhere. Each explanation is judged at configurations that it
was not found from (:mod:`truearm.identification.refit`), so that one with more parameters does not win by them.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from truearm.errors import InputError
from truearm.identification.judging.implausible import LARGEST_SHARE_LEFT
from truearm.identification.refit import Moved, Refit, refit
from truearm.identification.solving.fit import place
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors, errors_of
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.modeling.transform import Transform
from truearm.notices import Level, Notice
from truearm.shown import degrees, millimetres

#: Readings that are off by less need no explanation [m].
_NEAR: Final = 1e-4
#: A motion explains the errors if their root mean square is so many times less with it.
_LEAST_IMPROVEMENT: Final = 2.5
#: Another motion cannot be told from the best one if it leaves no more than so many times as much.
_ALIKE: Final = 1.5
#: Errors up to so many times what the calibration's own joint errors make need no explanation.
_USUAL: Final = 3.0
#: Configurations below which a motion can be found for anything.
_FEWEST: Final = 8


def check_frames(robot: Robot, data: Dataset, errors: Errors, known: Moved | None = None) -> list[Notice]:
    """Return a notice if readings agree with the robot only after something was moved, or hardly in any case.

    Args:
        robot: With base and targets.
        data: Readings of those.
        errors: Of the robot on them.
        known: What was found anew from them already.
    """
    off = _sizes(errors)
    if len(off) == 0 or float(off.mean()) <= _NEAR:
        return []
    reach = float(np.linalg.norm(robot.with_frames(Transform(), {}).world_poses(data.postures)[0], axis=1).max())
    beyond = float(np.median(off)) > LARGEST_SHARE_LEFT * reach
    if not beyond and _rms(off) <= _USUAL * _of_joint_errors(robot, data):
        return []
    if len(np.unique(data.configuration[data.has_reading])) >= _FEWEST:
        told = _moved(robot, data, off, known, reach, beyond=beyond)
        if told is not None:
            return [told]
    if not beyond:
        return []
    return [
        Notice(
            "implausible",
            f"Half of the readings are off by more than {millimetres(float(np.median(off)))} mm, where the arm "
            f"reaches {reach * 1e3:.0f} mm (allowed: {LARGEST_SHARE_LEFT:g} of that): these are not readings of this "
            "robot, or their units, joints or targets are mistaken. Look at them with 'truearm check'.",
            "error",
        )
    ]


def _sizes(errors: Errors) -> Array:
    """Return how far positions are off, or lengths where no position was read [m]."""
    return errors.position_norms if len(errors.position_norms) else errors.length_norms


def _of_joint_errors(robot: Robot, data: Dataset) -> float:
    """Return how far the joint errors that the calibration found move targets, as a root mean square [m].

    They are repeatability and what the model cannot express, which is alike at poses that are near each other.
    """
    if robot.proof is None or not any(robot.proof.joint_error):
        return 0.0
    at = robot.loaded(data.postures)
    moved = np.array([robot.joint_jacobian(at, name)[:, :3] for name in data.targets])
    size = np.sum((moved * np.array(robot.proof.joint_error)) ** 2, axis=(2, 3))
    read = data.has_reading
    return float(np.sqrt(size[data.target[read], data.configuration[read]].mean()))


def _extent(data: Dataset) -> float:
    """Return how far positions spread about their middle [m]; no limit where none was read."""
    read = data.position[data.has_position]
    return float(np.sqrt(np.sum(np.var(read, axis=0)))) if len(read) else math.inf


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _moved(
    robot: Robot, data: Dataset, off: Array, known: Moved | None, reach: float, *, beyond: bool
) -> Notice | None:
    """Return what explains the errors, None if no motion does."""
    found: dict[Moved, tuple[Refit, float]] = {}
    kinds: tuple[Moved, ...] = ("base", "tool", "targets")
    for kind in kinds:
        if kind == known:
            continue
        try:
            again = refit(robot, data, kind)
        except InputError:
            continue  # the readings are too few for this one
        found[kind] = again, _rms(_sizes(again.errors))
    limit = min(_rms(off) / _LEAST_IMPROVEMENT, LARGEST_SHARE_LEFT * min(reach, _extent(data)))
    if "tool" in found and "targets" in found:
        # The motion of a rigid tool is the simpler one: single targets must explain far more.
        single = found["targets"][1] * _ALIKE < found["tool"][1]
        found.pop("tool" if single else "targets")
    if not found:
        return None
    best = min(found, key=lambda kind: found[kind][1])
    again, left = found[best]
    alike = [kind for kind, (_, other) in found.items() if kind != best and other <= _ALIKE * left and other <= limit]
    if left > limit:
        both = math.inf if known is not None else _left_with_both(robot, data, len(off))
        if both > limit:
            return None
        if both * _ALIKE < left:
            return _both_moved(both, off, beyond=beyond)
    level: Level = "error" if beyond else "warning"
    with_errors = f"{millimetres(left)} mm instead of {millimetres(_rms(off))} (root mean square)"
    other = "instrument or base" if alike and alike[0] == "base" else "tool"
    doubt = (
        f" These configurations do not tell that from a moved {other}: "
        f"`refit={alike[0]}` would leave {millimetres(found[alike[0]][1])} mm."
        if alike
        else ""
    )
    hedge = "" if beyond else ", or the poses are so near each other that the robot errs alike at all of them"
    new = "or find the new frames with 'truearm calibrate' and `model=frames`"
    if best == "base":
        message = (
            f"The readings agree with the robot in another frame: {_motion(again)}, they are off by {with_errors}. "
            f"The instrument or the robot's base was moved since the calibration{hedge}.{doubt} Judge the robot with "
            f"`refit=base`, {new}, or compare distances with 'truearm distances'."
        )
        return Notice("base-moved", message, level)
    if best == "tool":
        message = (
            f"The readings agree with the robot if the tool sits elsewhere on the flange: {_motion(again)}, they are "
            f"off by {with_errors}. The tool was mounted anew since the calibration{hedge}.{doubt} Judge the robot "
            f"with `refit=tool`, {new}."
        )
        return Notice("tool-moved", message, level)
    far = max(again.shifts, key=lambda name: again.shifts[name])
    message = (
        f"The readings agree with the robot if its targets sit elsewhere on the flange: target {far} by "
        f"{millimetres(again.shifts[far])} mm, which moved farthest; then they are off by {with_errors}. Targets were "
        f"put on anew since the calibration{hedge}.{doubt} Judge the robot with `refit=targets`, {new}."
    )
    return Notice("tool-moved", message, level)


def _left_with_both(robot: Robot, data: Dataset, readings: int) -> float:
    """Return the root mean square [m] that another base and other targets together leave, for their freedom."""
    unknowns, numbers = 6 + 3 * len(data.targets), 3 * readings
    if data.fixture is not None or not data.has_position.any() or numbers <= 2 * unknowns:
        return math.inf
    return _rms(_sizes(errors_of(place(robot, data), data))) * math.sqrt(numbers / (numbers - unknowns))


def _both_moved(left: float, off: Array, *, beyond: bool) -> Notice:
    return Notice(
        "frames-differ",
        f"The readings agree with the robot only with another base and other targets: they are then off by "
        f"{millimetres(left)} mm instead of {millimetres(_rms(off))} (root mean square). Both the instrument (or the "
        "base) and the tool were moved since the calibration. Find them with 'truearm calibrate' and `model=frames`.",
        "error" if beyond else "warning",
    )


def _motion(again: Refit) -> str:
    """Return in words how far something moved."""
    turned = "" if again.turn is None else f" and turned by {degrees(again.turn)} deg"
    what = "at their middle" if again.moved == "base" else "at the middle of its targets"
    return f"moved by {millimetres(again.shift)} mm {what}{turned} as a whole"
