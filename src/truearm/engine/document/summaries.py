"""What several results say of a fit: figures in words and as JSON holds them, in mm and mrad."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from truearm.engine.base.errors import counted, degrees, listed, millimetres
from truearm.engine.base.units import from_si
from truearm.engine.data.observations import OBSERVATIONS
from truearm.engine.data.statistics import Errors, Spread
from truearm.engine.diagnose.expected_error import Expectation, ExpectedError
from truearm.engine.diagnose.gain import Repeatability
from truearm.engine.diagnose.least_error import Kind, LeastError
from truearm.engine.document.document import Block, detail, say
from truearm.engine.fit.every_effect import Shares
from truearm.engine.fit.fit import Fit
from truearm.engine.fit.refit import Refit
from truearm.engine.robot.parts import Payload

#: Effects that are named, the largest first.
_LARGEST_SHARES: Final = 4
#: What an effect moves the targets by from which it is shown [m].
_SHOWN_SHARE: Final = 5e-6
#: What deviations of a bootstrap follow from, after their number.
BOOTSTRAPPED: Final = "fits to configurations drawn anew (bootstrap)"


def shares_block(shares: Shares) -> Block:
    """Return what every effect does: by how much it moves the targets, in mm."""
    moving = [share for share in shares.effects if (share.moves or 0.0) >= _SHOWN_SHARE]
    largest = ", ".join(f"{share.effect} {(share.moves or 0.0) * 1e3:.3f}" for share in moving[:_LARGEST_SHARES])
    more = len(moving) - _LARGEST_SHARES
    smaller = f", and {more} smaller" if more > 0 else ""
    text = f"Effects that move the targets [mm]: {largest or f'none by {_SHOWN_SHARE * 1e3:g}'}{smaller}"
    figures = {
        "candidates": [
            {
                "effect": share.effect,
                "taken": share.taken,
                "moves_mm": None if share.moves is None else share.moves * 1e3,
                "known": share.known,
                "parameters": share.parameters,
                "reason": share.reason,
            }
            for share in shares.effects
        ],
        "lines": [
            {
                "joint": line.joint,
                "periods": line.periods,
                "aliases": list(line.aliases),
                "amplitude_mdeg": math.degrees(line.amplitude) * 1e3,
                "chance": line.chance,
            }
            for line in shares.lines
        ],
    }
    return say(text, selection=figures)


def errors_summary(errors: Errors) -> dict[str, Any]:
    """Return error statistics in mm and mrad, as JSON holds them."""
    summary: dict[str, Any] = {"configurations": errors.configurations}
    for key, spread, scale in (
        ("position_mm", errors.position, 1e3),
        ("orientation_mrad", errors.orientation, 1e3),
        ("length_mm", errors.length, 1e3),
    ):
        if spread is not None:
            summary[key] = _scaled(spread, scale)
    return summary


def refit_block(refit: Refit) -> Block:
    """Return what was found anew, by how much it moved, and what that means for the errors, in mm and deg."""
    from_these = f"found anew from {counted(refit.readings, 'reading')} ({counted(refit.parameters, 'number')})"
    turned = "" if refit.turn is None else f" and turned by {degrees(refit.turn)} deg"
    moved = f"moved by {millimetres(refit.shift)} mm"
    each = listed([f"{name} {millimetres(shift)}" for name, shift in refit.shifts.items()])
    words = {
        "base": f"The base was {from_these}: the readings {moved} at their middle{turned}.",
        "tool": f"The tool was {from_these}: it {moved} at the middle of its targets{turned}.",
        "targets": f"The targets were {from_these}; they moved on the flange by (mm): {each}.",
    }
    if refit.moved == "base" and refit.shifts:
        words["base"] = f"The fixtures were {from_these}; they moved before the base by (mm): {each}."
    return say(
        words[refit.moved],
        "The errors of each configuration are those of what is found without it.",
        refit={
            "moved": refit.moved,
            "readings": refit.readings,
            "parameters": refit.parameters,
            "shift_mm": refit.shift * 1e3,
            "turn_deg": None if refit.turn is None else math.degrees(refit.turn),
            "shifts_mm": {name: shift * 1e3 for name, shift in refit.shifts.items()},
        },
    )


def joint_error_text(fit: Fit) -> str:
    """Return what readings of a configuration share as an error of each joint, empty if nothing; by kind of joint."""
    by_unit = dict[str, list[float]]()
    for joint, error in zip(fit.robot.joints, fit.joint_error.tolist(), strict=True):
        if error > 0.0:
            by_unit.setdefault("deg" if joint.kind == "revolute" else "mm", []).append(error)
    shown = [
        f"{'up to ' if min(errors) < max(errors) else ''}{from_si(max(errors), unit):.2g} {unit}"
        for unit, errors in by_unit.items()
    ]
    return " and ".join(shown)


def noise_blocks(fit: Fit, again: Repeatability | None) -> Iterator[Block]:
    """Give deviations of readings, what those of a configuration share, and how well the robot comes back.

    In mm, mrad and deg. The deviation of joints is one for all of a kind, or one for each, as it is estimated.
    """
    shared = joint_error_text(fit)
    words = f"errors of the joints of {shared}, repeatability plus what the model leaves"
    units = {observation.name: observation.unit for observation in OBSERVATIONS}
    alike: dict[tuple[str, float], list[int]] = {}
    for number, (joint, error) in enumerate(zip(fit.robot.joints, fit.joint_error.tolist(), strict=True), 1):
        alike.setdefault((joint.kind, error), []).append(number)
    yield detail(
        *([f"Shared by the readings of a configuration: {words}"] if shared else []),
        sigma={f"{name}_{'mm' if units[name] == 'm' else 'mrad'}": value * 1e3 for name, value in fit.sigma.items()},
        declared=fit.declared,
        excess=fit.excess,
        joint_error=[
            {
                "kind": kind,
                "joints": joints,
                "unit": (unit := "deg" if kind == "revolute" else "mm"),
                "deviation": from_si(error, unit),
            }
            for (kind, error), joints in alike.items()
        ],
        scattered=fit.scattered,
    )
    if fit.bootstrap:
        yield detail(f"Deviations of the parameters: from {fit.bootstrap} {BOOTSTRAPPED}", bootstrap=fit.bootstrap)
    if again is None:
        yield detail(repeatability=None)
    else:
        yield detail(
            f"Repeatability at {counted(again.postures, 'posture')} visited again, as RP of ISO 9283 but pooled over "
            f"them and without the instrument's noise: {again.rp * 1e3:.2g} mm",
            repeatability={"rp_mm": again.rp * 1e3, "postures": again.postures, "visits": again.visits},
        )


def _scaled(spread: Spread, scale: float) -> dict[str, float]:
    return {
        "mean": spread.mean * scale,
        "rms": spread.rms * scale,
        "p95": spread.p95 * scale,
        "max": spread.max * scale,
    }


#: Kinds of errors and the units in which they are shown, each a thousandth of the SI one.
_UNITS: Final[dict[Kind, str]] = {"position": "mm", "orientation": "mrad", "length": "mm"}
#: What stands beside a mean error, by what the least one follows from.
_BESIDE: Final = {
    "visits": "noise and repeatability",
    "declared": "declared noise",
    "residuals": "estimated from residuals",
}


def error_line(errors: Errors, least: Mapping[Kind, LeastError] | None = None) -> str:
    """Return the statistics of one set of errors as a line, the mean that exact parameters would leave beside each."""
    parts = []
    for kind, spread in _spreads(errors):
        mean, rms, p95, largest = (value * 1e3 for value in (spread.mean, spread.rms, spread.p95, spread.max))
        unit = f"{_UNITS[kind]}{' of length' if kind == 'length' else ''}"
        beside = _beside(spread.mean, (least or {}).get(kind))
        parts.append(f"mean {mean:.3f}  rms {rms:.3f}  95 % {p95:.3f}  max {largest:.3f} {unit}{beside}")
    return "   ".join(parts) if parts else "no readings"


def _spreads(errors: Errors) -> Iterator[tuple[Kind, Spread]]:
    of_kinds: tuple[tuple[Kind, Spread | None], ...] = (
        ("position", errors.position),
        ("orientation", errors.orientation),
        ("length", errors.length),
    )
    return ((kind, spread) for kind, spread in of_kinds if spread is not None)


def _beside(mean: float, least: LeastError | None) -> str:
    """Return what stands beside a mean error [m or rad]; of what is estimated as larger than that, no figure."""
    if least is None:
        return ""
    if least.mean < mean:
        return f" ({_BESIDE[least.evidence]}: mean {least.mean * 1e3:.3f})"
    if least.evidence != "residuals":
        return f" (no more than {_BESIDE[least.evidence]})"
    if least.declared is not None and least.declared < mean:
        return f" ({_BESIDE['declared']}: mean {least.declared * 1e3:.3f})"
    return " (no more than residuals let expect)"


def least_block(errors: Errors, least: Mapping[Kind, LeastError]) -> Block:
    """Return the mean errors that exact parameters would leave, in mm and mrad, and what each follows from."""
    return detail(
        *least_words(errors, least).values(),
        least_error={
            f"{kind}_{_UNITS[kind]}": {
                "mean": of_kind.mean * 1e3,
                "evidence": of_kind.evidence,
                "declared_noise": None if of_kind.declared is None else of_kind.declared * 1e3,
                "visits": of_kind.visits,
                "postures": of_kind.postures,
            }
            for kind, of_kind in least.items()
        },
    )


def least_words(errors: Errors, least: Mapping[Kind, LeastError]) -> dict[Kind, str]:
    """Return in words what exact parameters would leave of each mean error, and how that is known."""
    return {kind: _least(spread.mean, kind, least[kind]) for kind, spread in _spreads(errors) if kind in least}


def _least(mean: float, kind: Kind, least: LeastError) -> str:
    figure, more = f"{least.mean * 1e3:.3f} {_UNITS[kind]}", "" if least.mean < mean else ", and no more was found"
    if least.evidence == "visits":
        seen = f"{counted(least.visits, 'visit')} to {counted(least.postures, 'posture')}"
        return f"Noise and repeatability alone make a mean of {figure}, as {seen} show{more}."
    if least.evidence == "declared":
        return (
            f"The declared noise alone makes a mean of {figure}{more}; repeatability is not in it (too few revisits)."
        )
    noise = "" if least.declared is None else f" The declared noise alone makes {least.declared * 1e3:.3f}."
    return (
        f"With exact parameters the mean would be {figure}, estimated from what the model leaves{more}. What the model "
        f"cannot follow is in it; only revisits tell that from noise and repeatability.{noise}"
    )


def _expectation(of: Expectation, lower_bound: bool) -> dict[str, Any]:
    low, high = (end * 1e3 for end in of.interval_90)
    return {"mean": of.mean * 1e3, "p95": of.p95 * 1e3, "interval_90": [low, None if lower_bound else high]}


def expected_blocks(expected: ExpectedError) -> Iterator[Block]:
    """Give the error to expect over the workspace, in mm."""
    mean, p95, low, high = (
        figure * 1e3 for figure in (expected.overall.mean, expected.overall.p95, *expected.overall.interval_90)
    )
    places = max(3, -math.floor(math.log10(max(mean, 1e-6))) + 1)
    if expected.lower_bound:
        figures = f"about {mean:.{places}f} mm (90 %: {low:.{places}f} or more), 95 % about {p95:.{places}f} mm"
    else:
        figures = f"{mean:.{places}f} mm (90 %: {low:.{places}f} to {high:.{places}f}), 95 % below {p95:.{places}f} mm"
    yield say(
        f"Expected over the workspace, without the instrument's noise: mean {figures}; {expected_of(expected)}",
        expected_mm={
            **_expectation(expected.overall, expected.lower_bound),
            "lower_bound": expected.lower_bound,
            "omissions": list(expected.omissions),
            "targets": {name: _expectation(target, expected.lower_bound) for name, target in expected.targets.items()},
            "frame": expected.frame,
            "payload": payload_words(expected.payload),
        },
    )
    if expected.lower_bound:
        yield detail(f"  may be larger: {'; '.join(expected.omissions)}")


def expected_of(expected: ExpectedError) -> str:
    """Return what the error to expect is one of: targets, frame and payload."""
    names = [*expected.targets]
    targets = f"{'target' if len(names) == 1 else 'targets'} {listed(names)}"
    return f"{targets} in {expected.frame}, {payload_words(expected.payload)}"


def payload_words(payload: Payload) -> str:
    """Return what the robot carries."""
    return f"payload {payload.mass:g} kg" if payload.mass else "no payload"
