"""What a fleet says: accuracy over the series, which robots to look at, parameters beside their priors, drift."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from truearm.engine.base.errors import worst_first
from truearm.engine.base.units import SHOWN_AS
from truearm.engine.document.drawing import significant
from truearm.engine.document.page import page
from truearm.fleets.analysis import LEAST_COMPARED, LEAST_SPREAD, ParameterSpread
from truearm.fleets.figures import figures_text, fleet_figures
from truearm.fleets.words import PRIORS_FILE, difference_words, outcome_words, reason_words, together_words

if TYPE_CHECKING:
    from truearm.fleets.analysis import Analysis, KindFound
    from truearm.fleets.drift import Drift, Quantile
    from truearm.fleets.result import Fleet

#: Rows of tables of robots: who wants more reads robots.csv and fleet.json.
_ROWS: Final = 30

_COLUMNS: Final = {"nominal": "nominal", "held_out": "calibrated", "truth": "calibrated, without noise"}
_VERDICTS: Final = {
    "agrees": "as its prior says",
    "wider": "wider than its prior",
    "narrower": "narrower than its prior",
    "too few": f"not told of fewer than {LEAST_SPREAD} robots",
    "shared": "told together with others only",
    "prior only": "held by nothing but its prior",
    "priors differ": "the robots' files have other priors",
}


@dataclass(frozen=True)
class Share:
    """Cells of the table of accuracy, as printed: an error below which a share of the robots is, and its interval."""

    value: str
    interval: str


def fleet_html(found: Fleet) -> str:
    """Return the page of a fleet."""
    said = found.analysis
    kind = said.kinds[0] if said.kinds else None
    simulated = found.recorded.manifest.experiment is not None
    return page(
        Path(__file__).with_name("fleet.html.jinja"),
        fleet_figures(said),
        found,
        title=found.recorded.manifest.file.stem,
        simulated=simulated,
        said=said,
        lead=_lead(said),
        outcome=outcome_words(said),
        draw=found.draw,
        columns=[(_COLUMNS[name], len(errors.mean)) for name, errors in said.errors.items()],
        shares=_shares(said),
        looks=[
            (
                look.robot,
                [reason_words(reason) for reason in look.reasons],
                None if simulated or look.reasons[0].why == "failed" else f"robots/{look.robot}/report.html",
            )
            for look in said.looks[:_ROWS]
        ],
        more_looks=max(len(said.looks) - _ROWS, 0),
        kind=kind,
        other_kinds=[each.kind.robot for each in said.kinds[1:]],
        beside="one another" if kind is not None and len(kind.kind.latest) >= LEAST_COMPARED else "priors",
        least=LEAST_COMPARED,
        differing=[] if kind is None else [(one.robot, difference_words(one)) for one in kind.differences[:_ROWS]],
        spreads=[] if kind is None else [_spread(one, kind) for one in kind.spreads],
        proposed=None if found.proposed is None else PRIORS_FILE,
        changes=[_change(one) for one in said.drifts[:_ROWS]],
        more_changes=max(len(said.drifts) - _ROWS, 0),
        unseen=[] if kind is None else kind.drifts.unknown,
        alike=[one.parameter for each in said.kinds for one in each.drifts.alike],
        notices=worst_first(found.warnings),
        command=found.command,
    )


def _lead(said: Analysis) -> dict[str, str | int] | None:
    """Return the figure that people look for: the error of the middle of the series, before and after."""
    after = said.errors.get("held_out")
    if after is None:
        return None
    before = said.errors.get("nominal")
    middle = after.of_means[0]
    return {
        "was": "" if before is None or before.of_means[0].value is None else _mm(before.of_means[0].value),
        "is": _mm(middle.value if middle.value is not None else float(after.mean.mean())),
        "count": len(after.mean),
        "worst": _mm(float(after.mean.max())),
    }


def _mm(length: float) -> str:
    return significant(length * 1e3)


def _shares(said: Analysis) -> list[tuple[str, list[Share]]]:
    """Return the rows of the table of accuracy."""
    columns = [errors.of_means for errors in said.errors.values()]
    rows = [(f"{ones[0].share * 100:g} % below", [_share(one) for one in ones]) for ones in zip(*columns, strict=True)]
    return [*rows, ("the worst", [Share(_mm(float(errors.mean.max())), "") for errors in said.errors.values()])]


def _share(one: Quantile) -> Share:
    if one.value is None:
        return Share("not known", f"takes {one.needed} robots")
    if one.low is None and one.high is None:
        return Share(_mm(one.value), f"takes {one.needed} robots")
    if one.high is None or one.low is None:
        return Share(
            _mm(one.value), f"above {_mm(one.low)}" if one.low is not None else f"below {_mm(one.high or 0.0)}"
        )
    return Share(_mm(one.value), f"{_mm(one.low)} to {_mm(one.high)}")


def _spread(one: ParameterSpread, found: KindFound) -> dict[str, Any]:
    number = found.kind.parameters.index(one.parameter)
    together = found.kind.together(number)
    words = f"told with {', '.join(together)} only" if together else _VERDICTS[one.verdict]
    return {
        "name": one.parameter,
        "unit": SHOWN_AS[one.unit],
        "prior": figures_text(one.prior, one.unit),
        "mean": figures_text(one.mean, one.unit),
        "beside": one.beside,
        "spread": figures_text(one.spread, one.unit),
        "interval": ""
        if one.spread is None
        else f"{figures_text(one.low, one.unit)} to {figures_text(one.high, one.unit)}",
        "verdict": one.verdict.replace(" ", "-"),
        "words": words,
        "proposed": figures_text(one.proposed, one.unit),
    }


def _change(one: Drift) -> dict[str, Any]:
    return {
        "machine": one.machine,
        "parameter": together_words(one),
        "campaigns": one.campaigns,
        "months": f"{one.months:.1f}",
        "change": f"{figures_text(one.change, one.unit)} {SHOWN_AS[one.unit]}",
        "slope": figures_text(one.slope, one.unit),
        "interval": f"{figures_text(one.low, one.unit)} to {figures_text(one.high, one.unit)}",
        "significant": one.significant,
        "words": "changed" if one.significant else "no more than chance",
        "steady": "" if one.steady is not False else ", not steadily",
    }
