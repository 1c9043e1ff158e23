"""Do new readings agree with a calibration: its proof, its frames, and the names of its targets."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import LEVELS, InputError, Level, Notice, Rule, counted, degrees, listed, millimetres
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.diagnose.wrong_robot import IMPLAUSIBLE, LARGEST_SHARE_LEFT
from truearm.engine.fit.fit import place
from truearm.engine.fit.problem import Problem
from truearm.engine.fit.refit import Moved, Refit, refit
from truearm.engine.robot.chain import Array
from truearm.engine.robot.parameters import FreeParameters
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.robot_file.seal import is_intact
from truearm.engine.robot.transform import Transform

# Does a robot miss new readings by far more than its calibration said that it may.
#
# The calibration's proof holds the covariance of the parameters and the errors of the joints at a visit. Both moved
# to the new configurations, with the noise of the new readings, say how far these may be off.

#: Errors over what the proof lets expect, as root mean squares, from which the proof may not hold here, and from which
#: it does not: of one draw that moves all readings alike they are exceeded with a probability of 5 % and of 6e-5. And
#: from which the robot is another one.
_NOTE: Final = 2.0
_WARNING: Final = 4.0
_ERROR: Final = 10.0
#: So few readings for each of the others are named as what makes the errors, if the others are off by no more than so
#: many times what the proof lets expect.
_FEW: Final = 0.1
_OF_OTHERS: Final = 2.0
#: Noise of readings that declare none [m]: of a camera. Trackers are better.
_NOISE: Final = 1e-4


BEYOND_PROOF: Final = Rule(
    "beyond-proof",
    ("warning", "error", "note"),
    "positions are off by more than 4 times (10: error, 2: note) what the robot's own [proof](results.md#files) lets "
    "expect at these configurations, with their sigma (0.1 mm if none is declared); a proof that is a lower bound is "
    "doubted from 10 times on, by a warning",
    gravity=2,
)


def check_proof(robot: Robot, data: Dataset, errors: Errors) -> list[Notice]:
    """Return a notice if positions are off by many times what the proof of the robot lets expect.

    Nothing is said of robots without a proof, or whose values were changed since, nor of readings against fixtures. A
    proof that is a lower bound is doubted later.

    Args:
        robot: With base and targets.
        data: Readings of those.
        errors: Of the robot on them.
    """
    proof = robot.proof
    if proof is None or not is_intact(robot) or not proof.names or not len(errors.position_norms):
        return []
    if data.fixture is not None:
        return []
    free = FreeParameters(tuple(robot.parameters[name] for name in proof.names if name in robot.parameters))
    if len(free.names) < len(proof.names):
        return []
    plain = replace(data, sigma=None, sigma_rot=None, quaternion=None, setup=None)
    problem = Problem(robot, plain, free, {observation.name: 1.0 for observation in OBSERVATIONS})
    evaluation = problem.at(np.array([robot.values[name] for name in free.names]))
    by_model = evaluation.jacobian @ proof.root
    by_joints = evaluation.by_joints * np.array(proof.joint_error)
    count = max(int(data.has_position.sum()), 1)
    model = float(np.sum(by_model**2) + np.sum(by_joints**2)) / count
    sigma = np.full(len(data.target), _NOISE) if data.sigma is None else data.sigma
    noise = 3.0 * float(np.nanmean(sigma[data.has_position] ** 2))
    off, expected = math.sqrt(float(np.mean(errors.position_norms**2))), math.sqrt(model + noise)
    steps = (_WARNING, _ERROR, math.inf) if proof.lower_bound else (_NOTE, _WARNING, _ERROR)
    reached = sum(off > step * expected for step in steps)
    if not reached:
        return []
    level = LEVELS[reached - 1]
    assumed = f", with {_NOISE * 1e3:g} mm of noise, since no sigma is declared" if data.sigma is None else ""
    said = (
        f"The positions are off by {off * 1e3:.2g} mm (root mean square), {off / expected:.2g} times the "
        f"{expected * 1e3:.2g} mm that the robot's own calibration lets expect here{assumed}. "
    )
    norms = np.linalg.norm(errors.position_errors, axis=1)
    far, near = np.flatnonzero(norms > _WARNING * expected), norms[norms <= _WARNING * expected]
    if len(far) <= _FEW * len(near) and float(np.sqrt(np.mean(near**2))) <= _OF_OTHERS * expected:
        names = [f"{data.targets[data.target[r]]} at {data.labels[data.configuration[r]]}" for r in far.tolist()]
        said += (
            f"That comes from {counted(len(far), 'reading')} (target at configuration): {listed(names)}. Without them "
            f"it is {np.sqrt(np.mean(near**2)) * 1e3:.2g} mm. Look at them before you doubt the robot."
        )
        return [BEYOND_PROOF(said, "note" if level == "note" else "warning")]
    said += (
        "The robot changed since, carries another payload, does what its model lacks, or the readings scatter more "
        "than they declare"
    )
    said += "." if level == "note" else ": calibrate it again, and do not rely on its expected errors."
    return [BEYOND_PROOF(said, level)]


# Are new readings in the frames of the calibration, with its tool, and of this robot at all.
#
# Where readings are off, what explains them is looked for: the base stands elsewhere, the tool was mounted anew, single
# targets were put on anew, or base and targets are all elsewhere. Each explanation is judged at configurations that it
# was not found from (:mod:`truearm.engine.fit.refit`), so that one with more parameters does not win by them.

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
        notice = _moved(robot, data, off, known, reach, beyond=beyond)
        if notice is not None:
            return [notice]
    if not beyond:
        return []
    return [
        IMPLAUSIBLE(
            f"Half of the readings are off by more than {millimetres(float(np.median(off)))} mm, where the arm "
            f"reaches {reach * 1e3:.0f} mm (allowed: {LARGEST_SHARE_LEFT:g} of that): these are not readings of this "
            "robot, or their units, joints or targets are mistaken. Look at them with 'truearm check'."
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


TOOL_MOVED: Final = Rule(
    "tool-moved",
    ("warning", "error"),
    "the readings fit with the tool, or single targets, elsewhere on the flange",
    gravity=2,
)
BASE_MOVED: Final = Rule(
    "base-moved",
    ("warning", "error"),
    "the readings fit in another frame: [the instrument or the base was moved since](results.md#what-was-moved-since)",
    gravity=2,
)


def _moved(
    robot: Robot, data: Dataset, off: Array, known: Moved | None, reach: float, *, beyond: bool
) -> Notice | None:
    """Return what explains the errors, None if no motion does."""
    refits: dict[Moved, tuple[Refit, float]] = {}
    kinds: tuple[Moved, ...] = ("base", "tool", "targets")
    for kind in kinds:
        if kind == known:
            continue
        try:
            again = refit(robot, data, kind)
        except InputError:
            continue  # the readings are too few for this one
        refits[kind] = again, _rms(_sizes(again.errors))
    limit = min(_rms(off) / _LEAST_IMPROVEMENT, LARGEST_SHARE_LEFT * min(reach, _extent(data)))
    if "tool" in refits and "targets" in refits:
        # The motion of a rigid tool is the simpler one: single targets must explain far more.
        single = refits["targets"][1] * _ALIKE < refits["tool"][1]
        refits.pop("tool" if single else "targets")
    if not refits:
        return None
    best = min(refits, key=lambda kind: refits[kind][1])
    again, left = refits[best]
    alike = [kind for kind, (_, other) in refits.items() if kind != best and other <= _ALIKE * left and other <= limit]
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
        f"`refit={alike[0]}` would leave {millimetres(refits[alike[0]][1])} mm."
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
        return BASE_MOVED(message, level)
    if best == "tool":
        message = (
            f"The readings agree with the robot if the tool sits elsewhere on the flange: {_motion(again)}, they are "
            f"off by {with_errors}. The tool was mounted anew since the calibration{hedge}.{doubt} Judge the robot "
            f"with `refit=tool`, {new}."
        )
        return TOOL_MOVED(message, level)
    far = max(again.shifts, key=lambda name: again.shifts[name])
    message = (
        f"The readings agree with the robot if its targets sit elsewhere on the flange: target {far} by "
        f"{millimetres(again.shifts[far])} mm, which moved farthest; then they are off by {with_errors}. Targets were "
        f"put on anew since the calibration{hedge}.{doubt} Judge the robot with `refit=targets`, {new}."
    )
    return TOOL_MOVED(message, level)


def _left_with_both(robot: Robot, data: Dataset, readings: int) -> float:
    """Return the root mean square [m] that another base and other targets together leave, for their freedom."""
    unknowns, numbers = 6 + 3 * len(data.targets), 3 * readings
    if data.fixture is not None or not data.has_position.any() or numbers <= 2 * unknowns:
        return math.inf
    return _rms(_sizes(errors_of(place(robot, data), data))) * math.sqrt(numbers / (numbers - unknowns))


FRAMES_DIFFER: Final = Rule(
    "frames-differ",
    ("warning", "error"),
    "the readings fit only with another base and other targets",
    cure="Find them with 'truearm calibrate' and `model=frames`.",
    gravity=2,
)


def _both_moved(left: float, off: Array, *, beyond: bool) -> Notice:
    return FRAMES_DIFFER(
        f"The readings agree with the robot only with another base and other targets: they are then off by "
        f"{millimetres(left)} mm instead of {millimetres(_rms(off))} (root mean square). Both the instrument (or the "
        "base) and the tool were moved since the calibration.",
        "error" if beyond else "warning",
    )


def _motion(again: Refit) -> str:
    """Return in words how far something moved."""
    turned = "" if again.turn is None else f" and turned by {degrees(again.turn)} deg"
    middle = "at their middle" if again.moved == "base" else "at the middle of its targets"
    return f"moved by {millimetres(again.shift)} mm {middle}{turned} as a whole"


#: Targets that are off by less need no explanation [m].
_PLACED_WITHIN: Final = 1e-3
#: Another assignment of the names explains the readings if they fit so many times better.
_LEAST_IMPROVEMENT_TARGET_NAMES: Final = 4.0
#: Targets among which names are looked for.
_MOST_TARGETS: Final = 20


TARGETS_RENAMED: Final = Rule(
    "targets-renamed",
    "error",
    "the readings fit other targets of the robot better",
    cure="Give the targets the names that they had in the calibration.",
)


def check_names(robot: Robot, data: Dataset, errors: Errors) -> list[Notice]:
    """Return a notice if positions of targets fit other targets of the robot far better.

    Args:
        robot: With base and targets.
        data: Readings of those.
        errors: Of the robot on them.
    """
    if errors.position is None or errors.position.mean < _PLACED_WITHIN:
        return []
    known = [target.name for target in robot.targets][:_MOST_TARGETS]
    read = data.has_position
    if len(known) < 2:
        return []
    places = {name: robot.world_poses(data.postures, name)[0] for name in known}
    meant = {}
    for t, name in enumerate(data.targets):
        rows = np.flatnonzero(read & (data.target == t))
        if not len(rows):
            continue
        off = {
            other: float(
                np.median(np.linalg.norm(places[other][data.configuration[rows]] - data.position[rows], axis=1))
            )
            for other in known
        }
        own = off.get(name, np.inf)
        best = min(off, key=lambda other: off[other])
        if best != name and off[best] * _LEAST_IMPROVEMENT_TARGET_NAMES < own:
            meant[name] = best
    if not meant:
        return []
    words = ", ".join(f"{name} is {other}" for name, other in meant.items())
    return [TARGETS_RENAMED(f"The readings fit other targets of the robot better: {words}.")]
