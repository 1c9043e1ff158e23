"""The steps for what is wrong with configurations, for what moved, and for another model, in words."""

from __future__ import annotations

import math
from typing import Final

from truearm.identification.judging.changes import Change
from truearm.identification.judging.left_over import LeftOver
from truearm.identification.judging.next_step import NextStep
from truearm.identification.judging.off_configurations import Off, OffConfiguration
from truearm.identification.judging.unmodelled import GEOMETRY, LOADS, PAYLOAD, Explanation
from truearm.identification.solving.fit import Fit
from truearm.modeling.effects.fourier import Fourier
from truearm.modeling.effects.joint_curve import JointCurve
from truearm.shown import counted, listed

#: Configurations named one by one.
_NAMED: Final = 3


def measured_again(left: LeftOver, off: Off, known: float, *, checked: bool) -> list[NextStep]:
    """Return the step for configurations that are off one by one."""
    if not off.configurations:
        return []
    labels = ",".join(left.problem.data.labels[index] for index in sorted(off.indices))
    gain = known * (1.0 - off.left)
    if off.in_a_row:
        names = [left.problem.data.labels[index] for index in sorted(off.indices)]
        size = math.sqrt(sum(one.distance**2 for one in off.configurations) / len(names))
        how = "them out of the calibration" if checked else f"them out (`without={labels}`)"
        words = (
            f"Measure configurations {names[0]} to {names[-1]} again, or leave {how}: they were measured one after the "
            f"other and are off by about {size * 1e3:.2g} mm, so something moved meanwhile."
        )
        return [NextStep("measure-again", words, gain)]
    said = [_off_by(left, one) for one in off.configurations[:_NAMED]]
    rest = len(off.configurations) - len(said)
    if rest:
        others = [left.problem.data.labels[one.index] for one in off.configurations[_NAMED:]]
        said.append(f"{counted(rest, 'more configuration')} ({listed(others)})")
    out = "leave them out" if len(off.configurations) > 1 else "leave it out"
    way = f"{out} of the calibration" if checked else f"{out} (`without={labels}`)"
    what = "Measure these again" if len(off.configurations) > 1 else "Measure again"
    return [NextStep("measure-again", f"{what}, or {way}: {'; '.join(said)}.", gain)]


def _off_by(left: LeftOver, off: OffConfiguration) -> str:
    """Say what is wrong with a configuration."""
    label = left.problem.data.labels[off.index]
    if off.joint is not None:
        which = f"joint {off.joint.number} of configuration {label}"
        if off.joint.sign:
            return f"the sign of {which} looks wrong"
        turns = left.fit.robot.joints[off.joint.number - 1].kind == "revolute"
        size = f"{math.degrees(abs(off.joint.error)):.2g} deg" if turns else f"{abs(off.joint.error) * 1e3:.2g} mm"
        return f"{which} looks off by about {size}"
    where = f"target {off.target} of " if off.target else ""
    return f"{where}configuration {label} is off by {off.distance * 1e3:.2g} mm"


def about_change(left: LeftOver, change: Change, known: float) -> NextStep:
    """Return the step for what moved during the campaign."""
    label = left.problem.data.labels[change.first]
    gain = known * (1.0 - math.sqrt(max(1.0 - change.share, 0.0)))
    words = {
        "instrument-moved": f"The instrument or the robot's base moved before configuration {label}: name it in "
        f"`base_changes={label}`, or measure again from there.",
        "target-moved": f"Target {change.what} was seated anew before configuration {label}: give it another name from "
        "there on.",
        "joint-zero-jumped": f"The zero of joint {change.what} jumped before configuration {label}: find out why, and "
        "measure again from there or calibrate the parts apart.",
        "drift": "Everything drifted during the campaign: measure reference points along with the targets, or let the "
        "arm and the instrument warm up first.",
    }
    return NextStep(change.kind, words[change.kind], gain)


def other_model(fit: Fit, found: Explanation, known: float) -> NextStep:
    """Return the step for what would explain what is left."""
    gain = known * (1.0 - found.left)
    share = f"{1.0 - found.left:.0%}"
    if found.cause == PAYLOAD:
        given = fit.robot.payload.mass
        what = f"about {found.mass:.2g} kg" if found.mass else "another load"
        words = (
            f"Check what the robot carried (`payload`) and the masses in the robot file: {what} on the flange instead "
            f"of {given:g} kg would explain {share} of what is left."
            if given
            else f"Give what the robot carried (`payload`): {what} on the flange instead of none would explain {share} "
            "of what is left."
        )
        return NextStep("give-payload", words, gain)
    if found.cause == LOADS:
        words = (
            f"Joints that give way explain {share} of what is left, but the robot has no masses: give masses in the "
            "robot file or what it carried (`payload`), and use `model=elastic`."
        )
        return NextStep("give-loads", words, gain)
    if found.cause == GEOMETRY:
        words = f"Use `model=geometric`: free geometry and joint zeros explain {share} of what is left."
        return NextStep("other-model", words, gain)
    plain = "geometry" in fit.model.groups and not fit.model.effects
    if found.cause == "compliance" and plain:
        return NextStep(
            "other-model", f"Use `model=elastic`: joints that give way explain {share} of what is left.", gain
        )
    if found.cause == Fourier.name:
        words = (
            f"Add `effects={found.cause}`, or `effects={JointCurve.name}`, which contains it and is found from some "
            f"100 configurations on, or let `model=auto` choose: it explains {share} of what is left."
        )
        return NextStep("other-model", words, gain)
    words = f"Add `effects={found.cause}`, or let `model=auto` choose: it explains {share} of what is left."
    return NextStep("other-model", words, gain)
