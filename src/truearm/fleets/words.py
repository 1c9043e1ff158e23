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
    KindAnalysis,
    Look,
    ParameterSpread,
    Reason,
)
from truearm.fleets.drift import Drift, Growth, Quantile

#: The nominal robot with the priors that follow from a fleet; written where some do.
PRIORS_FILE: Final = "priors.yaml"
#: What errors are of, by their names in rows.
ERRORS_OF: Final = {
    "nominal": "Nominal robots",
    "held_out": "Calibrated robots",
    "truth": "Calibrated robots, without the instrument's noise",
}
#: Robots, parameters and changes that are told line by line.
_MOST_LINES: Final = 8
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


def quantile_words(quantile: Quantile, robots: int) -> str:
    """Return an error below which a share of the robots is."""
    share = f"{quantile.share * 100:g} %"
    if quantile.value is None:
        return f"{share} below: not known from {counted(robots, 'robot')}"
    return f"{share} below {quantile.value * 1e3:.3f} mm ({interval_words(quantile)})"


def interval_words(quantile: Quantile) -> str:
    """Return the interval of such an error, as far as it is known."""
    low, high = (None if end is None else f"{end * 1e3:.3f}" for end in (quantile.low, quantile.high))
    if low is None and high is None:
        return f"its interval takes {quantile.needed} robots"
    if high is None:
        return f"95 %: above {low}"
    return f"95 %: below {high}" if low is None else f"95 %: {low} to {high}"


def _accuracy(analysis: Analysis) -> Iterator[Block]:
    """Give the errors over the series [mm], and how many have none."""
    yield under("errors_mm", (under(name, [_errors(analysis, name)]) for name in analysis.errors))
    if analysis.left_out:
        out = f"{counted(len(analysis.left_out), 'robot')} ({listed(analysis.left_out)})"
        yield detail(f"Left out of all figures, because their results end with an error: {out}.")
    if analysis.failed:
        low, high = (100.0 * end for end in analysis.failing)
        yield detail(
            f"Not calibrated: {len(analysis.failed)} of {analysis.measurements}; of such a series {low:.3g} to "
            f"{high:.3g} % (95 %)."
        )


def _errors(analysis: Analysis, name: str) -> Words:
    errors = analysis.errors[name]
    count = len(errors.mean)
    shares = [quantile_words(quantile, count) for quantile in errors.of_means if quantile.value is not None]
    worst = f"the worst {errors.mean.max() * 1e3:.3f} mm"
    of = "" if count == analysis.machines else f" of {counted(count, 'robot')}"
    return say(
        f"{ERRORS_OF[name]}, mean error{of}: {', '.join([*shares, worst])}.",
        robots=count,
        of_means=[_quantile(quantile) for quantile in errors.of_means],
        of_largest=[_quantile(quantile) for quantile in errors.of_largest],
        worst_mean=float(errors.mean.max()) * 1e3,
        worst_largest=float(errors.largest.max()) * 1e3,
    )


def _quantile(quantile: Quantile) -> dict[str, Any]:
    value, low, high = (None if end is None else end * 1e3 for end in (quantile.value, quantile.low, quantile.high))
    return {"share": quantile.share, "value": value, "low_95": low, "high_95": high, "robots_needed": quantile.needed}


def _kind(analysis: KindAnalysis, *, several: bool) -> Iterator[Block]:
    """Give what robots of one kind say of their parameters; in text their drift stands with that of the others."""
    count = len(analysis.kind.latest)
    name = f"{analysis.kind.robot}: " if several else ""
    beside = (
        "with one another" if count >= LEAST_COMPARED else f"with their priors (fewer than {LEAST_COMPARED} robots)"
    )
    differing = list(dict.fromkeys(difference.robot for difference in analysis.differences))
    outcome = "none differs"
    if differing:
        outcome = f"{listed(differing)} {'differs' if len(differing) == 1 else 'differ'}"
    yield say(
        f"{name}Parameters of {counted(count, 'robot')} compared {beside}: {outcome}.",
        robot=analysis.kind.robot,
        robots=count,
        differing=[_difference(difference) for difference in analysis.differences[:_MOST_LOOKS]],
        drift=[_drift(drift) for drift in analysis.drifts.changes[:_MOST_LOOKS]],
        drift_not_seen=[*analysis.drifts.unknown],
        grown=[
            {"machine": growth.machine, "ppm": growth.share * 1e6, "warmer_k": growth.warmer}
            for growth in analysis.drifts.grown[:_MOST_LOOKS]
        ],
    )
    text = []
    for verdict, words in _VERDICTS.items():
        those = [spread for spread in analysis.spreads if spread.verdict == verdict]
        known = verdict in ("wider", "narrower")
        if those:
            names = listed(
                [f"{spread.parameter} {spread_words(spread)}" if known else spread.parameter for spread in those]
            )
            text.append(f"  {words}: {names}.")
    shifted = [mean_words(spread) for spread in analysis.spreads if spread.beside]
    if shifted:
        text.append(f"  The whole series lies beside nominal: {listed(shifted)}.")
    yield detail(*text, parameters=[_spread(spread) for spread in analysis.spreads])


