"""Every model fitted to a measured IRB 120 and judged on configurations that it has not seen, once a seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from papers import Progress
from papers.irb120 import ELASTIC, without_beta
from papers.irb120_faro.remainder import Remainder, left_over
from papers.seeds import Seed, over_seeds
from truearm.engine.base.errors import InputError
from truearm.engine.choosing.chosen_fit import identify_chosen
from truearm.engine.choosing.selection import select
from truearm.engine.data.dataset import Dataset, IntArray
from truearm.engine.data.rigid_tool import constellation
from truearm.engine.data.statistics import Spread, errors_of, without_table_motion
from truearm.engine.fit.fit import identify
from truearm.engine.fit.models import FRAMES, Model, named_model
from truearm.engine.robot.library import load_robot
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.importing.files import read_matrices

#: Training configurations of the document, of `auto` where there are few, and where there are few.
DOCUMENT, AUTO_FEW, FEW = 38, 40, 50
#: Of the document's triangular artefact (section 2.2.1), which this end-effector resembles.
_PAYLOAD: Final = Payload(2.7, (0.050, 0.025, 0.100))
#: Seeds at which each model's remainder is looked at, at most.
_REMAINDERS: Final = 2


@dataclass(frozen=True)
class Case:
    """What is fitted: a model, and what the nominal robot is given."""

    name: str  #: As tables print it.
    model: Model  #: The model.
    #: payload, beta: whether the nominal robot has the payload, and Hayati's beta between axes 2 and 3.
    payload: bool = True
    beta: bool = True

    def of(self, robot: Robot) -> Robot:
        """Return the robot that the fit starts from."""
        robot = robot.with_payload(_PAYLOAD) if self.payload else robot
        return robot if self.beta else without_beta(robot)


NOMINAL: Final = Case("nominal, base and targets fitted", FRAMES, payload=False)
RIGID_WITHOUT_BETA: Final = Case("geometric, no beta", named_model("geometric"), payload=False, beta=False)
THEIRS: Final = Case("elastic, no beta", ELASTIC, beta=False)
THEIRS_WITHOUT_PAYLOAD: Final = Case("elastic, no payload, no beta", ELASTIC, payload=False, beta=False)
WITHOUT_PAYLOAD: Final = Case("elastic, no payload", ELASTIC, payload=False)
PLAIN: Final = Case("elastic", ELASTIC)


def with_one(effect: str) -> Case:
    """Return the elastic model and one more effect."""
    return Case(f"elastic and {effect}", _with(effect))


def with_several(effects: Sequence[str]) -> Case:
    """Return the elastic model and several more effects."""
    return Case(f"elastic, {', '.join(effects)}", _with(*effects))


def cases(together: Sequence[str]) -> tuple[Case, ...]:
    """Return what is fitted to every split.

    Args:
        together: Effects that are added to the elastic model on top of each other: the first two of them are.
    """
    return (
        NOMINAL,
        Case("offsets", named_model("offsets"), payload=False),
        RIGID_WITHOUT_BETA,
        Case("geometric", named_model("geometric"), payload=False),
        THEIRS_WITHOUT_PAYLOAD,
        THEIRS,
        WITHOUT_PAYLOAD,
        PLAIN,
        Case("tilting", named_model("tilting")),
        Case("full, no payload", named_model("full"), payload=False),
        Case("full", named_model("full")),
        with_several(together[:2]),
    )


@dataclass(frozen=True, eq=False)
class Chosen:
    """What `auto` chose from a number of configurations, and its errors on the others [mm]."""

    count: int
    seed: int
    model: Model
    errors: Spread


@dataclass(frozen=True, eq=False)
class Outcome:
    """Errors on held-out configurations of one split [mm]."""

    #: document, few, many: from as many training configurations as the document has, from few and from many.
    document: Mapping[Case, Spread]
    few: Mapping[Case, Spread]
    many: Mapping[Case, Spread]
    table_motion_left_in: Spread  #: Of the elastic model, from many, if the table's motion is not taken out.
    chosen: tuple[Chosen, ...]  #: Of the models that `auto` chose, if it was asked.


@dataclass(frozen=True, eq=False)
class Run:
    """The whole study."""

    outcomes: tuple[Outcome, ...]  #: Of the seeds.
    raw: Dataset  #: The data with the table's motion.
    many: int  #: Training configurations where there are plenty.
    effects: tuple[str, ...]  #: Those that were added to the elastic model one by one.
    together: tuple[str, ...]  #: Those that were added on top of each other.
    #: elastic, cold, warm: what is left over by the elastic model, by it and all of `together` but warm-up, and by it
    #: and all of them.
    elastic: tuple[Remainder, ...]
    cold: tuple[Remainder, ...]
    warm: tuple[Remainder, ...]


def run(
    seeds: int,
    progress: Progress,
    folder: Path,
    many: int,
    searches: tuple[int, int],
    effects: tuple[str, ...],
    together: tuple[str, ...],
) -> Run:
    """Fit every model to every split.

    Args:
        seeds: How many splits into training and held-out configurations.
        progress: Called with a few words at each step.
        folder: Of the measured data.
        many: Training configurations where there are plenty.
        searches: At how many seeds at most ``auto`` chooses a model, from few and from `many` configurations.
        effects, together: Effects that are added to the elastic model one by one, and on top of each other.
    """
    raw = _measured(folder)
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

    def remainders(words: str, model: Model) -> tuple[Remainder, ...]:
        progress(f"what is left over: {words}")
        return tuple(left_over(PLAIN.of(robot), data, model, part) for part in range(min(seeds, _REMAINDERS)))

    return Run(
        outcomes=over_seeds(seeds, progress, one),
        raw=raw,
        many=many,
        effects=effects,
        together=together,
        elastic=remainders("elastic", ELASTIC),
        cold=remainders("all effects but warm-up", _with(*(effect for effect in together if effect != "warm-up"))),
        warm=remainders("all effects", _with(*together)),
    )


def _measured(folder: Path) -> Dataset:
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
) -> Outcome:
    order = seed.generator().permutation(data.configurations)
    usual = cases(together)
    further = [with_one(effect) for effect in effects]
    further += [with_several(together[:n]) for n in range(3, len(together) + 1)]

    def fitted(count: int, wanted: Sequence[Case]) -> dict[Case, Spread]:
        seed.step(f"{count} training configurations")
        return {case: _held_out(case.of(robot), data, order, count, case.model) for case in wanted}

    chosen = []
    document, few, plenty = fitted(DOCUMENT, usual), fitted(FEW, usual), fitted(many, [*usual, *further])
    left_in = _held_out(PLAIN.of(robot), raw, order, many, ELASTIC)
    for count, most in zip((AUTO_FEW, many), searches, strict=True):
        if seed.number < most:
            seed.step(f"auto chooses from {count} configurations")
            start = PLAIN.of(robot)
            training, rest = (data.of_configurations(part) for part in (order[:count], order[count:]))
            choice, fit = identify_chosen(start, training, select(start, training, seed=seed.number))
            errors = Spread.of(errors_of(fit.robot, rest).position_norms * 1e3)
            chosen.append(Chosen(count, seed.number, choice.model, errors))
    return Outcome(document, few, plenty, left_in, tuple(chosen))


def _with(*effects: str) -> Model:
    return Model("elastic and more", "elastic, and some joint effects", ELASTIC.groups, (*ELASTIC.effects, *effects))


def _held_out(robot: Robot, data: Dataset, order: IntArray, count: int, model: Model) -> Spread:
    fit = identify(robot, data.of_configurations(order[:count]), model)
    return Spread.of(errors_of(fit.robot, data.of_configurations(order[count:])).position_norms * 1e3)
