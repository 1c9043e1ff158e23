"""What a calibration writes into its robot about itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.compensation.gauge import held_by
from truearm.identification.judging.expected_error import ExpectedError, covariance_root, uncertain_names
from truearm.identification.solving.fit import Fit, Status
from truearm.measurement.dataset import Dataset
from truearm.modeling.equilibrium import joint_efforts
from truearm.modeling.parameters import PLACES
from truearm.modeling.postures import Postures
from truearm.modeling.proof import HELD, Proof
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.results.standing import SOUND

#: What concerns every program: its controller may not have the nominal values of the file, or nothing was gained.
_REPEATED: Final = ("far-from-nominal", "no-gain")


def proof_of(
    fit: Fit,
    status: Status,
    warnings: Sequence[Notice],
    expected: ExpectedError,
    training: Dataset,
    before: Proof | None = None,
) -> Proof:
    """Return what a calibration knows about its result.

    Args:
        fit: Of the training part.
        status: How it ended, or that what it found cannot be this robot.
        warnings: All notices of the calibration.
        expected: The error to expect over the workspace.
        training: The training part.
        before: What was known of the robot already. It holds for the parameters of the arm that this fit has not
            touched, as where only base and targets are found anew; and if there are any, so does what spoke against
            them.
    """
    ended, joint_error = status.value, expected.joint_error
    errors = [notice for notice in warnings if notice.level == "error"]
    repeated = [notice for notice in warnings if notice.code in _REPEATED]
    lower_bound = expected.lower_bound
    held = [*held_by(fit)]
    names, root = uncertain_names(fit), covariance_root(fit, fit.covariance_with_unfitted)
    parameters, covariance = [fit.robot.parameters[name] for name in names], root @ root.T
    region = list(zip(training.joints.min(axis=0).tolist(), training.joints.max(axis=0).tolist(), strict=True))
    measured = training.joints.tolist()
    loads = loads_of(fit.robot, training.postures)
    if before is not None:
        arm = {n: p for n, p in fit.robot.parameters.items() if p.group not in PLACES}
        kept = [i for i, name in enumerate(before.names) if name in arm and name not in names]
        if kept or not any(name in arm for name in names):
            ended = before.status if ended in SOUND else ended
            errors += [error for error in before.errors if error.code not in [e.code for e in errors]]
            repeated += [warning for warning in before.warnings if not repeated]
            parameters += [arm[before.names[i]] for i in kept]
            region = [(min(a, c), max(b, d)) for (a, b), (c, d) in zip(region, before.region or region, strict=True)]
            measured = [*before.measured, *measured] if before.measured else []
            # By older versions nothing is known of the loads before.
            pairs = zip(loads, before.loads, strict=True) if before.loads else ()
            loads = [(min(a, c), max(b, d)) for (a, b), (c, d) in pairs]
            joint_error = np.maximum(joint_error, before.joint_error or 0.0)
            lower_bound = lower_bound or before.lower_bound
            held += [word for word in before.held if word in HELD and word not in held]
            beside = np.zeros((len(covariance), len(kept)))
            covariance = np.block([[covariance, beside], [beside.T, before.covariance[np.ix_(kept, kept)]]])
    return Proof.of(
        ended,
        errors,
        region,
        joint_error,
        parameters,
        covariance,
        warnings=repeated,
        lower_bound=lower_bound,
        held=held,
        measured=measured,
        joint_units=["deg" if joint.kind == "revolute" else "mm" for joint in fit.robot.joints],
        loads=loads,
    )


def loads_of(robot: Robot, postures: Postures) -> list[tuple[float, float]]:
    """Return the lowest and highest load about, or along, each joint's axis in some postures [N m or N]."""
    efforts = joint_efforts(robot, postures)
    return list(zip(efforts.min(axis=0).tolist(), efforts.max(axis=0).tolist(), strict=True))