def _difference(difference: Difference) -> dict[str, Any]:
    off, unit = in_unit(difference.off, difference.unit)
    return {
        "robot": difference.robot,
        "parameter": difference.parameter,
        "together_with": [*difference.together],
        "unit": unit,
        "off": off,
        "deviations": difference.times,
        "chance": difference.chance,
        "beside": difference.beside,
    }


def _drift(drift: Drift) -> dict[str, Any]:
    slope, unit = in_unit(drift.slope, drift.unit)
    return {
        "machine": drift.machine,
        "parameter": drift.parameter,
        "together_with": [*drift.together],
        "campaigns": drift.campaigns,
        "months": drift.months,
        "unit": unit,
        "a_month": slope,
        "low_95": in_unit(drift.low, drift.unit)[0],
        "high_95": in_unit(drift.high, drift.unit)[0],
        "chance": drift.chance,
        "significant": drift.significant,
        "steady": drift.steady,
    }


def _spread(spread: ParameterSpread) -> dict[str, Any]:
    def shown(value: float | None) -> float | None:
        return None if value is None or value != value else in_unit(value, spread.unit)[0]

    return {
        "name": spread.parameter,
        "unit": SHOWN_AS[spread.unit],
        "informed": None if spread.share != spread.share else spread.share,
        "robots": spread.robots,
        "prior": shown(spread.prior),
        "verdict": spread.verdict,
        "mean_off_nominal": shown(spread.mean),
        "mean_95": None if spread.mean is None else [shown(spread.mean_low), shown(spread.mean_high)],
        "series_beside_nominal": spread.beside,
        "spread": shown(spread.spread),
        "spread_95": None if spread.spread is None else [shown(spread.low), shown(spread.high)],
        "proposed_prior": shown(spread.proposed),
    }


def mean_words(spread: ParameterSpread) -> str:
    """Return how far the mean of a series is from nominal."""
    if spread.mean is None or spread.mean_low is None or spread.mean_high is None:
        return spread.parameter
    low, high = (f"{in_unit(end, spread.unit)[0]:.3g}" for end in (spread.mean_low, spread.mean_high))
    return f"{spread.parameter} {sized(spread.mean, spread.unit, sign=True)} ({low} to {high})"


def spread_words(spread: ParameterSpread) -> str:
    """Return how far a parameter scatters, beside its prior."""
    if spread.spread is None or spread.low is None or spread.high is None:
        return ""
    low, high = (f"{in_unit(end, spread.unit)[0]:.3g}" for end in (spread.low, spread.high))
    return f"{sized(spread.spread, spread.unit)} ({low} to {high}; prior {sized(spread.prior, spread.unit)})"


def together_words(change: Difference | Drift) -> str:
    """Return the name of a parameter, with those it is told together with."""
    if change.alone:
        return change.parameter
    return (
        f"{change.parameter} (with {listed(change.together)})" if change.together else f"{change.parameter} (not alone)"
    )


def difference_words(difference: Difference) -> str:
    """Return how a parameter of a robot differs."""
    of = "the median" if difference.beside == "series" else "nominal"
    return (
        f"{together_words(difference)} {sized(difference.off, difference.unit, sign=True)} off {of} "
        f"({abs(difference.times):.1f} deviations)"
    )


def drift_words(drift: Drift) -> str:
    """Return how fast a parameter of a machine changes."""
    low, high = (f"{in_unit(end, drift.unit)[0]:.3g}" for end in (drift.low, drift.high))
    unsteady = ", not steadily" if drift.steady is False else ""
    return (
        f"{together_words(drift)} {sized(drift.slope, drift.unit, sign=True)} a month (95 %: {low} to {high}{unsteady})"
        f" over {drift.months:.1f} months"
    )


