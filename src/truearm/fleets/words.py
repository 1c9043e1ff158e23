"""What a fleet says, in words and as JSON holds it: mm and deg."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Final

from truearm.engine.base.errors import Notice, Rule, counted, listed
from truearm.engine.base.units import SHOWN_AS, from_si
from truearm.engine.document.document import Block, Words, detail, each, say, under
from truearm.fleets.analysis import (
    LEAST_COMPARED,
    LEAST_SPREAD,
    Analysis,
    Difference,
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


def _accuracy(found: Analysis) -> Iterator[Block]:
    """Give the errors over the series [mm], and how many have none."""
    yield under("errors_mm", (under(name, [_errors(found, name)]) for name in found.errors))
    if found.left_out:
        out = f"{counted(len(found.left_out), 'robot')} ({listed(found.left_out)})"
        yield detail(f"Left out of all figures, because their results end with an error: {out}.")
    if found.failed:
        low, high = (100.0 * end for end in found.failing)
        yield detail(
            f"Not calibrated: {len(found.failed)} of {found.measurements}; of such a series {low:.3g} to {high:.3g} % "
            "(95 %)."
        )


def _errors(found: Analysis, name: str) -> Words:
    errors = found.errors[name]
    count = len(errors.mean)
    told = [quantile_words(one, count) for one in errors.of_means if one.value is not None]
    worst = f"the worst {errors.mean.max() * 1e3:.3f} mm"
    of = "" if count == found.machines else f" of {counted(count, 'robot')}"
    return say(
        f"{ERRORS_OF[name]}, mean error{of}: {', '.join([*told, worst])}.",
        robots=count,
        of_means=[_quantile(one) for one in errors.of_means],
        of_largest=[_quantile(one) for one in errors.of_largest],
        worst_mean=float(errors.mean.max()) * 1e3,
        worst_largest=float(errors.largest.max()) * 1e3,
    )


def _quantile(one: Quantile) -> dict[str, Any]:
    value, low, high = (None if end is None else end * 1e3 for end in (one.value, one.low, one.high))
    return {"share": one.share, "value": value, "low_95": low, "high_95": high, "robots_needed": one.needed}


def _kind(found: KindFound, *, several: bool) -> Iterator[Block]:
    """Give what robots of one kind say of their parameters; in text their drift stands with that of the others."""
    count = len(found.kind.latest)
    name = f"{found.kind.robot}: " if several else ""
    beside = (
        "with one another" if count >= LEAST_COMPARED else f"with their priors (fewer than {LEAST_COMPARED} robots)"
    )
    differing = list(dict.fromkeys(difference.robot for difference in found.differences))
    said = "none differs"
    if differing:
        said = f"{listed(differing)} {'differs' if len(differing) == 1 else 'differ'}"
    yield say(
        f"{name}Parameters of {counted(count, 'robot')} compared {beside}: {said}.",
        robot=found.kind.robot,
        robots=count,
        differing=[_difference(difference) for difference in found.differences[:_MOST_LOOKS]],
        drift=[_drift(one) for one in found.drifts.found[:_MOST_LOOKS]],
        drift_not_seen=[*found.drifts.unknown],
    )
    text = []
    for verdict, words in _VERDICTS.items():
        those = [spread for spread in found.spreads if spread.verdict == verdict]
        known = verdict in ("wider", "narrower")
        if those:
            told = listed([f"{one.parameter} {spread_words(one)}" if known else one.parameter for one in those])
            text.append(f"  {words}: {told}.")
    shifted = [mean_words(spread) for spread in found.spreads if spread.beside]
    if shifted:
        text.append(f"  The whole series lies beside nominal: {listed(shifted)}.")
    yield detail(*text, parameters=[_spread(spread) for spread in found.spreads])


def _difference(one: Difference) -> dict[str, Any]:
    off, unit = in_unit(one.off, one.unit)
    return {
        "robot": one.robot,
        "parameter": one.parameter,
        "together_with": [*one.together],
        "unit": unit,
        "off": off,
        "deviations": one.times,
        "chance": one.chance,
        "beside": one.beside,
    }


def _drift(one: Drift) -> dict[str, Any]:
    slope, unit = in_unit(one.slope, one.unit)
    return {
        "machine": one.machine,
        "parameter": one.parameter,
        "together_with": [*one.together],
        "campaigns": one.campaigns,
        "months": one.months,
        "unit": unit,
        "a_month": slope,
        "low_95": in_unit(one.low, one.unit)[0],
        "high_95": in_unit(one.high, one.unit)[0],
        "chance": one.chance,
        "significant": one.significant,
        "steady": one.steady,
    }


def _spread(one: ParameterSpread) -> dict[str, Any]:
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


def _changes(found: Analysis) -> Iterator[Words]:
    """Give what has changed of machines that were measured again; JSON holds it with their kind."""
    machines = {drift.machine for drift in found.drifts}
    if machines:
        changed = [drift for drift in found.drifts if drift.significant]
        those = {one.machine for one in changed}
        words = f"{counted(len(those), 'machine')} changed" if those else "none has changed by more than chance"
        yield say(f"Measured again: {counted(len(machines), 'machine')}; {words}.")
        yield detail(*(f"  {one.machine}: {drift_words(one)}" for one in changed))
    for alike in (one for kind in found.kinds for one in kind.drifts.alike):
        yield detail(f"  all machines alike: {alike.parameter} {sized(alike.slope, alike.unit, sign=True)} a month")


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


def _looks(looks: Sequence[Look]) -> Words:
    """Return the robots to look at first; text tells fewer of them."""
    held, text = list[dict[str, Any]](), ["Look first at:"]
    for look in looks[:_MOST_LOOKS]:
        words = [reason_words(reason) for reason in look.reasons]
        held.append({"robot": look.robot, "why": [reason.why for reason in look.reasons], "words": words})
        text.append(f"  {look.robot}: {'; '.join(words)}")
    return say(*(text if looks else []), look_first=held)


def outcome_words(found: Analysis) -> str:
    """Return of how many the result can be used, of how many not, and how many have none."""
    wrong = len(found.left_out)
    return f"{found.usable} usable, {wrong} whose result ends with an error, {len(found.failed)} not calibrated"


def analysis_blocks(found: Analysis, draw: str | None = None) -> Iterator[Block]:
    """Give all that a fleet says, in mm and deg; `draw` is what its figures hold for."""
    yield say(
        measurements=found.measurements,
        machines=found.machines,
        left_out=[*found.left_out],
        failing_95=[*found.failing] if found.measurements else None,
    )
    yield from _accuracy(found)
    if draw is not None and found.errors:
        yield say(draw)
    yield _looks(found.looks)
    yield from _changes(found)
    yield each("kinds", (_kind(kind, several=len(found.kinds) > 1) for kind in found.kinds))


ROBOTS_DIFFER: Final = Rule(
    "robots-differ",
    "warning",
    "parameters of some robots are not like those of the others",
    cure="Look for a collision, a wrong mastering or wrong data before these results are used. Priors that this "
    "fleet proposes do not count them.",
)
ROBOTS_DRIFT: Final = Rule(
    "robots-drift", "warning", "parameters of some machines changed from campaign to campaign by more than chance"
)
DRIFT_ALIKE: Final = Rule(
    "drift-alike",
    "warning",
    "the same parameters changed alike in all of five or more machines: look at what measured them",
)
ANOTHER_MACHINE: Final = Rule(
    "another-machine",
    "warning",
    "most parameters of a machine changed as much as robots differ",
    cure="Check whether the entry 'of' names the same machine.",
)
DRIFT_UNDATED: Final = Rule(
    "drift-undated",
    "note",
    "a machine was measured several times, but not at two known dates",
    cure="Correct the dates beside them.",
)


def analysis_notices(found: Analysis) -> list[Notice]:
    """Return what to know about the figures of a fleet."""
    notices = []
    differing = {difference.robot for kind in found.kinds for difference in kind.differences}
    if differing:
        notices.append(
            ROBOTS_DIFFER(
                f"{counted(len(differing), 'robot')} {'differs' if len(differing) == 1 else 'differ'} from the others "
                f"({listed(sorted(differing))})."
            )
        )
    changed = list(dict.fromkeys(drift.machine for drift in found.drifts if drift.significant))
    if changed:
        notices.append(
            ROBOTS_DRIFT(
                f"{counted(len(changed), 'machine')} changed between campaigns by more than chance "
                f"({listed(changed)}). An instrument, a tool or a temperature that differed between the campaigns "
                "looks the same."
            )
        )
    alike = [one.parameter for kind in found.kinds for one in kind.drifts.alike]
    if alike:
        notices.append(
            DRIFT_ALIKE(
                f"The same parameters changed alike in all machines ({listed(alike)}): what measured them has more "
                "likely changed than all of them."
            )
        )
    others = [name for kind in found.kinds for name in kind.drifts.others]
    if others:
        notices.append(
            ANOTHER_MACHINE(
                f"Most parameters of {listed(others)} changed from one campaign to the next by as much as robots "
                "differ from one another."
            )
        )
    undated = [name for kind in found.kinds for name in kind.drifts.undated]
    if undated:
        notices.append(
            DRIFT_UNDATED(
                f"{listed(undated)} {'was' if len(undated) == 1 else 'were'} measured several times, but not at two "
                "different known dates, so no change is told."
            )
        )
    return notices
