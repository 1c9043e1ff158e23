"""Notice a workspace that is known much worse than the held-out error says.

Held-out configurations are like those that were measured. Where the joints moved little, the error there stays small
and says nothing about the rest of the workspace: the expected error does. The scale is left out of it where no length
was measured: it is as uncertain wherever the joints move. A model that takes the geometry as exact does
not expect any error of it: there the geometry is fitted as well, and the robot found is judged by that one.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from truearm.identification.judging.curve_range import has_curves
from truearm.identification.judging.expected_error import (
    ExpectedError,
    PositionErrors,
    as_residuals_allow,
    expected_error,
    expected_map,
)
from truearm.identification.solving.fit import Fit, identify
from truearm.identification.solving.losses import Loss
from truearm.identification.solving.models import named_model
from truearm.measurement.dataset import Dataset
from truearm.measurement.statistics import Errors
from truearm.notices import Notice
from truearm.units import SHOWN_AS, from_si

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
    wider = identify(nominal, measured, model, loss=loss, held=fit.held)
    expected = expected_error(as_residuals_allow(wider, measured))
    apart = _apart(fit, wider)
    low, high = expected.without_scale.interval_90
    both = replace(
        expected.without_scale,
        mean=math.hypot(expected.without_scale.mean, apart),
        interval_90=(max(low, apart - high), apart + high),
    )
    found = check_narrow_data(wider, replace(expected, without_scale=both), measured, judged, held_out=held_out)
    more = f" The {fit.model.name} model takes the geometry as exact; here it is as uncertain as its priors."
    return [replace(notice, message=notice.message + more) for notice in found]


def _apart(fit: Fit, other: Fit) -> float:
    """Return how far the targets of two fits are apart over the workspace, on average [m]."""
    joints = fit.robot.random_configurations(_PLACES, np.random.default_rng(0))
    places = [[f.robot.world_poses(joints, t.name)[0] for t in fit.robot.targets] for f in (fit, other)]
    return float(np.linalg.norm(np.array(places[0]) - np.array(places[1]), axis=2).mean())


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
    return [Notice("narrow-data", words, "error" if mean > _ERROR * known else "warning")]


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
    there = expected_where_measured(fit, measured)
    if mean <= _WARNING * there:
        return []
    return [
        Notice(
            "narrow-data",
            f"Over the workspace the targets are expected to be off by {_mm(mean)} mm on average (90 %: {_mm(low)} to "
            f"{_mm(high)}), at configurations like those measured by {_mm(there)} mm, both without the noise of a "
            "reading: curves of joints are known only where these were measured. Measure configurations in which these "
            f"joints move further: {'; '.join(few)}.",
            "warning",
        )
    ]


def expected_where_measured(fit: Fit, measured: Dataset) -> float:
    """Return the mean error to expect at the configurations of the training part, without that of the scale [m]."""
    some = np.linspace(0, measured.configurations - 1, min(measured.configurations, _PLACES)).round().astype(np.intp)
    return float(PositionErrors(fit, _DRAWS, scale_counts=False).at(measured.joints[some]).mean())


def joints_that_moved_little(fit: Fit, measured: Dataset) -> list[str]:
    """Return the joints that moved over less than half of what their limits allow, in words, the worst first."""
    found = []
    for number, joint in enumerate(fit.robot.joints):
        low, high = joint.range
        seen = measured.joints[:, number]
        allowed = high - low if joint.kind == "prismatic" else min(high - low, math.tau)
        share = float(np.ptp(seen)) / allowed
        if share < _LITTLE:
            unit = SHOWN_AS["m" if joint.kind == "prismatic" else "rad"]
            texts = [f"{from_si(value, unit):.0f}" for value in (seen.min(), seen.max(), low, high)]
            limits = f"limits {texts[2]} to {texts[3]}" if joint.limits else "no limits"
            found.append((share, f"{joint.name} (measured {texts[0]} to {texts[1]} {unit}, {limits})"))
    return [text for _, text in sorted(found)]


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
