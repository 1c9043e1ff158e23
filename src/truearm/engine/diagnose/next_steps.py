"""What to do next after a fit and after a check: the most useful first, with the gain to expect.

Every gain is an estimate near the solution of the fit and costs no other fit. A gain of an effect, or of leaving
configurations out, is a share of what the fit leaves, times the error that is known. More configurations gain what the
variance of the parameters adds to the predictions: twice as many halve it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import Notice, counted, listed
from truearm.engine.data.statistics import Errors
from truearm.engine.diagnose.case import MISNAMED, Case
from truearm.engine.diagnose.changes import Change, is_a_part
from truearm.engine.diagnose.curves import about_curves, has_curves
from truearm.engine.diagnose.far_off import ORIENTATION_OUTLIERS
from truearm.engine.diagnose.gain import NO_GAIN, WORSE
from truearm.engine.diagnose.narrow_data import (
    CURE,
    FEW_READINGS,
    expected_where_measured,
    joints_that_moved_little,
    least_known,
)
from truearm.engine.diagnose.next_step import MOST, NextStep, most_useful_first
from truearm.engine.diagnose.off_configurations import Off, OffConfiguration, off_configurations
from truearm.engine.diagnose.unmodelled import (
    GEOMETRY,
    HIDING,
    LIKELY,
    LOADS,
    PAYLOAD,
    Explanation,
    LeftOver,
    can_explain,
    explanation,
    without_bending,
)
from truearm.engine.fit.fit import Fit, Status
from truearm.engine.robot.chain import Array

#: Configurations named one by one.
_NAMED: Final = 3


def measured_again(
    left: LeftOver, off: Off, known: float, noticed: Sequence[Notice], *, checked: bool
) -> list[NextStep]:
    """Return the step for configurations that are off one by one, but for those whose names or rows are put right."""
    named = {label for notice in noticed if notice.code in MISNAMED for label, _ in notice.at}
    rest = tuple(one for one in off.configurations if left.problem.data.labels[one.index] not in named)
    gain: float | None = known * (1.0 - off.left)
    if len(rest) < len(off.configurations):  # what those gain is in it
        off, gain = replace(off, configurations=rest, in_a_row=False), None
    if not off.configurations:
        return []
    labels = ",".join(left.problem.data.labels[index] for index in sorted(off.indices))
    if off.in_a_row:
        names = [left.problem.data.labels[index] for index in sorted(off.indices)]
        size = math.sqrt(sum(configuration.distance**2 for configuration in off.configurations) / len(names))
        leaving = "them out of the calibration" if checked else f"them out (`without={labels}`)"
        words = (
            f"Measure configurations {names[0]} to {names[-1]} again, or leave {leaving}: they were measured one after "
            f"the other and are off by about {size * 1e3:.2g} mm, so something moved meanwhile."
        )
        return [NextStep("measure-again", words, gain)]
    items = [_off_by(left, configuration) for configuration in off.configurations[:_NAMED]]
    more = len(off.configurations) - len(items)
    if more:
        others = [left.problem.data.labels[configuration.index] for configuration in off.configurations[_NAMED:]]
        items.append(f"{counted(more, 'more configuration')} ({listed(others)})")
    out = "leave them out" if len(off.configurations) > 1 else "leave it out"
    way = f"{out} of the calibration" if checked else f"{out} (`without={labels}`)"
    start = "Measure these again" if len(off.configurations) > 1 else "Measure again"
    return [NextStep("measure-again", f"{start}, or {way}: {'; '.join(items)}.", gain)]


def _off_by(left: LeftOver, off: OffConfiguration) -> str:
    """Say what is wrong with a configuration."""
    label = left.problem.data.labels[off.index]
    if off.joint is not None:
        joint = f"joint {off.joint.number} of configuration {label}"
        if off.joint.sign:
            return f"the sign of {joint} looks wrong"
        turns = left.fit.robot.joints[off.joint.number - 1].kind == "revolute"
        size = f"{math.degrees(abs(off.joint.error)):.2g} deg" if turns else f"{abs(off.joint.error) * 1e3:.2g} mm"
        return f"{joint} looks off by about {size}"
    of_target = f"target {off.target} of " if off.target else ""
    return f"{of_target}configuration {label} is off by {off.distance * 1e3:.2g} mm"


def about_change(left: LeftOver, change: Change, known: float) -> NextStep:
    """Return the step for what moved during the campaign."""
    label = left.problem.data.labels[change.first]
    gain = known * (1.0 - math.sqrt(max(1.0 - change.share, 0.0)))
    words = {
        "instrument-moved": f"The instrument or the robot's base moved before configuration {label}: name it in "
        f"`base_changes={label}`, or measure again from there.",
        "target-moved": f"Target {change.subject} was seated anew before configuration {label}: give it another name "
        "from there on.",
        "joint-zero-jumped": f"The zero of joint {change.subject} jumped before configuration {label}: find out why, "
        "and measure again from there or calibrate the parts apart.",
        "drift": "Everything drifted during the campaign: measure reference points along with the targets, or let the "
        "arm and the instrument warm up first.",
    }
    return NextStep(change.kind, words[change.kind], gain)


def other_model(fit: Fit, candidate: Explanation, known: float) -> NextStep:
    """Return the step for what would explain what is left."""
    gain = known * (1.0 - candidate.left)
    share = f"{1.0 - candidate.left:.0%}"
    if candidate.cause == PAYLOAD:
        stated = fit.robot.payload.mass
        mass = f"about {candidate.mass:.2g} kg" if candidate.mass else "another load"
        words = (
            f"Check what the robot carried (`payload`) and the masses in the robot file: {mass} on the flange instead "
            f"of {stated:g} kg would explain {share} of what is left."
            if stated
            else f"Give what the robot carried (`payload`): {mass} on the flange instead of none would explain {share} "
            "of what is left."
        )
        return NextStep("give-payload", words, gain)
    if candidate.cause == LOADS:
        words = (
            f"Joints that give way explain {share} of what is left, but the robot has no masses: give masses in the "
            "robot file or what it carried (`payload`)."
        )
        return NextStep("give-loads", words, gain)
    if candidate.cause == GEOMETRY:
        words = f"Use `model=geometric`: free geometry and joint zeros explain {share} of what is left."
        return NextStep("other-model", words, gain)
    words = f"Use `model=auto`, which has every joint effect: {candidate.cause} explains {share} of what is left"
    if candidate.together is not None:
        gain, share = known * (1.0 - candidate.together), f"{1.0 - candidate.together:.0%}"
        words += f", all together {share}"
    words += "."
    return NextStep("other-model", words, gain)


#: Share of the error that twice as many configurations must gain for more to be advised.
_LEAST_GAIN: Final = 0.1
#: Root mean square of what is left over the declared deviation, up to which it is the instrument's noise.
_AT_THE_NOISE: Final = 1.3
#: Share of the variance of what is left that errors of the joints may have where it is called noise.
_OF_THE_JOINTS: Final = 0.5
#: Errors of the joints that are called repeatability [rad]: 0.1 mm at the reach of a UR5, its pose repeatability.
_REPEATED: Final = math.radians(0.007)
#: Mean length of three normal coordinates over the deviation of one.
_LENGTH: Final = 2.0 * math.sqrt(2.0 / math.pi)
#: Steps to a model that has what the present one lacks, and how many times as much as by other steps must be gained by
#: them for the others to come after.
_ANOTHER_MODEL: Final = frozenset({"other-model", "give-loads", "give-payload"})
_FAR_MORE: Final = 2.0
#: Joints named one by one.
_NAMED_NEXT_STEPS: Final = 3
#: Errors that steps of their own are about.
_OWN_STEP: Final = frozenset(
    {
        *("instrument-moved", "target-moved", "joint-zero-jumped"),
        *("narrow-data", "rank-loss", "priors-decide", "not-converged", FEW_READINGS.code, WORSE.code),
    }
)
#: Warnings whose cure comes before more configurations.
_CURED_FIRST: Final = (
    "parallel-axes",
    "no-loads",
    "reference-moved",
    "targets-swapped",
    "target-mistaken",
    "rows-shifted",
    "joints-mistaken",
    ORIENTATION_OUTLIERS.code,
    "outliers",
    "joints-not-settled",
    "joints-rounded",
    "separate-visits",
    "payload-unlikely",
    "sigma-too-large",
    "transmission-error",
    "large-residual",
    WORSE.code,
    NO_GAIN.code,
)
#: Those that any other step may explain.
_EXPLAINED: Final = frozenset({WORSE.code, NO_GAIN.code, "large-residual"})
#: Those that configurations which are off explain.
_OF_CONFIGURATIONS: Final = frozenset({"outliers", "joints-mistaken", WORSE.code, NO_GAIN.code})


def steps_after_fit(case: Case, notices: Sequence[Notice]) -> tuple[NextStep, ...]:
    """Return at most three things to do after a fit, the most useful first; one at least."""
    first = _to_fix(notices)
    if case.status in (Status.NOT_CONVERGED, Status.IMPLAUSIBLE):
        first = first or [NextStep("fix-data", case.status.advice)]
    if case.biased and any(notice.code == ORIENTATION_OUTLIERS.code for notice in notices):
        first = first or _cures([n for n in notices if n.code == ORIENTATION_OUTLIERS.code], [])
    if first:
        return tuple(first)
    left, known = case.left, _known(case.errors)
    steps, remaining = _of_left_over(left, case.off, case.moved, case.lacking, known, notices, checked=False)
    bound = _at_bound(case, remaining)
    spoiled = (
        case.moved is not None
        or any(step.gain is not None for step in bound)
        or any(step.code == "measure-again" for step in steps)
    )
    if not left.fit.unobservable and not spoiled:
        steps += _after(steps, _more(case, notices, remaining))
    steps += _cures(notices, steps)
    steps += bound
    if not case.held_out:
        steps.append(NextStep("hold-out", "Hold configurations out to judge the fit: leave `train=all` out."))
    if left.fit.unobservable:
        more = NextStep("measure-more", _where_to_measure(case, f"determine {listed(left.fit.unobservable)}"))
        return (more, *most_useful_first(steps))[:MOST]
    if any(notice.code == FEW_READINGS.code for notice in notices):
        more = NextStep("measure-more", CURE)
        return (more, *most_useful_first(step for step in steps if step.code != more.code))[:MOST]
    return most_useful_first(steps or [_end(left, case.training.configurations)])


def steps_after_check(
    notices: Sequence[Notice],
    left: LeftOver | None = None,
    errors: Errors | None = None,
    moved: tuple[LeftOver, Change] | None = None,
    *,
    robot: bool = True,
) -> tuple[NextStep, ...]:
    """Return at most three things to do after a check, the most useful first; one at least.

    Args:
        left: What a robust geometric fit leaves of the readings; None without one.
        errors: Of that fit.
        moved: What moved during the campaign.
        robot: Whether the data were compared with a robot.
    """
    fix = _to_fix(notices)
    if fix:
        return tuple(fix)
    steps: list[NextStep] = []
    if left is not None and errors is not None:
        off = off_configurations(left)
        # A robot that was calibrated with effects has them already: what is left is of something else.
        lacking = None if left.fit.start.proof and left.fit.start.effects else explanation(left, off.indices)
        steps, _ = _of_left_over(left, off, moved, lacking, _known(errors), notices, checked=True)
    cures = _cures(notices, steps)
    if any(notice.code in MISNAMED for notice in notices):
        return (*cures, *most_useful_first(steps))[:MOST]
    steps += cures
    if any(notice.code == FEW_READINGS.code for notice in notices):
        steps.append(NextStep("measure-more", CURE))
    elif not robot:
        steps.append(NextStep("check-robot", "Check them together with the nominal robot too."))
    elif moved is None and not any(step.code in ("other-model", "give-loads") for step in steps):
        explainable = left is not None and can_explain(left)
        also = " No joint effect would explain more of the readings." if explainable else ""
        steps.append(NextStep("calibrate", f"Calibrate the robot.{also}"))
    return most_useful_first(steps)


def _of_left_over(
    left: LeftOver,
    off: Off,
    moved: tuple[LeftOver, Change] | None,
    candidate: Explanation | None,
    known: float,
    noticed: Sequence[Notice],
    *,
    checked: bool,
) -> tuple[list[NextStep], float]:
    """Return what to do about what a fit leaves, and the error without configurations that are off [m].

    Args:
        candidate: What would explain what is left.
    """
    share, known_moved = 1.0, known
    if candidate is not None and (off.configurations or candidate.left < HIDING):
        # What a model lacks may be large at a few configurations, which are then not wrong, and hide others that are.
        still = off_configurations(without_bending(left, candidate.cause))
        share = 1.0 if off.configurations else candidate.left
        if set(still.indices) - set(off.indices):
            candidate = explanation(left, still.indices) or candidate
        off = still
        known_moved = known * candidate.left
    is_moved = moved is not None and is_a_part(off)
    steps = [] if is_moved else measured_again(left, off, known * share, noticed, checked=checked)
    remaining = known * off.left
    if moved is not None:
        steps.append(about_change(*moved, known_moved * off.left))
    if candidate is not None and (moved is None or candidate.cause in LIKELY):  # what moved looks like an effect, too
        step = other_model(left.fit, candidate, remaining)
        # After a check all effects are still to come: what they gain without the loads is not known.
        steps.append(replace(step, gain=None) if checked and candidate.cause == LOADS else step)
    return steps, remaining


def _known(errors: Errors) -> float:
    """Return the mean error of positions, or else of lengths [m]."""
    spread = errors.position or errors.length
    return 0.0 if spread is None else spread.mean


def _to_fix(notices: Sequence[Notice]) -> list[NextStep]:
    """Return the step that fixes what makes all other advice worthless."""
    codes = list(dict.fromkeys(n.code for n in notices if n.level == "error" and n.code not in _OWN_STEP))
    if not codes:
        return []
    subject = "the error" if len(codes) == 1 else "the errors"
    return [NextStep("fix-data", f"Fix first what {subject} {listed(codes)} names: nothing else can be judged before.")]


def _cures(notices: Sequence[Notice], steps: Sequence[NextStep]) -> list[NextStep]:
    """Return the step that cures what warnings are about, if no other step does."""
    again = any(step.code == "measure-again" for step in steps)
    present = [n.code for n in notices if n.level != "note" or n.code == "outliers"]
    codes = [code for code in _CURED_FIRST if code in present and not (again and code in _OF_CONFIGURATIONS)]
    codes = [code for code in codes if not (steps and code in _EXPLAINED)]
    if not codes:
        return []
    subject = "the warning" if len(codes) == 1 else "the warnings"
    return [NextStep("see-warning", f"Do what {subject} {listed(codes)} below {'says' if len(codes) == 1 else 'say'}.")]


def _at_bound(case: Case, known: float) -> list[NextStep]:
    """Return the step for values at bounds; without bounds the parameters would take what they can."""
    if case.status is not Status.AT_BOUND:
        return []
    r = case.left.residual
    before, after = float(np.linalg.norm(r)), float(np.linalg.norm(case.left.without_parameters(r)))
    gain = known * (1.0 - after / before) if before > 0.0 and 1.0 - after / before > _LEAST_GAIN else None
    return [NextStep("widen-bound", f"Widen the bound of {listed(case.left.fit.at_bound)} if it was a guess.", gain)]


def _more(case: Case, notices: Sequence[Notice], known: float) -> list[NextStep]:
    """Return the step for more configurations, if they would gain something."""
    noise, parameters = _variances(case)
    narrow = any(notice.code == "narrow-data" for notice in notices)
    before, after = (math.sqrt(noise + part * parameters) for part in (1.0, 0.5))
    if not narrow and (before == 0.0 or 1.0 - after / before < _LEAST_GAIN):
        return []
    n = case.training.configurations
    if narrow and has_curves(case.left.fit) and joints_that_moved_little(case.left.fit, case.training):
        fit = replace(case.left.fit, joint_error=case.expected.joint_error)
        over = case.expected.overall.mean - expected_where_measured(fit, case.training)
        words = _where_to_measure(case, "know the whole workspace as well as where was measured")
        return [NextStep("measure-more", f"{words} The gain is over the workspace.", max(over, 0.0))]
    gain = None if narrow and 1.0 - after / before < _LEAST_GAIN else known * (1.0 - after / before)
    held_out = case.left.problem.data.configurations - n
    train = " Or train on more of them: `train`." if held_out >= n else ""
    words = _where_to_measure(case, f"halve what {n} leave uncertain, as {n} more would")
    return [NextStep("measure-more", words + train, gain)]


def _after(steps: Sequence[NextStep], more: list[NextStep]) -> list[NextStep]:
    """Return the step for more configurations as a second one, where another model gains far more.

    What more configurations gain was estimated without what the model lacks, and is not told then.
    """
    first = max((step.gain or 0.0 for step in steps if step.code in _ANOTHER_MODEL), default=0.0)
    return [
        NextStep(step.code, f"After that: {step.message[0].lower()}{step.message[1:]}")
        if step.gain is not None and first > _FAR_MORE * step.gain
        else step
        for step in more
    ]


def _where_to_measure(case: Case, purpose: str) -> str:
    """Say where to measure more."""
    few = joints_that_moved_little(case.left.fit, case.training)
    if few:
        region = f"in which these joints move further: {'; '.join(few[:_NAMED_NEXT_STEPS])}"
    elif case.left.fit.unobservable or case.left.fit.gauge_freedoms:
        region = "all over the workspace"
    else:
        region = f"also {least_known(case.left.fit)}"
    return f"Measure more configurations to {purpose}: {region}."


def _variances(case: Case) -> tuple[float, float]:
    """Return the variance of a coordinate by what the fit leaves, and by its parameters [m^2].

    The parameters' is that at the measured configurations, or that over the workspace if it is larger.
    """
    left = case.left
    metres = _metres(left)
    used = metres > 0.0
    if not used.any():
        return 0.0, 0.0
    J = left.jacobian[used] * metres[used][:, None]
    parameters = float(np.mean(np.sum((J @ left.fit.covariance) * J, axis=1)))
    r = left.without_parameters(left.residual)[used] * metres[used]
    noise = float(r @ r) / len(r) * len(left.residual) / max(left.freedom, 1)
    if not left.fit.joint_error.any() and not left.fit.gauge_freedoms:
        parameters = max(parameters, (case.expected.overall.mean / _LENGTH) ** 2)
    return noise, parameters


def _metres(left: LeftOver) -> Array:
    """Return the deviation of each row [m], zero for angles."""
    blocks = left.problem.blocks
    return np.concatenate(
        [np.repeat(b.sigma if b.observation.unit == "m" else 0.0 * b.sigma, b.observation.components) for b in blocks]
    )


def _unexplained(first: str, untold: str, last: str) -> str:
    """Say that something is left, what of joint curves cannot be told, and what to look at."""
    again = f"isit a few postures again to see how well the robot repeats, {last}"
    if untold:
        return f"{first}, and no other effect known here explains it. {untold} If they are not it, v{again}"
    return f"{first}, and no effect known here explains it. V{again}"


def _by_joints(left: LeftOver, metres: Array, used: NDArray[np.bool_]) -> tuple[float, float]:
    """Return what errors of the joints make of a coordinate [m], root mean square, and the largest of them [rad].

    Args:
        metres: Deviation of each row [m], ``(rows,)``.
        used: Rows that are lengths, ``(rows,)``.
    """
    fit = left.fit
    if not fit.joint_error.any() or not used.any():
        return 0.0, 0.0
    vector = np.array([fit.robot.values[name] for name in fit.free.names])
    squares = (left.problem.at(vector).by_joints[used] * metres[used][:, None]) ** 2 @ fit.joint_error**2
    return math.sqrt(float(np.mean(squares))), float(fit.joint_error.max())


def _end(left: LeftOver, configurations: int | None = None) -> NextStep:
    """Say that it is done, or that nothing known here explains what is left.

    Args:
        configurations: That the fit was made from; all of the readings if None.
    """
    fit = left.fit
    untold = about_curves(fit, left.problem.data.configurations if configurations is None else configurations)
    metres = _metres(left)
    used = metres > 0.0
    r = left.without_parameters(left.residual)
    spread = math.sqrt(len(left.residual) / max(left.freedom, 1))
    size = spread * float(np.sqrt(np.mean((r[used] * metres[used]) ** 2))) if used.any() else 0.0
    noise = float(np.sqrt(np.mean(metres[used] ** 2))) if used.any() else 0.0
    figure = f"{size * 1e3:.2g} mm in each coordinate"
    shared, missed = _by_joints(left, metres, used)
    is_repeatability = shared > 0.0 and missed <= _REPEATED and size <= _AT_THE_NOISE * math.hypot(noise, shared)
    if fit.declared and size > _AT_THE_NOISE * noise and not is_repeatability:
        first = f"What is left ({figure}) is {size / noise:.2g} times the declared noise"
        return NextStep("unexplained", _unexplained(first, untold, "and check sigma."))
    if not fit.declared and shared**2 > _OF_THE_JOINTS * size**2 and not is_repeatability:
        return NextStep(
            "unexplained",
            _unexplained(
                f"What is left ({figure}) is shared by the readings of a configuration",
                untold,
                "which is what is left if they scatter as much.",
            ),
        )
    known = "is the instrument's noise" if fit.declared else "looks like the instrument's noise"
    if is_repeatability and size > _AT_THE_NOISE * noise:
        known += f" and errors of the joints of {math.degrees(missed):.2g} deg, to which good arms repeat"
    effects = (
        ", and no effect known here explains more of it."
        if can_explain(left)
        else ", and every joint effect known here is in the model."
        if fit.model.weighed
        else ". The curves leave too few equations to try other joint effects beside them: `model=auto` has them all."
        if has_curves(fit)
        else ". There are too few readings to tell whether joint effects would explain more of it."
    )
    better = "" if fit.declared else " If the instrument is better than that, say so in a column sigma."
    return NextStep("stop", f"Stop here: what is left ({figure}) {known}{effects}{better}")