def growth_words(growth: Growth) -> str:
    """Return by how much the lengths of a machine grew alike, and which temperature explains that."""
    did, how = ("grew", "warmer") if growth.share > 0.0 else ("shrank", "colder")
    size = f"{growth.machine}: all lengths {did} by {abs(growth.share) * 1e6:.0f} ppm"
    if growth.warmer is not None:
        return f"{size}, as its temperature explains: it was {abs(growth.warmer):.1f} K {how}"
    aluminium, steel = (abs(difference) for difference in growth.explaining)
    return (
        f"{size}. An arm that is {aluminium:.2g} K (aluminium) to {steel:.2g} K (steel) {how} does so, and the data do "
        "not say how warm it was: record it in the column temperature [degC]"
    )


def _changes(analysis: Analysis) -> Iterator[Words]:
    """Give what has changed of machines that were measured again; JSON holds it with their kind."""
    machines = {drift.machine for drift in analysis.drifts}
    grown = [growth for kind in analysis.kinds for growth in kind.drifts.grown]
    if machines:
        changed = [drift for drift in analysis.drifts if drift.significant]
        those = {drift.machine for drift in changed}
        beyond = "chance and temperature explain" if grown else "chance"
        words = f"{counted(len(those), 'machine')} changed" if those else f"none has changed by more than {beyond}"
        yield say(f"Measured again: {counted(len(machines), 'machine')}; {words}.")
        yield say(*(f"  {growth_words(growth)}" for growth in grown[:_MOST_LINES]))
        yield detail(*(f"  {drift.machine}: {drift_words(drift)}" for drift in changed))
    for alike in (change for kind in analysis.kinds for change in kind.drifts.alike):
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
    entries, text = list[dict[str, Any]](), ["Look first at:"]
    for look in looks[:_MOST_LOOKS]:
        words = [reason_words(reason) for reason in look.reasons]
        entries.append({"robot": look.robot, "why": [reason.why for reason in look.reasons], "words": words})
        text.append(f"  {look.robot}: {'; '.join(words)}")
    return say(*(text if looks else []), look_first=entries)


def outcome_words(analysis: Analysis) -> str:
    """Return of how many the result can be used, of how many not, and how many have none."""
    wrong = len(analysis.left_out)
    return f"{analysis.usable} usable, {wrong} whose result ends with an error, {len(analysis.failed)} not calibrated"


def analysis_blocks(analysis: Analysis, draw: str | None = None) -> Iterator[Block]:
    """Give all that a fleet says, in mm and deg; `draw` is what its figures hold for."""
    yield say(
        measurements=analysis.measurements,
        machines=analysis.machines,
        left_out=[*analysis.left_out],
        failing_95=[*analysis.failing] if analysis.measurements else None,
    )
    yield from _accuracy(analysis)
    if draw is not None and analysis.errors:
        yield say(draw)
    yield _looks(analysis.looks)
    yield from _changes(analysis)
    yield each("kinds", (_kind(kind, several=len(analysis.kinds) > 1) for kind in analysis.kinds))


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
    "the same parameters changed alike in all of five or more machines: look at what measured them and at temperatures",
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


def analysis_notices(analysis: Analysis) -> list[Notice]:
    """Return what to know about the figures of a fleet."""
    notices = []
    differing = {difference.robot for kind in analysis.kinds for difference in kind.differences}
    if differing:
        notices.append(
            ROBOTS_DIFFER(
                f"{counted(len(differing), 'robot')} {'differs' if len(differing) == 1 else 'differ'} from the others "
                f"({listed(sorted(differing))})."
            )
        )
    changed = list(dict.fromkeys(drift.machine for drift in analysis.drifts if drift.significant))
    if changed:
        notices.append(
            ROBOTS_DRIFT(
                f"{counted(len(changed), 'machine')} changed between campaigns by more than chance "
                f"({listed(changed)}). An instrument, a tool or a temperature that differed between the campaigns "
                "looks the same."
            )
        )
    alike = [change.parameter for kind in analysis.kinds for change in kind.drifts.alike]
    if alike:
        notices.append(
            DRIFT_ALIKE(
                f"The same parameters changed alike in all machines ({listed(alike)}): what measured them, or the "
                "temperature, has more likely changed than all of them."
            )
        )
    others = [name for kind in analysis.kinds for name in kind.drifts.others]
    if others:
        notices.append(
            ANOTHER_MACHINE(
                f"Most parameters of {listed(others)} changed from one campaign to the next by as much as robots "
                "differ from one another."
            )
        )
    undated = [name for kind in analysis.kinds for name in kind.drifts.undated]
    if undated:
        notices.append(
            DRIFT_UNDATED(
                f"{listed(undated)} {'was' if len(undated) == 1 else 'were'} measured several times, but not at two "
                "different known dates, so no change is told."
            )
        )
    return notices
