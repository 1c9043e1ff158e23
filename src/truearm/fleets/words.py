"""What a fleet says, in words and as JSON holds it: mm and deg."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from truearm.engine.base.errors import Notice, counted, listed
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.fleets.analysis import (
    LEAST_COMPARED,
    LEAST_SPREAD,
    Analysis,
    Difference,
    Errors,
    KindFound,
    Look,
    ParameterSpread,
    Reason,
)
from truearm.fleets.drift import Drift, Quantile

#: The nominal robot with the priors that follow from a fleet; written where some do.
PRIORS_FILE: Final = "priors.yaml"
#: What errors are of, by their names in rows.
ERRORS_OF: Final = {
    "nominal": "Nominal robots",
    "held_out": "Calibrated robots",
    "truth": "Calibrated robots, without the instrument's noise",
}
#: Robots, parameters and changes that are told line by line.
_TOLD: Final = 8
#: Robots to look at that JSON holds.
_MOST_LOOKS: Final = 1000

_VERDICTS: Final = {
    "wider": "Wider than the priors",
    "narrower": "Narrower than the priors",
    "agrees": "As the priors say",
    "too few": f"Not told of fewer than {LEAST_SPREAD} robots",
    "shared": "Told together with others only",
    "prior only": "Held by nothing but their priors, because base or target can move instead",
    "priors differ": "Not compared, because the robots' files have other nominal values or priors",
}


def in_unit(value: float, unit: str) -> tuple[float, str]:
    """Return a value [SI] in the unit that people read."""
    shown = SHOWN_AS[unit]
    return from_si(value, shown), shown


def sized(value: float, unit: str, *, sign: bool = False) -> str:
    """Return a value [SI] with three digits in the unit that people read."""
    number, shown = in_unit(value, unit)
    return f"{number:{'+' if sign else ''}.3g} {shown}"


def quantile_words(one: Quantile, robots: int) -> str:
    """Return an error below which a share of the robots is."""
    share = f"{one.share * 100:g} %"
    if one.value is None:
        return f"{share} below: not known from {counted(robots, 'robot')}"
    return f"{share} below {one.value * 1e3:.3f} mm ({interval_words(one)})"


def interval_words(one: Quantile) -> str:
    """Return the interval of such an error, as far as it is known."""
    low, high = (None if end is None else f"{end * 1e3:.3f}" for end in (one.low, one.high))
    if low is None and high is None:
        return f"its interval takes {one.needed} robots"
    if high is None:
        return f"95 %: above {low}"
    return f"95 %: below {high}" if low is None else f"95 %: {low} to {high}"


def accuracy_lines(found: Analysis) -> list[str]:
    """Return the errors over the series."""
    text = []
    for name, errors in found.errors.items():
        count = len(errors.mean)
        told = [quantile_words(one, count) for one in errors.of_means if one.value is not None]
        worst = f"the worst {errors.mean.max() * 1e3:.3f} mm"
        of = "" if count == found.machines else f" of {counted(count, 'robot')}"
        text.append(f"{ERRORS_OF[name]}, mean error{of}: {', '.join([*told, worst])}.")
    if found.left_out:
        out = f"{counted(len(found.left_out), 'robot')} ({listed(found.left_out)})"
        text.append(f"Left out of all figures, because their results end with an error: {out}.")
    if found.failed:
        low, high = (100.0 * end for end in found.failing)
        text.append(
            f"Not calibrated: {len(found.failed)} of {found.measurements}; of such a series {low:.3g} to {high:.3g} % "
            "(95 %)."
        )
    return text


def parameter_lines(found: KindFound, *, several: bool) -> list[str]:
    """Return what robots of one kind say of their parameters."""
    count = len(found.kind.latest)
    name = f"{found.kind.robot}: " if several else ""
    beside = (
        "with one another" if count >= LEAST_COMPARED else f"with their priors (fewer than {LEAST_COMPARED} robots)"
    )
    differing = list(dict.fromkeys(one.robot for one in found.differences))
    said = "none differs"
    if differing:
        said = f"{listed(differing)} {'differs' if len(differing) == 1 else 'differ'}"
    text = [f"{name}Parameters of {counted(count, 'robot')} compared {beside}: {said}."]
    for verdict, words in _VERDICTS.items():
        those = [one for one in found.spreads if one.verdict == verdict]
        if not those:
            continue
        if verdict in ("wider", "narrower"):
            told = listed([f"{one.parameter} {spread_words(one)}" for one in those])
        else:
            told = listed([one.parameter for one in those])
        text.append(f"  {words}: {told}.")
    shifted = [mean_words(one) for one in found.spreads if one.beside]
    return [*text, f"  The whole series lies beside nominal: {listed(shifted)}."] if shifted else text


def mean_words(one: ParameterSpread) -> str:
    """Return how far the mean of a series is from nominal."""
    if one.mean is None or one.mean_low is None or one.mean_high is None:
        return one.parameter
    low, high = (f"{in_unit(end, one.unit)[0]:.3g}" for end in (one.mean_low, one.mean_high))
    return f"{one.parameter} {sized(one.mean, one.unit, sign=True)} ({low} to {high})"


def spread_words(one: ParameterSpread) -> str:
    """Return how far a parameter scatters, beside its prior."""
    if one.spread is None or one.low is None or one.high is None:
        return ""
    low, high = (f"{in_unit(end, one.unit)[0]:.3g}" for end in (one.low, one.high))
    return f"{sized(one.spread, one.unit)} ({low} to {high}; prior {sized(one.prior, one.unit)})"


def together_words(one: Difference | Drift) -> str:
    """Return the name of a parameter, with those it is told together with."""
    if one.alone:
        return one.parameter
    return f"{one.parameter} (with {listed(one.together)})" if one.together else f"{one.parameter} (not alone)"


def difference_words(one: Difference) -> str:
    """Return how a parameter of a robot differs."""
    of = "the median" if one.beside == "series" else "nominal"
    return f"{together_words(one)} {sized(one.off, one.unit, sign=True)} off {of} ({abs(one.times):.1f} deviations)"


def drift_words(one: Drift) -> str:
    """Return how fast a parameter of a machine changes."""
    low, high = (f"{in_unit(end, one.unit)[0]:.3g}" for end in (one.low, one.high))
    bent = ", not steadily" if one.steady is False else ""
    return (
        f"{together_words(one)} {sized(one.slope, one.unit, sign=True)} a month (95 %: {low} to {high}{bent}) over "
        f"{one.months:.1f} months"
    )


def drift_lines(found: Analysis) -> list[str]:
    """Return what has changed of machines that were measured again."""
    machines = list(dict.fromkeys(one.machine for one in found.drifts))
    text = []
    if machines:
        changed = [one for one in found.drifts if one.significant]
        those = list(dict.fromkeys(one.machine for one in changed))
        words = f"{counted(len(those), 'machine')} changed" if those else "none has changed by more than chance"
        text.append(f"Measured again: {counted(len(machines), 'machine')}; {words}.")
        text += [f"  {one.machine}: {drift_words(one)}" for one in changed[:_TOLD]]
        text += [f"  and {len(changed) - _TOLD} more changes"] if len(changed) > _TOLD else []
    for kind in found.kinds:
        text += [
            f"  all machines alike: {one.parameter} {sized(one.slope, one.unit, sign=True)} a month"
            for one in kind.drifts.alike
        ]
    return text


def reason_words(reason: Reason) -> str:
    """Return why to look at a robot."""
    if reason.why == "failed":
        return f"not calibrated: {reason.message}"
    if reason.why == "error":
        return f"its result should not be used as it is ({listed(reason.codes)})"
    if reason.why == "unsound":
        return f"the fit ended with {listed(reason.codes)}"
    if reason.why == "differs":
        first, *more = reason.differences
        return f"differs: {difference_words(first)}{f' and {len(more)} more' if more else ''}"
    if reason.why == "drifts":
        surest, *others = reason.drifts
        return f"changes: {drift_words(surest)}{f' and {len(others)} more' if others else ''}"
    held_out, beside = (f"{value * 1e3:.3f} mm" for value in (reason.error, reason.beside))
    if reason.why == "not better":
        return f"its held-out error of {held_out} is more than before ({beside})"
    if reason.why == "inaccurate":
        return f"its held-out error of {held_out} is more than those of the others allow (median {beside})"
    return f"the largest held-out error of all, {held_out} (median {beside})"


def look_lines(looks: Sequence[Look]) -> list[str]:
    """Return the robots to look at first."""
    if not looks:
        return []
    text = ["Look first at:"]
    text += [f"  {look.robot}: {'; '.join(reason_words(reason) for reason in look.reasons)}" for look in looks[:_TOLD]]
    return [*text, f"  and {len(looks) - _TOLD} more"] if len(looks) > _TOLD else text


def outcome_words(found: Analysis) -> str:
    """Return of how many the result can be used, of how many not, and how many have none."""
    wrong = len(found.left_out)
    return f"{found.usable} usable, {wrong} whose result ends with an error, {len(found.failed)} not calibrated"


def analysis_lines(found: Analysis, draw: str | None = None) -> list[str]:
    """Return all that a fleet says, line by line; `draw` is what its figures hold for."""
    several = len(found.kinds) > 1
    text = accuracy_lines(found)
    if draw is not None and found.errors:
        text.append(draw)
    for kind in found.kinds:
        text += parameter_lines(kind, several=several)
    return text + drift_lines(found) + look_lines(found.looks)


def analysis_notices(found: Analysis) -> list[Notice]:
    """Return what to know about the figures of a fleet."""
    notices = []
    differing = {one.robot for kind in found.kinds for one in kind.differences}
    if differing:
        notices.append(
            Notice(
                "robots-differ",
                f"{counted(len(differing), 'robot')} {'differs' if len(differing) == 1 else 'differ'} from the others "
                f"({listed(sorted(differing))}). Look for a collision, a wrong mastering or wrong data before "
                "these results are used. Priors that this fleet proposes do not count them.",
            )
        )
    changed = list(dict.fromkeys(one.machine for one in found.drifts if one.significant))
    if changed:
        notices.append(
            Notice(
                "robots-drift",
                f"{counted(len(changed), 'machine')} changed between campaigns by more than chance "
                f"({listed(changed)}). An instrument, a tool or a temperature that differed between the campaigns "
                "looks the same.",
            )
        )
    alike = [one.parameter for kind in found.kinds for one in kind.drifts.alike]
    if alike:
        notices.append(
            Notice(
                "drift-alike",
                f"The same parameters changed alike in all machines ({listed(alike)}): what measured them has more "
                "likely changed than all of them.",
            )
        )
    others = [name for kind in found.kinds for name in kind.drifts.others]
    if others:
        notices.append(
            Notice(
                "another-machine",
                f"Most parameters of {listed(others)} changed from one campaign to the next by as much as robots "
                "differ from one another. Check whether the entry 'of' names the same machine.",
            )
        )
    undated = [name for kind in found.kinds for name in kind.drifts.undated]
    if undated:
        notices.append(
            Notice(
                "drift-undated",
                f"{listed(undated)} {'was' if len(undated) == 1 else 'were'} measured several times, but not at two "
                "different known dates, so no change is told. Correct the dates beside them.",
                "note",
            )
        )
    return notices


def analysis_summary(found: Analysis) -> dict[str, Any]:
    """Return all that a fleet says as JSON holds it: mm and deg."""
    return {
        "measurements": found.measurements,
        "machines": found.machines,
        "left_out": [*found.left_out],
        "failing_95": [*found.failing] if found.measurements else None,
        "errors_mm": {name: _errors_summary(errors) for name, errors in found.errors.items()},
        "kinds": [_kind_summary(kind) for kind in found.kinds],
        "look_first": [
            {
                "robot": look.robot,
                "why": [reason.why for reason in look.reasons],
                "words": [reason_words(reason) for reason in look.reasons],
            }
            for look in found.looks[:_MOST_LOOKS]
        ],
    }


def _errors_summary(errors: Errors) -> dict[str, Any]:
    return {
        "robots": len(errors.mean),
        "of_means": [_quantile_summary(one) for one in errors.of_means],
        "of_largest": [_quantile_summary(one) for one in errors.of_largest],
        "worst_mean": float(errors.mean.max()) * 1e3,
        "worst_largest": float(errors.largest.max()) * 1e3,
    }


def _quantile_summary(one: Quantile) -> dict[str, Any]:
    value, low, high = (None if end is None else end * 1e3 for end in (one.value, one.low, one.high))
    return {"share": one.share, "value": value, "low_95": low, "high_95": high, "robots_needed": one.needed}


def _kind_summary(found: KindFound) -> dict[str, Any]:
    return {
        "robot": found.kind.robot,
        "robots": len(found.kind.latest),
        "differing": [
            {
                "robot": one.robot,
                "parameter": one.parameter,
                "together_with": [*one.together],
                "unit": (shown := in_unit(one.off, one.unit))[1],
                "off": shown[0],
                "deviations": one.times,
                "chance": one.chance,
                "beside": one.beside,
            }
            for one in found.differences[:_MOST_LOOKS]
        ],
        "parameters": [_spread_summary(one) for one in found.spreads],
        "drift": [
            {
                "machine": one.machine,
                "parameter": one.parameter,
                "together_with": [*one.together],
                "campaigns": one.campaigns,
                "months": one.months,
                "unit": (slope := in_unit(one.slope, one.unit))[1],
                "a_month": slope[0],
                "low_95": in_unit(one.low, one.unit)[0],
                "high_95": in_unit(one.high, one.unit)[0],
                "chance": one.chance,
                "significant": one.significant,
                "steady": one.steady,
            }
            for one in found.drifts.found[:_MOST_LOOKS]
        ],
        "drift_not_seen": [*found.drifts.unknown],
    }


def _spread_summary(one: ParameterSpread) -> dict[str, Any]:
    def shown(value: float | None) -> float | None:
        return None if value is None or value != value else in_unit(value, one.unit)[0]

    return {
        "name": one.parameter,
        "unit": SHOWN_AS[one.unit],
        "informed": None if one.share != one.share else one.share,
        "robots": one.robots,
        "prior": shown(one.prior),
        "verdict": one.verdict,
        "mean_off_nominal": shown(one.mean),
        "mean_95": None if one.mean is None else [shown(one.mean_low), shown(one.mean_high)],
        "series_beside_nominal": one.beside,
        "spread": shown(one.spread),
        "spread_95": None if one.spread is None else [shown(one.low), shown(one.high)],
        "proposed_prior": shown(one.proposed),
    }
