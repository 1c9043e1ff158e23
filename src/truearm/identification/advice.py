"""What a person should know about a fit, in plain words and with parameter names."""

from __future__ import annotations

from typing import Final

from truearm.identification.fit import Fit, Status
from truearm.modeling.conventions import parallel_joints_without_beta
from truearm.notices import Notice

#: Priors that a parameter may move before the robot, its units or its joint order are doubted.
_FAR: Final = 6.0


def check_fit(fit: Fit) -> list[Notice]:
    """Return what a fit says about its model, its data and its parameters."""
    found = []
    robot = fit.robot
    if "joint zero" in fit.model.groups and "geometry" in fit.model.groups:
        pairs = parallel_joints_without_beta(robot.convention, [dict(j.row) for j in robot.joints])
        if pairs:
            names = ", ".join(f"{a} and {b}" for a, b in pairs)
            better = {"standard-dh": "hayati", "modified-dh": "modified-hayati"}.get(
                robot.convention_name, robot.convention_name
            )
            cure = (
                "Convert the robot: truearm convert, --convention hayati."
                if robot.convention_name == "s-model"
                else f"Write 'convention: {better}' in the robot file and 'beta: 0' at the link between them."
            )
            found.append(
                Notice(
                    "parallel-axes",
                    f"Joints {names} are parallel and no beta lets them tilt against each other, so the model "
                    f"cannot follow the real robot. {cure}",
                )
            )
    if fit.status is Status.NOT_CONVERGED:
        found.append(Notice("not-converged", f"The fit did not converge. {Status.NOT_CONVERGED.advice}"))
    if fit.unseen:
        found.append(
            Notice(
                "rank-loss",
                f"The training data do not determine {', '.join(fit.unseen)}, on which predictions elsewhere "
                f"depend. {Status.RANK_LOSS.advice}",
            )
        )
    if fit.at_bound:
        found.append(Notice("at-bound", f"At a bound: {', '.join(fit.at_bound)}. {Status.AT_BOUND.advice}"))
    if fit.redundancies:
        combinations = "; ".join(f"{r.dropped} ({r.combination})" for r in fit.redundancies)
        found.append(
            Notice(
                "redundant",
                "Held at their nominal values, because the readings cannot tell the combination in brackets "
                f"apart: {combinations}." + ("" if fit.unseen else " Predictions are not affected."),
            )
        )
    far = [
        p.name
        for p in robot.parameters.values()
        if p.group not in ("base", "target") and abs(p.value - p.nominal) > _FAR * p.prior
    ]
    if far:
        found.append(
            Notice(
                "far-from-nominal",
                f"{', '.join(far[:8])}{' and others' if len(far) > 8 else ''} moved by more than {_FAR:g} times what "
                "the nominal values are believed to be good for. Is it this robot, in these units, with its joints in "
                "this order? If so, say in the robot file what its numbers are good for (priors).",
            )
        )
    if fit.excess > 1.0:
        found.append(
            Notice(
                "residuals-exceed-sigma",
                f"The residuals are {fit.excess:.1f} times what the declared deviations allow: the robot does "
                f"something that the {fit.model.name} model cannot express, or sigma is too small. The "
                "deviations of the parameters are widened by that factor.",
            )
        )
    if fit.robot.effect_names:
        gains = ", ".join(fit.robot.effect_names)
        found.append(
            Notice(
                "urdf-partial",
                f"calibrated.urdf holds the geometry and the joint zeros; a URDF cannot hold: {gains} "
                f"({', '.join(p.name for p in robot.parameters.values() if p.group == 'gain')}), nor the base "
                "and the targets in the instrument's frame. calibrated.yaml holds everything.",
            )
        )
    return found
