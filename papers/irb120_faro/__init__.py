"""A measured IRB 120: what each model leaves on configurations it has not seen, and where the rest comes from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import Final

import numpy as np

from papers import Progress
from papers.irb120 import ELASTIC, without_beta
from papers.irb120_faro.remainder import FOLDS, left_over
from papers.seeds import Figures, Seed, gathered, over_seeds
from papers.study import Study
from papers.texts import Rows, told
from truearm.engine.base.errors import InputError
from truearm.engine.data.checks import clean_references
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.rigid_tool import constellation
from truearm.engine.data.statistics import Spread, errors_of, without_table_motion
from truearm.engine.document.drawing import AFTER, BEFORE, Figure, axis, figure, rounded
from truearm.engine.fit.every_effect import identify_every_effect
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import FRAMES, Model, named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.importing.files import read_matrices

#: Training configurations of the document, of `auto` where there are few, and where there are few.
_DOCUMENT, _AUTO_FEW, _FEW = 38, 40, 50
#: Of the document's triangular artefact (section 2.2.1), which this end-effector resembles.
PAYLOAD: Final = Payload(2.7, (0.050, 0.025, 0.100))
#: Seeds at which each model's remainder is looked at, at most.
_REMAINDERS: Final = 2
_EFFECTS: Final = (
    *("bearing-compliance", "hardening", "clearance", "fourier", "backlash", "warm-up", "transmission-error"),
    "approach",
)
#: Models of which the remainder is looked at, beside the elastic one.
_COLD: Final = "elastic and five more, no warm-up"
_WARM: Final = "elastic and six more"
_TOGETHER: Final = ("bearing-compliance", "hardening", "warm-up", "transmission-error", "fourier", "approach")


@dataclass(frozen=True)
class _Case:
    """What is fitted: a model, and what the nominal robot is given."""

    name: str  #: As tables print it.
    model: Model  #: The model.
    #: payload, beta: whether the nominal robot has the payload, and Hayati's beta between axes 2 and 3.
    payload: bool = True
    beta: bool = True

    def of(self, robot: Robot) -> Robot:
        """Return the robot that the fit starts from."""
        robot = robot.with_payload(PAYLOAD) if self.payload else robot
        return robot if self.beta else without_beta(robot)


_NOMINAL: Final = _Case("nominal, base and targets fitted", FRAMES, payload=False)
_PLAIN: Final = _Case("elastic", ELASTIC)
#: Beside the document's, in the order of its table.
_BESIDE: Final = (
    _NOMINAL,
    _Case("geometric, no beta", named_model("geometric"), payload=False, beta=False),
    _Case("elastic, no beta", ELASTIC, beta=False),
    _Case("elastic, no payload, no beta", ELASTIC, payload=False, beta=False),
    _PLAIN,
    _Case("elastic, no payload", ELASTIC, payload=False),
)


def _with(*effects: str) -> _Case:
    """Return the elastic model and some more effects."""
    model = Model("elastic and more", "elastic, and some joint effects", ELASTIC.groups, (*ELASTIC.effects, *effects))
    return _Case(f"elastic{' and ' if len(effects) == 1 else ', '}{', '.join(effects)}", model)


def _cases(together: Sequence[str]) -> tuple[_Case, ...]:
    """Return what is fitted to every split: effects that are added on top of each other are, the first two of them."""
    nominal, rigid, theirs, theirs_without, plain, without = _BESIDE
    return (
        nominal,
        _Case("offsets", named_model("offsets"), payload=False),
        rigid,
        _Case("geometric", named_model("geometric"), payload=False),
        theirs_without,
        theirs,
        without,
        plain,
        _Case("tilting", named_model("tilting")),
        _Case("full, no payload", named_model("full"), payload=False),
        _Case("full", named_model("full")),
        _with(*together[:2]),
    )


def study(
    seeds: int,
    progress: Progress,
    folder: Path,
    many: int = 300,
    searches: tuple[int, int] = (2, 1),
    effects: tuple[str, ...] = _EFFECTS,
    together: tuple[str, ...] = _TOGETHER,
) -> Study:
    """Fit every model to every split.

    Args:
        seeds: How many splits into training and held-out configurations.
        progress: Called with a few words at each step.
        folder: Of the measured data.
        many: Training configurations where there are plenty.
        searches: At how many seeds at most ``auto`` is fitted, from 40 and from `many` configurations: it takes
            long.
        effects: Effects that are added to the elastic model one by one; the first of `together` is among them.
        together: Effects that are added on top of each other, two at least.
    """
    raw = measured(folder)
    if raw.configurations <= many:
        raise InputError(
            "there are too few configurations at which all reflectors were seen",
            where=raw.source,
            came=raw.configurations,
            allowed=f"more than {many}",
        )
    data = without_table_motion(raw)
    robot = load_robot("irb120")
    one = partial(_split, robot, raw, data, many=many, searches=searches, effects=effects, together=together)
    tables, moved = gathered(over_seeds(seeds, progress, one))
    tables |= _left_over(robot, data, together, min(seeds, _REMAINDERS), progress)
    means = {row.removesuffix(": mean"): values for row, values in tables["many"].items() if row.endswith(": mean")}
    usual = [f"{case.name}: {what}" for case in _cases(together) for what in ("mean", "maximum")]
    elastic, gains = np.array(means["elastic"]), {}
    for effect in effects:
        gain = elastic - np.array(means[_with(effect).name])
        gains[_with(effect).name] = f"Gains {np.median(gain):.4f} mm, {(gain > 0).sum()} of {len(gain)} splits gain."
    several = [_with(*together[:n]).name for n in range(1, len(together) + 1)]
    beside = [f"{case.name}: {what}" for case in _BESIDE for what in ("mean", "maximum")]
    left_in = tables["motion"].pop("left in")
    every: dict[str, Rows] = {
        **tables,
        "document": {row: tables["document"][row] for row in beside},
        "many": {row: tables["many"][row] for row in usual},
        "gains": {name: means[name] for name in ("elastic", *gains)},
        "cumulative": {name: means[name] for name in ("elastic", *several)},
        "instrument": _instrument(raw, (np.array(left_in) - elastic).tolist()),
    }
    moving = "; ".join(words for one in moved for words in one)
    cold, warm = (float(np.median(tables["remainder"][f"{name}: mean length"])) for name in (_COLD, _WARM))
    figures = {"models": _models_figure(tables, together, many)}
    texts: dict[str, object] = {"document_count": _DOCUMENT, "many_count": many, "few_count": _FEW}
    texts |= {"auto_few": _AUTO_FEW, "best": np.median(means[several[-1]]), "warmth": cold - warm}
    texts |= {"left_in": np.median(left_in), "folds": FOLDS, "searches": searches}
    texts |= {"moved": f" Its effects move the targets by so much [mm]: {moving}." if moving else ""}
    return told(__file__, seeds, every, figures, texts, why={"gains": gains})


def _left_over(
    robot: Robot, data: Dataset, together: Sequence[str], parts: int, progress: Progress
) -> dict[str, dict[str, list[float]]]:
    """Return what is left over by the elastic model, by it and all effects but warm-up, and by it and all of them."""
    tables: dict[str, dict[str, list[float]]] = {}
    for name, words, model in (
        ("elastic", "elastic", ELASTIC),
        (_COLD, "all effects but warm-up", _with(*(effect for effect in together if effect != "warm-up")).model),
        (_WARM, "all effects", _with(*together).model),
    ):
        progress(f"what is left over: {words}")
        found, _ = gathered((left_over(_PLAIN.of(robot), data, model, part), None) for part in range(parts))
        for table, rows in found.items():
            tables.setdefault(table, {}).update({f"{name}: {row}": values for row, values in rows.items()})
    return tables


def measured(folder: Path) -> Dataset:
    """Return the measured data of all configurations at which every reflector was seen."""
    targets, bases = ({str(n): folder / f"{kind}_{n}.txt" for n in (1, 2, 3)} for kind in ("target", "base"))
    bases = {f"base_{name}": path for name, path in bases.items()}
    raw, _ = read_matrices(folder / "joints_commanded.txt", targets, bases, "deg", "mm")
    return raw.of_configurations(np.flatnonzero(np.isfinite(constellation(raw)).all(axis=(1, 2))))


def _split(
    robot: Robot,
    raw: Dataset,
    data: Dataset,
    seed: Seed,
    many: int,
    searches: tuple[int, int],
    effects: tuple[str, ...],
    together: tuple[str, ...],
) -> tuple[Figures, list[str]]:
    """Return errors on held-out configurations of one split [mm], and what the effects of `auto` do."""
    order = seed.generator().permutation(data.configurations)
    usual = _cases(together)
    further = [_with(effect) for effect in effects]
    further += [_with(*together[:n]) for n in range(3, len(together) + 1)]

    def fitted(count: int, wanted: Sequence[_Case]) -> dict[str, float]:
        seed.step(f"{count} training configurations")
        rows: dict[str, float] = {}
        for case in wanted:
            rows |= _mean_and_maximum(case.name, _held_out(case.of(robot), data, order, count, case.model))
        return rows

    figures: Figures = {
        "document": fitted(_DOCUMENT, usual),
        "few": fitted(_FEW, usual),
        "many": fitted(many, [*usual, *further]),
        "motion": {"left in": _held_out(_PLAIN.of(robot), raw, order, many, ELASTIC).mean},
        "automatic": {},
    }
    moved = []
    for count, most in zip((_AUTO_FEW, many), searches, strict=True):
        if seed.number < most:
            seed.step(f"auto from {count} configurations")
            start = _PLAIN.of(robot)
            training, rest = (data.of_configurations(part) for part in (order[:count], order[count:]))
            _, fit, shares = identify_every_effect(start, training, seed=seed.number)
            errors = Spread.of(errors_of(fit.robot, rest).position_norms * 1e3)
            figures["automatic"] |= _mean_and_maximum(f"{count} configurations", errors)
            moving = ", ".join(f"{one.effect} {1e3 * (one.moves or 0.0):.3f}" for one in shares.effects if one.taken)
            moved.append(f"{moving} ({count} configurations, seed {seed.number})")
    return figures, moved


def _mean_and_maximum(name: str, errors: Spread) -> dict[str, float]:
    return {f"{name}: mean": errors.mean, f"{name}: maximum": errors.max}


def _held_out(robot: Robot, data: Dataset, order: IntArray, count: int, model: Model) -> Spread:
    fit = identify(robot, data.of_configurations(order[:count]), model)
    return Spread.of(errors_of(fit.robot, data.of_configurations(order[count:])).position_norms * 1e3)


def _instrument(raw: Dataset, gained: Sequence[float]) -> Rows:
    """Return what tracker and table contribute, by what the data say without a model of the robot."""
    points = constellation(raw) * 1e3
    spreads = [
        float(np.nanstd(np.linalg.norm(points[:, i] - points[:, j], axis=1), ddof=1))
        for i, j in combinations(range(points.shape[1]), 2)
    ]
    rows: dict[str, Sequence[float] | float] = {
        "distance between two reflectors of the tool, deviation": spreads,
        "tracker noise: deviation of a coordinate": float(np.sqrt(np.mean(np.square(spreads)) / 2)),
    }
    references = clean_references(raw)
    if references is not None:
        away = np.linalg.norm(references - np.nanmedian(references, axis=0), axis=2) * 1e3
        rows["table: mean distance of its reflectors from their usual place"] = float(np.nanmean(away))
        rows["table: largest"] = float(np.nanmax(away))
    turned = np.degrees(raw.joints)
    nearest = np.abs(turned[:, None] - turned[None]).max(axis=2) + 1e9 * np.eye(len(turned))
    rows["held-out mean that taking the table's motion out gains, elastic"] = gained
    rows["two configurations nearest to each other: largest difference of a joint [deg]"] = float(nearest.min())
    return rows


def _models_figure(tables: Mapping[str, Rows], together: Sequence[str], many: int) -> Figure:
    """Draw the mean error of every model at every split."""
    traces: list[Figure] = []
    for table, count, colour in (("document", _DOCUMENT, "#b3261e"), ("few", _FEW, BEFORE), ("many", many, AFTER)):
        means = {case.name: np.array(tables[table][f"{case.name}: mean"]) for case in _cases(together)[1:]}
        traces.append(
            {
                **{"type": "box", "name": f"{count} training configurations", "orientation": "h"},
                "y": [name for name, values in means.items() for _ in values],
                "x": rounded(np.concatenate(list(means.values())), 4),
                "marker": {"color": colour, "size": 4},
                **{"line": {"width": 1.5}, "boxpoints": "all", "jitter": 0.4, "pointpos": 0},
            }
        )
    x = axis("mean position error on configurations that the fit has not seen [mm]") | {"rangemode": "tozero"}
    y = axis("") | {"autorange": "reversed"}
    mark = {"type": "line", "x0": 0.146, "x1": 0.146, "y0": 0, "y1": 1, "yref": "paper", "line": {"dash": "dot"}}
    words = {"text": "document, 38 configurations", "x": 0.15, "y": 0.0, "yref": "paper"}
    words |= {"xanchor": "left", "yanchor": "bottom", "showarrow": False}
    return figure(traces, 620, xaxis=x, yaxis=y, boxmode="group", shapes=[mark], annotations=[words])
