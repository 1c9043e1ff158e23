"""What a calibration writes into its robot about itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from truearm.identification.solving.fit import Fit, Status
from truearm.measurement.dataset import Dataset
from truearm.modeling.proof import Proof
from truearm.notices import Notice

#: Found anew by every fit: nothing that was known of them before holds.
_PLACES: Final = ("base", "target", "fixture")
_SOUND: Final = (Status.CONVERGED.value, Status.AT_BOUND.value)


def proof_of(fit: Fit, warnings: Sequence[Notice], training: Dataset, before: Proof | None = None) -> Proof:
    """Return what a calibration knows about its result.

    Parameters
    ----------
    fit
        Of the training part.
    warnings
        All notices of the calibration.
    training
        The training part.
    before
        What was known of the robot already. It holds for the parameters of the arm that this fit has not touched, as
        where only base and targets are found anew; and if there are any, so does what spoke against them.
    """
    status, joint_error = fit.status.value, fit.joint_error
    errors = [notice for notice in warnings if notice.level == "error"]
    parameters, covariance = list(fit.free.parameters), fit.covariance
    region = list(zip(training.joints.min(axis=0).tolist(), training.joints.max(axis=0).tolist(), strict=True))
    if before is not None:
        touched = {*fit.free.names, *(redundancy.dropped for redundancy in fit.redundancies)}
        arm = {n: p for n, p in fit.robot.parameters.items() if p.group not in _PLACES}
        kept = [i for i, name in enumerate(before.names) if name in arm and name not in touched]
        if kept or not any(name in arm for name in fit.free.names):
            status = before.status if status in _SOUND else status
            errors += [error for error in before.errors if error.code not in [e.code for e in errors]]
            parameters += [arm[before.names[i]] for i in kept]
            region = [(min(a, c), max(b, d)) for (a, b), (c, d) in zip(region, before.region or region, strict=True)]
            joint_error = np.maximum(joint_error, before.joint_error or 0.0)
            beside = np.zeros((len(covariance), len(kept)))
            covariance = np.block([[covariance, beside], [beside.T, before.covariance[np.ix_(kept, kept)]]])
    return Proof.of(status, errors, region, joint_error, parameters, covariance)
