"""What a fleet says: accuracy over the series, which robots to look at, parameters beside their priors, drift."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final

from truearm.engine.base.units import SHOWN_AS
from truearm.engine.document.document import (
    Block,
    Cell,
    Document,
    Folded,
    Lead,
    Picture,
    Section,
    Table,
    Words,
    warned,
)
from truearm.engine.document.drawing import Figure, significant
from truearm.fleets.analysis import LEAST_COMPARED, LEAST_SPREAD, ParameterSpread
from truearm.fleets.figures import figures_text, fleet_figures
from truearm.fleets.words import (
    PRIORS_FILE,
    difference_words,
    growth_words,
    outcome_words,
    reason_words,
    together_words,
)

if TYPE_CHECKING:
    from truearm.fleets.analysis import Analysis, KindAnalysis
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


def fleet_html(fleet: Fleet) -> str:
    """Return the page of a fleet."""
    analysis = fleet.analysis
    title = fleet.recorded.manifest.file.stem
    simulated = fleet.recorded.manifest.experiment is not None
    drawn = fleet_figures(analysis)
    measured = f", {analysis.measurements} measurements" if analysis.measurements != analysis.machines else ""
    outcome = outcome_words(analysis) if analysis.left_out else f"{len(analysis.failed)} not calibrated"
    robots = "robot" if analysis.machines == 1 else "robots"
    return Document(
        f"Fleet {title}",
        [
            Section("", [*_lead(analysis, fleet.draw), *warned(fleet.warnings)], "result"),
            *_looks(analysis, simulated=simulated),
            *_accuracy(analysis, drawn),
            *_parameters(fleet, drawn),
            *_drifts(analysis, drawn),
        ],
        fleet.command or "",
        subtitle=f"{analysis.machines} {robots}{' simulated' if simulated else ''}{measured}, {outcome}.",
    ).html(fleet)


def _lead(analysis: Analysis, draw: str | None) -> list[Lead]:
    """Return the figure that people look for: the error of the middle of the series, before and after."""
    after = analysis.errors.get("held_out")
    if after is None:
        return []
    before = analysis.errors.get("nominal")
    middle, was = after.of_means[0], ""
    if before is not None and before.of_means[0].value is not None:
        was = _mm(before.of_means[0].value)
    count = len(after.mean)
    words = (
        "Mean error on configurations that no calibration has seen, of the robot in the middle of "
        f"{'the series' if count == analysis.machines else f'{count} robots'}{', before and after' if was else ''}. "
        f"The worst robot has {_mm(float(after.mean.max()))} mm.{f' {draw}.' if draw else ''}"
    )
    calibrated = _mm(middle.value if middle.value is not None else float(after.mean.mean()))
    return [Lead([Words(words)], calibrated, was, "mm")]


def _looks(analysis: Analysis, *, simulated: bool) -> list[Section]:
    """Return which robots to look at, with links to their reports."""
    if not analysis.looks:
        return []
    rows = [
        (
            Cell(
                look.robot,
                link=None if simulated or look.reasons[0].why == "failed" else f"robots/{look.robot}/report.html",
            ),
            "; ".join(map(reason_words, look.reasons)),
        )
        for look in analysis.looks[:_ROWS]
    ]
    table = Table(("robot", "why"), rows, texts=(1,), look="looks")
    return [Section("Look at these first", [table, *_and_more(len(analysis.looks))], "looks")]


def _and_more(count: int) -> list[Words]:
    return [Words(f"And {count - _ROWS} more, in fleet.json.", quiet=True)] if count > _ROWS else []


def _accuracy(analysis: Analysis, drawn: dict[str, Figure]) -> list[Section]:
    if "accuracy" not in drawn:
        return []
    heading = [(f"{_COLUMNS[name]} ({len(errors.mean)})", "95 %") for name, errors in analysis.errors.items()]
    words = (
        "Intervals lie between two of the errors that were found (order statistics), so they assume nothing of how "
        "errors are distributed; they are about a series of which these robots are a random sample. A machine that was "
        "measured several times counts once, with its last measurement."
    )
    return [
        Section(
            "Accuracy over the series",
            [
                Words("The mean error of each robot over its held-out configurations."),
                *(Picture(name, drawn[name]) for name in ("accuracy", "histogram") if name in drawn),
                Table(("mean error [mm]", *chain(*heading)), _shares(analysis), look="spread", wide=True),
                Words(words, quiet=True),
            ],
            "errors",
        )
    ]


def _parameters(fleet: Fleet, drawn: dict[str, Figure]) -> list[Section]:
    """Return what the parameters of the kind with most robots say."""
    if not fleet.analysis.kinds:
        return []
    kind, *others = fleet.analysis.kinds
    blocks: list[Block] = []
    if others:
        names = ", ".join(each.kind.robot for each in others)
        blocks.append(Words(f"The kind with most robots; {names} in fleet.json.", quiet=True))
    if "parameters" in drawn:
        beside = "Robots are compared with one another."
        if len(kind.kind.latest) < LEAST_COMPARED:
            beside = f"With fewer than {LEAST_COMPARED} robots each is compared with its prior."
        words = (
            f"How far each parameter is from nominal, without the pull of the priors. {beside} Base and targets stand "
            "elsewhere in every cell and are not compared."
        )
        blocks += [Words(words), Picture("parameters", drawn["parameters"])]
    differing = [(difference.robot, difference_words(difference)) for difference in kind.differences[:_ROWS]]
    if differing:
        blocks.append(Table(("robot", "differs by"), differing, texts=(1,), look="looks"))
    else:
        blocks.append(Words("No robot differs from the others by more than chance."))
    if "spread" in drawn:
        words = (
            "How far parameters scatter over the series, without what the estimates are uncertain by, as a multiple of "
            "the prior (the dashed line is 1); with intervals of 95 %."
        )
        blocks += [Words(words), Picture("spread", drawn["spread"])]
    heading = ("parameter", "unit", "prior", "spread", "95 %", "mean off", "proposed", "verdict")
    rows = [_spread(spread, kind) for spread in kind.spreads]
    table = Table(heading, rows, texts=(1, 7), look="parameters sortable", wide=True)
    blocks.append(Folded("Every parameter beside its prior", [table], open="spread" in drawn))
    if fleet.proposed is not None:
        words = (
            f"{PRIORS_FILE} is the nominal robot with the proposed priors: give it to calibrations of further robots "
            "of this series, or to an experiment."
        )
        blocks.append(Words(words))
    return [Section(f"Parameters of {kind.kind.robot}", blocks, "parameters-section")]


def _drifts(analysis: Analysis, drawn: dict[str, Figure]) -> list[Section]:
    if not analysis.drifts:
        return []
    unseen = analysis.kinds[0].drifts.unknown if analysis.kinds else []
    words = "Chance counts all parameters of all machines that were compared."
    if unseen:
        words = f"No change can be seen of {', '.join(unseen)}: base or target may have moved instead. {words}"
    heading = ("machine", "parameter", "campaigns", "months", "change", "a month", "95 %", "verdict")
    rows = [_change(drift) for drift in analysis.drifts[:_ROWS]]
    return [
        Section(
            "Machines measured again",
            [
                *(Picture(name, drawn[name]) for name in ("drift-lengths", "drift-angles") if name in drawn),
                Table(heading, rows, texts=(1, 7), look="parameters", wide=True),
                *_and_more(len(analysis.drifts)),
                *(Words(f"{growth_words(growth)}.") for kind in analysis.kinds for growth in kind.drifts.grown[:_ROWS]),
                Words(words, quiet=True),
            ],
            "drift",
        )
    ]


def _mm(length: float) -> str:
    return significant(length * 1e3)


def _shares(analysis: Analysis) -> list[tuple[str, ...]]:
    """Return the rows of the table of accuracy: errors below which a share of the robots is, with intervals."""
    columns = [errors.of_means for errors in analysis.errors.values()]
    rows = [(f"{ones[0].share * 100:g} % below", *chain(*map(_share, ones))) for ones in zip(*columns, strict=True)]
    worst = [(_mm(float(errors.mean.max())), "") for errors in analysis.errors.values()]
    return [*rows, ("the worst", *chain(*worst))]


def _share(quantile: Quantile) -> tuple[str, str]:
    if quantile.value is None:
        return "not known", f"takes {quantile.needed} robots"
    if quantile.low is not None and quantile.high is not None:
        return _mm(quantile.value), f"{_mm(quantile.low)} to {_mm(quantile.high)}"
    if quantile.low is not None:
        return _mm(quantile.value), f"above {_mm(quantile.low)}"
    return _mm(
        quantile.value
    ), f"takes {quantile.needed} robots" if quantile.high is None else f"below {_mm(quantile.high)}"


def _spread(spread: ParameterSpread, analysis: KindAnalysis) -> tuple[str | Cell, ...]:
    number = analysis.kind.parameters.index(spread.parameter)
    together = analysis.kind.together(number)
    words = f"told with {', '.join(together)} only" if together else _VERDICTS[spread.verdict]
    low, high = figures_text(spread.low, spread.unit), figures_text(spread.high, spread.unit)
    look = "differs" if spread.verdict == "wider" else "" if spread.verdict in ("agrees", "narrower") else "untold"
    return (
        Cell(spread.parameter, code=True),
        SHOWN_AS[spread.unit],
        figures_text(spread.prior, spread.unit),
        figures_text(spread.spread, spread.unit),
        "" if spread.spread is None else f"{low} to {high}",
        Cell(figures_text(spread.mean, spread.unit), look="differs" if spread.beside else ""),
        figures_text(spread.proposed, spread.unit),
        Cell(words, look=look),
    )


def _change(drift: Drift) -> tuple[str | Cell, ...]:
    words = "changed" if drift.significant else "no more than chance"
    return (
        drift.machine,
        Cell(together_words(drift), code=True),
        str(drift.campaigns),
        f"{drift.months:.1f}",
        f"{figures_text(drift.change, drift.unit)} {SHOWN_AS[drift.unit]}",
        figures_text(drift.slope, drift.unit),
        f"{figures_text(drift.low, drift.unit)} to {figures_text(drift.high, drift.unit)}",
        Cell(
            words + ("" if drift.steady is not False else ", not steadily"), look="differs" if drift.significant else ""
        ),
    )
