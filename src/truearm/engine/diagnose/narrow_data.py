"""Readings that are too few for a model or too narrow for the workspace, and parameters that move the arm alike."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.engine.base.errors import Level, Notice, Rule, counted
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.curves import has_curves
from truearm.engine.diagnose.expected_error import (
    ExpectedError,
    error_by_order,
    expected_error,
    expected_map,
    moved_by_order,
)
from truearm.engine.diagnose.position_errors import PositionErrors, as_residuals_allow
from truearm.engine.diagnose.unmodelled import PULLED_AWAY
from truearm.engine.diagnose.wrong_robot import IMPLAUSIBLE
from truearm.engine.fit.fit import Fit, identify
from truearm.engine.fit.losses import ABSOLUTE, Loss
from truearm.engine.fit.models import named_model
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.parameters import PLACES

FEW_READINGS: Final = Rule(
    "few-readings",
    ("note", "warning", "error"),
    "hardly more numbers were read than the parameters take up: [more](results.md#the-expected-error)",
    gravity=2,
)
#: Numbers left by the parameters from which the noise is at most 1.6 times what they tell, 19 times in 20.
_ENOUGH: Final = 10.0
#: Share of the numbers that parameters must leave for losses that may meet as many readings exactly, and doubt others.
_LEAST_SHARE: Final = 2.0 / 3.0
_MEETING: Final = ("cauchy", *ABSOLUTE)
#: Numbers for each free parameter from which a robust fit tells which reading is wrong.
_FEWEST_TO_DOUBT: Final = 1.5
#: How often the noise is larger than is said that it may be.
_RARELY: Final = 0.05
#: What more there must be to judge a fit.
CURE: Final = "Measure more configurations, or read more targets at each."
_UNIT: Final = {observation.name: "mm" if observation.unit == "m" else "mrad" for observation in OBSERVATIONS}


def check_few_readings(fit: Fit) -> list[Notice]:
    """Say if a fit leaves next to nothing of its readings, whatever their noise.

    It is a warning where the noise is assumed besides, and an error for losses other than the linear one, whose
    deviations follow from what is left.
    """
    left = max(fit.numbers - fit.spent, 0.0)
    enough = max(_ENOUGH, _LEAST_SHARE * fit.numbers) if fit.loss in _MEETING else _ENOUGH
    few = left < enough
    if not few and not fit.assumed:
        return []
    words = ""
    if few:
        words = (
            f"The training readings are {counted(fit.numbers, 'number')}. The "
            f"{counted(len(fit.free.names), 'parameter')} take up {fit.spent:.1f} of them, so {left:.1f} are left to "
            "judge the fit by. A wrong reading cannot be told from a right one. "
        )
    if fit.assumed:
        taken = ", ".join(f"{from_si(fit.sigma[name], _UNIT[name]):.3g} {_UNIT[name]} ({name})" for name in fit.assumed)
        words += (
            f"The readings do not tell how large their noise is, and no deviation is declared: it is assumed, {taken}. "
            "The deviations of the parameters and the expected error are right if it is. "
        )
    elif not fit.declared:
        words += (
            f"The noise may be {_may_be(max(left, 1.0)):.2g} times as large as is estimated from so few, and with it "
            "the deviations of the parameters and the expected error. "
        )
    if fit.loss != "linear":
        words += (
            "Of the deviations of the parameters and of the expected error nothing can be said, with this loss: "
            "they follow from what is left. Use the linear loss. "
        )
    declare = "" if fit.declared else " Declare the instrument's deviation in a column sigma."
    level: Level = "error" if fit.loss != "linear" else "warning" if few and fit.assumed else "note"
    return [FEW_READINGS(f"{words}{CURE}{declare}", level)]


def _may_be(freedom: float) -> float:
    """Return how many times its estimate a deviation is at most, but for one time in twenty: by chi squared."""
    from scipy.special import gammaincinv

    return math.sqrt(freedom / (2.0 * float(gammaincinv(freedom / 2.0, _RARELY))))


def check_few_to_doubt(fit: Fit) -> list[Notice]:
    """Say if the readings are hardly more numbers than a robust fit of them has free parameters.

    It may then leave a good reading far off: others that are as good agree without it.
    """
    parameters = len(fit.free.names)
    if fit.numbers >= _FEWEST_TO_DOUBT * parameters:
        return []
    return [
        FEW_READINGS(
            f"The readings are {counted(fit.numbers, 'number')}, for {counted(parameters, 'parameter')} of the "
            f"{fit.model.name} model. With fewer than {_FEWEST_TO_DOUBT:g} for each, a wrong reading cannot be told "
            f"from a right one. {CURE}"
        )
    ]


# Notice a workspace that is known much worse than the held-out error says.
#
# Held-out configurations are like those that were measured. Where the joints moved little, the error there stays small
# and says nothing about the rest of the workspace: the expected error does. The scale is left out of it where no length
# was measured: it is as uncertain wherever the joints move. A model that takes the geometry as exact does
# not expect any error of it: there the geometry is fitted as well, and the robot found is judged by that one.

#: Expected over known error from which the result is an error. It is a warning where the error may be as large, and is
#: expected to be so many times the known one.
_ERROR: Final = 3.0
_WARNING: Final = 2.0
#: Below this no instrument sees a robot move, and simulated readings without noise would be doubted [m].
_NEGLIGIBLE: Final = 2e-6
#: Mean length of an error of three normal coordinates over the mean size of one.
_OF_ONE: Final = 2.0
#: Share of its limits (of a full turn, where they allow more) below which a joint has moved little.
_LITTLE: Final = 0.5
#: Configurations at which the largest errors are looked for, and the percentile from which they are large.
_PLACES: Final = 300
_DRAWS: Final = 100
_WORST: Final = 90.0


def check_narrow_data_without_geometry(
    fit: Fit, measured: Dataset, judged: Errors, loss: Loss, *, held_out: bool
) -> list[Notice]:
    """Say if the workspace is known much worse than the readings say, for a model that takes the geometry as exact.

    Joints must have moved little: else the geometry is seen where the readings are.

    Args:
        measured: The training part.
        judged: Errors of the calibrated robot: held out, or of the training part if nothing was.
        loss: Of the fit.
    """
    if not joints_that_moved_little(fit, measured):
        return []
    model = named_model("geometric").also([e for e in fit.model.effects if e not in named_model("geometric").effects])
    nominal = fit.robot.with_values({name: p.nominal for name, p in fit.start.parameters.items()})
    wider = identify(nominal, measured, model, loss=loss, fixed=fit.fixed)
    expected = expected_error(as_residuals_allow(wider, measured), by_order=moved_by_order(wider.robot, measured))
    apart = _apart(fit, wider)
    low, high = expected.without_scale.interval_90
    both = replace(
        expected.without_scale,
        mean=math.hypot(expected.without_scale.mean, apart),
        interval_90=(max(low, apart - high), apart + high),
    )
    notices = check_narrow_data(wider, replace(expected, without_scale=both), measured, judged, held_out=held_out)
    more = f" The {fit.model.name} model takes the geometry as exact; here it is as uncertain as its priors."
    return [replace(notice, message=notice.message + more) for notice in notices]


def _apart(fit: Fit, other: Fit) -> float:
    """Return how far the targets of two fits are apart over the workspace, on average [m]."""
    joints = fit.robot.random_configurations(_PLACES, np.random.default_rng(0))
    places = [[f.robot.world_poses(joints, t.name)[0] for t in fit.robot.targets] for f in (fit, other)]
    return float(np.linalg.norm(np.array(places[0]) - np.array(places[1]), axis=2).mean())


NARROW_DATA: Final = Rule(
    "narrow-data",
    ("warning", "error"),
    "the workspace is known worse than the held-out error says: [more](results.md#the-expected-error)",
    gravity=2,
    unless=frozenset({PULLED_AWAY, IMPLAUSIBLE.code}),
)


def check_narrow_data(
    fit: Fit, expected: ExpectedError, measured: Dataset, judged: Errors, *, held_out: bool
) -> list[Notice]:
    """Say if the workspace is known much worse than the readings that judge the fit say.

    Args:
        measured: The training part.
        judged: Errors of the calibrated robot: held out, or of the training part if nothing was.
    """
    of_readings = judged.position or judged.length
    if of_readings is None:
        return []
    fit = replace(fit, joint_error=expected.joint_error)
    known = of_readings.mean
    if not held_out:  # the parameters have taken their part of these
        known *= math.sqrt(fit.numbers / max(fit.numbers - fit.spent, 1.0))
    known = math.hypot(known, error_by_order(fit.robot, measured))
    mean, (low, high) = expected.without_scale.mean, expected.without_scale.interval_90
    if (judged.position is None or fit.gauge_freedoms) and mean > _NEGLIGIBLE:
        # Such readings see positions badly wherever the arm is, and a length is one coordinate of three.
        known = max(known if judged.position else _OF_ONE * known, expected_where_measured(fit, measured))
    few = joints_that_moved_little(fit, measured)
    if mean <= max(_WARNING * known, _NEGLIGIBLE) or high <= _ERROR * known:
        return _beyond_curves(fit, expected, measured, known, few)
    if fit.gauge_freedoms and not few:
        return []
    part = "held-out" if held_out else "training"
    most = "or more" if expected.lower_bound else f"to {_mm(high)}"
    words = (
        f"Over the workspace the targets are expected to be off by {_mm(mean)} mm on average"
        f"{', errors of the scale left out' * ('size' in fit.gauge_freedoms)} (90 %: {_mm(low)} {most}), where the "
        f"{part} {'error' if judged.position else 'error of lengths'} is {_mm(of_readings.mean)} mm: that one says how "
        "good the robot is where it was measured, not elsewhere. "
    )
    if few:
        words += f"Measure configurations in which these joints move further: {'; '.join(few)}."
    else:
        words += f"Measure more configurations, also {least_known(fit)}."
    return [NARROW_DATA(words, "error" if mean > _ERROR * known else "warning")]


def _beyond_curves(fit: Fit, expected: ExpectedError, measured: Dataset, known: float, few: list[str]) -> list[Notice]:
    """Say if curves of joints make the robot good where it was measured alone.

    With curves hardly more than the noise of the readings is left there, which hides how much better the robot is there
    than elsewhere: the errors to expect are compared, both without noise.

    Args:
        known: Error of the readings that judge the fit [m].
        few: Joints that moved little, in words.
    """
    mean, (low, high) = expected.overall.mean, expected.overall.interval_90
    if not has_curves(fit) or not few or fit.gauge_freedoms or mean <= max(known, _NEGLIGIBLE):
        return []
    at_measured = expected_where_measured(fit, measured)
    if mean <= _WARNING * at_measured:
        return []
    return [
        NARROW_DATA(
            f"Over the workspace the targets are expected to be off by {_mm(mean)} mm on average (90 %: {_mm(low)} to "
            f"{_mm(high)}), at configurations like those measured by {_mm(at_measured)} mm, both without the noise of "
            "a reading: curves of joints are known only where these were measured. Measure configurations in which "
            f"these joints move further: {'; '.join(few)}."
        )
    ]


def expected_where_measured(fit: Fit, measured: Dataset) -> float:
    """Return the mean error to expect at the configurations of the training part, without that of the scale [m]."""
    some = np.linspace(0, measured.configurations - 1, min(measured.configurations, _PLACES)).round().astype(np.intp)
    return float(PositionErrors(fit, _DRAWS, scale_counts=False).at(measured.joints[some]).mean())


def joints_that_moved_little(fit: Fit, measured: Dataset) -> list[str]:
    """Return the joints that moved over less than half of what their limits allow, in words, the worst first."""
    narrow = []
    for number, joint in enumerate(fit.robot.joints):
        low, high = joint.range
        seen = measured.joints[:, number]
        allowed = high - low if joint.kind == "prismatic" else min(high - low, math.tau)
        share = float(np.ptp(seen)) / allowed
        if share < _LITTLE:
            unit = SHOWN_AS["m" if joint.kind == "prismatic" else "rad"]
            texts = [f"{from_si(value, unit):.0f}" for value in (seen.min(), seen.max(), low, high)]
            limits = f"limits {texts[2]} to {texts[3]}" if joint.limits else "no limits"
            narrow.append((share, f"{joint.name} (measured {texts[0]} to {texts[1]} {unit}, {limits})"))
    return [text for _, text in sorted(narrow)]


def least_known(fit: Fit) -> str:
    """Say where the largest errors are to be expected."""
    places, error = expected_map(fit, _PLACES)
    worst = places[error >= np.percentile(error, _WORST)]
    radius = float(np.median(np.hypot(worst[:, 0], worst[:, 1])))
    height = float(np.median(worst[:, 2]))
    return (
        f"with targets about {radius * 1e3:.0f} mm from the z axis of the robot's base and {height * 1e3:.0f} mm above "
        f"it, where {_mm(float(np.percentile(error, _WORST)))} mm and more are expected"
    )


def _mm(length: float) -> str:
    """Write a length with two digits [mm]."""
    return f"{float(f'{length * 1e3:.2g}'):g}"


# Which parameters of the arm move it alike everywhere, whatever was measured.
#
# The lengths along two parallel axes, or a joint zero and the base before it, are correlated in every calibration: only
# their sum, or difference, moves anything. That is a property of the convention and not of the data.

#: Random configurations at which motions are compared.
_CONFIGURATIONS: Final = 60
#: Cosine of the angle between motions that are the same one.
_ALIKE: Final = 0.9999


def own_parameters(fit: Fit) -> list[int]:
    """Return the indices of the free parameters of the arm itself; of all where the arm was not free.

    The hundreds of numbers of joint curves are left out: each is a part of a curve, and none means anything alone.
    """
    own = [i for i, p in enumerate(fit.free.parameters) if p.group not in (*PLACES, JointCurve.name)]
    return own or list(range(len(fit.free.parameters)))


def same_motion(fit: Fit) -> set[tuple[int, int]]:
    """Return pairs of free parameters that move the targets alike at all configurations, up to base and targets.

    Returns:
        pairs: Indices of the free parameters, the lower one first.
    """
    robot, names = fit.robot, fit.free.names
    own = own_parameters(fit)
    places = [i for i in range(len(names)) if i not in set(own)]
    q = robot.loaded(robot.random_configurations(_CONFIGURATIONS, np.random.default_rng(0)))
    J = np.concatenate(
        [
            np.moveaxis(robot.position_jacobian(robot.forward_kinematics(q, target.name), q, names), 0, -1).reshape(
                -1, len(names)
            )
            for target in robot.targets
        ]
    )
    moved = J[:, own]
    if places:
        frames = J[:, places]
        U, s, _ = np.linalg.svd(frames, full_matrices=False)
        basis = U[:, s > 1e-9 * s[0]]
        moved = moved - basis @ (basis.T @ moved)
    size = np.linalg.norm(moved, axis=0)
    # What base and targets take whole is theirs: such a parameter goes with every other one.
    whole = size <= 1e-6 * np.maximum(np.linalg.norm(J[:, own], axis=0), 1e-12)
    cosine = moved.T @ moved / np.outer(np.where(whole, 1.0, size), np.where(whole, 1.0, size))
    alike = (np.abs(cosine) > _ALIKE) | whole[:, None] | whole
    rows, columns = np.nonzero(np.triu(alike, 1))
    return {(own[i], own[j]) for i, j in zip(rows.tolist(), columns.tolist(), strict=True)}
