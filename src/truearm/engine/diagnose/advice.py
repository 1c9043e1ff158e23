"""What a person should know about a fit, in plain words and with parameter names."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Final

from truearm.engine.base.errors import Notice, Rule, listed
from truearm.engine.diagnose.changes import OF_CHANGES
from truearm.engine.diagnose.expected_error import ExpectedError
from truearm.engine.diagnose.unmodelled import PULLED_AWAY, WRONG_DATA
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.robot.conventions.convention import parallel_joints_without_beta
from truearm.engine.robot.effects import EFFECTS, NON_NEGATIVE
from truearm.engine.robot.effects.joint_curve import JointCurve
from truearm.engine.robot.loads import has_weight

#: Groups of parameters of the rigid arm.
_KINEMATIC: Final = frozenset({"joint zero", "geometry", *(effect.name for effect in EFFECTS if effect.kinematic)})
#: Priors that an angle may move before it is named; of lengths see :mod:`truearm.engine.diagnose.wrong_robot`.
_LARGEST_MOVE: Final = 6.0
#: Standard deviations below zero from which a stiffness or a play is doubted.
_NEGATIVE_DEVIATIONS: Final = 4.0
#: Share of the prior variance that the data should remove, and of parameters of effects that may fall short of it.
_LEAST_INFORMED: Final = 0.5
_LARGEST_UNINFORMED_SHARE: Final = 0.05


NOT_CONVERGED: Final = Rule("not-converged", "error", "the solver's steps did not become small")
RANK_LOSS: Final = Rule(
    "rank-loss", "error", "the training data do not determine some parameters, and predictions elsewhere depend on them"
)
PRIORS_DECIDE: Final = Rule(
    "priors-decide",
    "error",
    "of every effect at once: as `rank-loss`, but the priors say what the data do not, and the expected error holds it",
)
CLOSED_LOOP: Final = Rule(
    "closed-loop",
    "note",
    "nothing says where the robot stands ([instruments](devices.md)): the unobservable parameters, and how accurate "
    "predicted positions are; where no length was measured, also without errors of the scale",
)
AT_BOUND: Final = Rule("at-bound", "warning", "parameters ended at a bound, by name")
REDUNDANT: Final = Rule(
    "redundant",
    "note",
    "parameters that the readings hardly observe were held at their nominal values, by name and combination",
)
RESIDUALS_EXCEED_SIGMA: Final = Rule(
    "residuals-exceed-sigma",
    ("warning", "note"),
    "the robot does more than the model, or sigma is too small; a note where the next steps say what explains it",
    unless=OF_CHANGES | {PULLED_AWAY, WRONG_DATA},
)


def check_fit(fit: Fit, expected: ExpectedError, *, explained: bool = False) -> list[Notice]:
    """Return what a fit says about its model, its data and its parameters.

    Args:
        expected: Of the fit, over the workspace.
        explained: Whether it is known what the model lacks.
    """
    notices = _parallel_axes(fit)
    if fit.status is Status.NOT_CONVERGED:
        notices.append(NOT_CONVERGED(f"The fit did not converge. {Status.NOT_CONVERGED.advice}"))
    if fit.unobservable:
        words = (
            f"The training data do not determine {', '.join(fit.unobservable)}, and predictions elsewhere depend on "
            "them."
        )
        if fit.found_anew:
            words += (
                " An earlier calibration knew the geometry. This one finds it anew, and takes it for as uncertain as "
                "its priors. The expected error holds if it has changed by about so much. If only the joint zeros have "
                "changed, `model=offsets` finds them, and leaves the geometry as well known as it was."
            )
        sound = fit.status is not Status.RANK_LOSS
        notices.append(
            PRIORS_DECIDE(f"{words} Their values are what is known of any such robot, and so uncertain.")
            if sound
            else RANK_LOSS(f"{words} {Status.RANK_LOSS.advice}")
        )
    if fit.gauge_freedoms:
        words = (
            "No reading locates the robot, so its base frame is the world frame. The held-out error is one of "
            f"readings. Predicted positions are accurate to about {expected.overall.mean * 1e3:.2g} mm on average, up "
            "to the unknown base pose."
        )
        if "size" in fit.gauge_freedoms:
            words += (
                " No length was measured either, so the scale of the result is that of the nominal lengths, as "
                "uncertain as their priors say. Without errors of the scale it would be "
                f"{expected.without_scale.mean * 1e3:.2g} mm. One known length determines the scale: the distance of "
                "two points, or a ballbar."
            )
        if fit.unobservable_combinations:
            unobservable = "; ".join(fit.unobservable_combinations)
            words += f" Unobservable combinations of parameters, held at nominal values: {unobservable}."
        notices.append(CLOSED_LOOP(words))
    if fit.at_bound:
        notices.append(AT_BOUND(f"Parameters at a bound: {', '.join(fit.at_bound)}. {Status.AT_BOUND.advice}"))
    if fit.redundancies:
        combinations = "; ".join(f"{r.dropped} ({r.combination})" for r in fit.redundancies)
        alike = (
            "" if fit.unobservable else " At configurations like the measured ones predictions hardly depend on them."
        )
        notices.append(
            REDUNDANT(
                f"Redundant parameters are held at their nominal values: {combinations}. The readings hardly observe "
                f"the combinations in brackets.{alike}"
            )
        )
    shared = fit.joint_error.any() and not fit.scattered
    if fit.excess > 1.0:
        notices.append(
            RESIDUALS_EXCEED_SIGMA(
                f"The residuals are {fit.excess:.1f} times what the declared deviations"
                f"{', and errors of the joints that readings of a configuration share,' if shared else ''} allow. "
                f"Either the robot does something that the {fit.model.name} model cannot express, or sigma is too "
                "small, or readings are wrong. The deviations of the parameters allow for it.",
                "note" if explained else "warning",
            )
        )
    notices += _check_effects(fit)
    return notices


PARALLEL_AXES: Final = Rule(
    "parallel-axes", "warning", "the convention cannot tilt parallel axes: give `beta`, or convert an S-model"
)


def _parallel_axes(fit: Fit) -> list[Notice]:
    """Say which joints are parallel that the model does not let tilt against each other."""
    robot = fit.robot
    pairs = parallel_joints_without_beta(robot.convention, [dict(j.row) for j in robot.joints])
    if not pairs or not {"joint zero", "geometry"}.issubset(fit.model.groups):
        return []
    names = ", ".join(f"{a} and {b}" for a, b in pairs)
    better = {"standard-dh": "hayati", "modified-dh": "modified-hayati"}.get(
        robot.convention_name, robot.convention_name
    )
    cure = (
        "Convert the robot to the convention hayati with 'truearm convert'."
        if robot.convention_name == "s-model"
        else f"Write 'convention: {better}' in the robot file and 'beta: 0' at the link between them."
    )
    return [
        PARALLEL_AXES(
            f"Joints {names} are parallel. The model has no beta that lets them tilt against each other, so it "
            f"cannot follow the real robot. {cure}"
        )
    ]


FAR_FROM_NOMINAL: Final = Rule(
    "far-from-nominal",
    "note",
    "an angle, a joint zero or a gain moved by more than six standard deviations of its prior: a robot that was "
    "mastered badly, or not the nominal values of its controller; `compensate`, `ik` and `export` repeat it",
    cure="Check that the nominal values are those of its controller: corrections of programs are wrong by what they "
    "differ. If they are, enter wider priors in the robot file.",
    unless=frozenset({WRONG_DATA}),
)


def check_far_from_nominal(fit: Fit) -> list[Notice]:
    """Say which parameters, lengths apart, are farther from their nominal values than their priors let expect."""
    far = [
        p.name
        for p in fit.robot.parameters.values()
        if p.group in _KINEMATIC
        and (p.group, p.unit) != ("geometry", "m")
        and abs(p.value - p.nominal) > _LARGEST_MOVE * p.prior
    ]
    if not far:
        return []
    return [
        FAR_FROM_NOMINAL(
            f"{listed(far)} moved by more than {_LARGEST_MOVE:g} standard deviations of "
            f"{'its prior' if len(far) == 1 else 'their priors'}. A robot that was never mastered well is so far off."
        )
    ]


EFFECTS_IDLE: Final = Rule(
    "effects-idle",
    "warning",
    "joint effects of the robot file that are zero and that the model does not free",
    gravity=0,
)
NO_LOADS: Final = Rule(
    "no-loads",
    "warning",
    "a model with compliance, and a robot without masses and payload",
    cure="Give masses in the robot file, or `payload`.",
)
BEARING_ASSUMED: Final = Rule(
    "bearing-assumed",
    "warning",
    "the robot file does not say where bearings of joints that tilt lie; they are [taken at the joints' "
    "origins](models.md#bearings)",
    gravity=0,
)
TOO_MANY_EFFECTS: Final = Rule(
    "too-many-effects", "warning", "the data inform too many parameters of joint effects by less than half"
)
NEGATIVE_EFFECT: Final = Rule(
    "negative-effect",
    "warning",
    "a compliance, a backlash or a clearance came out negative: masses, payload or gravity may be wrong",
)
EFFECTS_UNINFORMED: Final = Rule(
    "effects-uninformed", "warning", "parameters of joint effects that the data do not inform, by name", gravity=0
)


def _check_effects(fit: Fit) -> list[Notice]:
    """Say which joint effects the data know nothing about, and which came out as no spring can be."""
    robot, notices = fit.robot, []
    idle = [
        effect.name
        for effect in robot.effects
        if effect.parameters
        and effect.name not in fit.model.effects
        and not any(p.name in fit.free.names for p in effect.parameters)
        and all(robot.values[p.name] == p.value for p in effect.parameters)
    ]
    if idle and fit.start.proof is None:  # a calibrated robot has what its calibration had
        notices.append(
            EFFECTS_IDLE(
                f"The robot file has the joint effects {', '.join(idle)} with all values zero, and the model "
                f"{fit.model.name} does not free them. Add `effects={idle[0]}`, or take them out of the file."
            )
        )
    # What is expected of curves follows from the data: most of their many coefficients are meant to stay near zero.
    effects = {p.name for effect in robot.effects if effect.name != JointCurve.name for p in effect.parameters}
    own = [name for name in fit.free.names if name in effects]
    unknown = [name for name in own if fit.parameter_status(name) == "uninformed"]
    unknown += [r.dropped for r in fit.redundancies if r.dropped in effects]
    if any(effect.loaded for effect in robot.effects) and not has_weight(robot):
        notices.append(
            NO_LOADS(
                "The robot has no link masses and no payload, so nothing loads its joints. Compliance cannot be found."
            )
        )
    elif unknown and not fit.model.weighed:
        notices.append(
            EFFECTS_UNINFORMED(
                f"The data say nothing about {', '.join(unknown)}. Either nothing loads these joints that way (gravity "
                "does not turn a vertical axis), or there are too few configurations for so many effects. The values "
                "stay near zero."
            )
        )
    if fit.model.weighed:  # what the data do not tell has shrunk, and its uncertainty is counted
        return [*notices, *_check_signs(fit)]
    tilting = {p.name for effect in robot.effects if effect.tilts and effect.loaded for p in effect.parameters}
    assumed = [
        joint.name
        for number, joint in enumerate(robot.joints, 1)
        if joint.bearing is None and any(name in tilting and name.endswith(f"_{number}") for name in own)
    ]
    if assumed:
        notices.append(
            BEARING_ASSUMED(
                f"The robot file does not say where on their axes the bearings of {listed(assumed)} lie. They are "
                "taken at the joints' origins, and so are the moments that tilt them. If drawings tell, enter "
                "the entry bearing of these joints in the robot file."
            )
        )
    vague = [name for name in own if name not in unknown and (robot.parameters[name].informed or 1.0) < _LEAST_INFORMED]
    if len(vague) > _LARGEST_UNINFORMED_SHARE * len(own):
        notices.append(
            TOO_MANY_EFFECTS(
                f"Of {len(own)} parameters of joint effects, {len(vague)} rest more on their priors than on the data: "
                f"{', '.join(vague[:8])}{' and others' if len(vague) > 8 else ''}. There are too few configurations "
                f"for so many effects. Measure more, or use `model=auto`, which weighs them."
            )
        )
    return [*notices, *_check_signs(fit)]


def _check_signs(fit: Fit) -> list[Notice]:
    """Say which springs, plays and gaps came out negative."""
    soft = _negative(fit)
    if not soft:
        return []
    return [
        NEGATIVE_EFFECT(
            f"{', '.join(soft)} came out negative, as no spring and no play is: masses, payload or gravity may be "
            "wrong, or the parameter stands for something else that the model lacks."
        )
    ]


def _negative(fit: Fit) -> list[str]:
    """Return which springs, plays and gaps came out negative, and of which two the sum did.

    Two joints may move a target in the same way: only the sum of their parameters is known then, and neither alone.
    """
    of = fit.robot.parameters
    places = [
        place
        for place, name in enumerate(fit.free.names)
        if of[name].group in NON_NEGATIVE and fit.parameter_status(name) == "identified"
    ]
    names, spread = fit.free.names, fit.covariance
    negative = {i: names[i] for i in places if of[names[i]].value < -_NEGATIVE_DEVIATIONS * math.sqrt(spread[i, i])}
    for i, j in combinations([place for place in places if place not in negative], 2):
        total, variance = of[names[i]].value + of[names[j]].value, spread[i, i] + spread[j, j] + 2.0 * spread[i, j]
        better_known = variance < min(spread[i, i], spread[j, j])
        if (
            of[names[i]].group == of[names[j]].group
            and better_known
            and total < -_NEGATIVE_DEVIATIONS * math.sqrt(variance)
        ):
            negative[i] = f"the sum of {names[i]} and {names[j]}"
    return [negative[place] for place in sorted(negative)]
