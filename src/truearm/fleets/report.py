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


def fleet_html(found: Fleet) -> str:
    """Return the page of a fleet."""
    said = found.analysis
    title = found.recorded.manifest.file.stem
    simulated = found.recorded.manifest.experiment is not None
    drawn = fleet_figures(said)
    measured = f", {said.measurements} measurements" if said.measurements != said.machines else ""
    outcome = outcome_words(said) if said.left_out else f"{len(said.failed)} not calibrated"
    robots = "robot" if said.machines == 1 else "robots"
    return Document(
        f"Fleet {title}",
        [
            Section("", [*_lead(said, found.draw), *warned(found.warnings)], "result"),
            *_looks(said, simulated=simulated),
            *_accuracy(said, drawn),
            *_parameters(found, drawn),
            *_drifts(said, drawn),
        ],
        found.command or "",
        subtitle=f"{said.machines} {robots}{' simulated' if simulated else ''}{measured}, {outcome}.",
    ).html(found)


def _lead(said: Analysis, draw: str | None) -> list[Lead]:
    """Return the figure that people look for: the error of the middle of the series, before and after."""
    after = said.errors.get("held_out")
    if after is None:
        return []
    before = said.errors.get("nominal")
    middle, was = after.of_means[0], ""
    if before is not None and before.of_means[0].value is not None:
        was = _mm(before.of_means[0].value)
    count = len(after.mean)
    words = (
        "Mean error on configurations that no calibration has seen, of the robot in the middle of "
        f"{'the series' if count == said.machines else f'{count} robots'}{', before and after' if was else ''}. "
        f"The worst robot has {_mm(float(after.mean.max()))} mm.{f' {draw}.' if draw else ''}"
    )
    now = _mm(middle.value if middle.value is not None else float(after.mean.mean()))
    return [Lead([Words(words)], now, was, "mm")]


def _looks(said: Analysis, *, simulated: bool) -> list[Section]:
    """Return which robots to look at, with links to their reports."""
    if not said.looks:
        return []
    rows = [
        (
            Cell(
                look.robot,
                link=None if simulated or look.reasons[0].why == "failed" else f"robots/{look.robot}/report.html",
            ),
            "; ".join(map(reason_words, look.reasons)),
        )
        for look in said.looks[:_ROWS]
    ]
    table = Table(("robot", "why"), rows, texts=(1,), look="looks")
    return [Section("Look at these first", [table, *_and_more(len(said.looks))], "looks")]


def _and_more(count: int) -> list[Words]:
    return [Words(f"And {count - _ROWS} more, in fleet.json.", quiet=True)] if count > _ROWS else []


def _accuracy(said: Analysis, drawn: dict[str, Figure]) -> list[Section]:
    if "accuracy" not in drawn:
        return []
    heading = [(f"{_COLUMNS[name]} ({len(errors.mean)})", "95 %") for name, errors in said.errors.items()]
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
                Table(("mean error [mm]", *chain(*heading)), _shares(said), look="spread", wide=True),
                Words(words, quiet=True),
            ],
            "errors",
        )
    ]


def _parameters(found: Fleet, drawn: dict[str, Figure]) -> list[Section]:
    """Return what the parameters of the kind with most robots say."""
    if not found.analysis.kinds:
        return []
    kind, *others = found.analysis.kinds
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
    if found.proposed is not None:
        words = (
            f"{PRIORS_FILE} is the nominal robot with the proposed priors: give it to calibrations of further robots "
            "of this series, or to an experiment."
        )
        blocks.append(Words(words))
    return [Section(f"Parameters of {kind.kind.robot}", blocks, "parameters-section")]


def _drifts(said: Analysis, drawn: dict[str, Figure]) -> list[Section]:
    if not said.drifts:
        return []
    unseen = said.kinds[0].drifts.unknown if said.kinds else []
    words = "Chance counts all parameters of all machines that were compared."
    if unseen:
        words = f"No change can be seen of {', '.join(unseen)}: base or target may have moved instead. {words}"
    heading = ("machine", "parameter", "campaigns", "months", "change", "a month", "95 %", "verdict")
    rows = [_change(drift) for drift in said.drifts[:_ROWS]]
    return [
        Section(
            "Machines measured again",
            [
                *(Picture(name, drawn[name]) for name in ("drift-lengths", "drift-angles") if name in drawn),
                Table(heading, rows, texts=(1, 7), look="parameters", wide=True),
                *_and_more(len(said.drifts)),
                Words(words, quiet=True),
            ],
            "drift",
        )
    ]


def _mm(length: float) -> str:
    return significant(length * 1e3)


def _shares(said: Analysis) -> list[tuple[str, ...]]:
    """Return the rows of the table of accuracy: errors below which a share of the robots is, with intervals."""
    columns = [errors.of_means for errors in said.errors.values()]
    rows = [(f"{ones[0].share * 100:g} % below", *chain(*map(_share, ones))) for ones in zip(*columns, strict=True)]
    worst = [(_mm(float(errors.mean.max())), "") for errors in said.errors.values()]
    return [*rows, ("the worst", *chain(*worst))]


def _share(one: Quantile) -> tuple[str, str]:
    if one.value is None:
        return "not known", f"takes {one.needed} robots"
    if one.low is not None and one.high is not None:
        return _mm(one.value), f"{_mm(one.low)} to {_mm(one.high)}"
    if one.low is not None:
        return _mm(one.value), f"above {_mm(one.low)}"
    return _mm(one.value), f"takes {one.needed} robots" if one.high is None else f"below {_mm(one.high)}"


def _spread(one: ParameterSpread, found: KindFound) -> tuple[str | Cell, ...]:
    number = found.kind.parameters.index(one.parameter)
    together = found.kind.together(number)
    words = f"told with {', '.join(together)} only" if together else _VERDICTS[one.verdict]
    low, high = figures_text(one.low, one.unit), figures_text(one.high, one.unit)
    look = "differs" if one.verdict == "wider" else "" if one.verdict in ("agrees", "narrower") else "untold"
    return (
        Cell(one.parameter, code=True),
        SHOWN_AS[one.unit],
        figures_text(one.prior, one.unit),
        figures_text(one.spread, one.unit),
        "" if one.spread is None else f"{low} to {high}",
        Cell(figures_text(one.mean, one.unit), look="differs" if one.beside else ""),
        figures_text(one.proposed, one.unit),
        Cell(words, look=look),
    )


def _change(one: Drift) -> tuple[str | Cell, ...]:
    words = "changed" if one.significant else "no more than chance"
    return (
        one.machine,
        Cell(together_words(one), code=True),
        str(one.campaigns),
        f"{one.months:.1f}",
        f"{figures_text(one.change, one.unit)} {SHOWN_AS[one.unit]}",
        figures_text(one.slope, one.unit),
        f"{figures_text(one.low, one.unit)} to {figures_text(one.high, one.unit)}",
        Cell(words + ("" if one.steady is not False else ", not steadily"), look="differs" if one.significant else ""),
    )
