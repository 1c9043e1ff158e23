"""A fit of the model that was chosen, or of a smaller one where that is not sound; and what to know of the choice."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from truearm.engine.base.errors import Notice, Rule, counted, listed
from truearm.engine.choosing.search import CURVE
from truearm.engine.choosing.selection import ORDERED, Selection
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.thinning import JUDGED_IN_PART
from truearm.engine.fit.bounds import Bounds
from truearm.engine.fit.fit import Fit, Status, identify
from truearm.engine.fit.fixed_places import NOTHING_FIXED, FixedPlaces
from truearm.engine.fit.losses import Loss
from truearm.engine.fit.rounds import Redundant
from truearm.engine.robot.robot import Robot

#: How a fit ends that a smaller model may do without.
_UNSOUND: Final = (Status.RANK_LOSS, Status.NOT_CONVERGED)


def identify_chosen(
    robot: Robot,
    data: Dataset,
    selection: Selection,
    *,
    loss: Loss = "linear",
    redundancy: Redundant = "prior",
    bounds: Bounds | None = None,
    bounds_file: str = "bounds",
    held: FixedPlaces = NOTHING_FIXED,
    bootstrap: int = 0,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> tuple[Selection, Fit]:
    """Identify a robot with the model that was chosen.

    Where that ends in ``rank-loss`` or ``not-converged``, the next smaller model is taken; where none is sound, the
    first one stays. Where no joint gets a curve, joint curves are no part of the model.

    Args:
        robot, data, loss, redundancy, bounds, bounds_file, held, bootstrap, seed, progress: As
            :func:`truearm.engine.fit.fit.identify` takes them.
        selection: Of these data.

    Returns:
            The choice that holds, and its fit.
    """
    first: tuple[Selection, Fit] | None = None
    while True:
        progress(f"identifying the {selection.model.name} model on {data.configurations} configurations")
        fit = identify(
            selection.prepared(robot),
            data,
            selection.model,
            loss=loss,
            redundancy=redundancy,
            bounds=bounds,
            bounds_file=bounds_file,
            fixed=held,
            bootstrap=bootstrap,
            seed=seed,
            progress=progress,
        )
        if CURVE in fit.model.effects and not any(p.group == CURVE for p in fit.free.parameters):
            selection = selection.without_curves()
            continue
        if fit.status not in _UNSOUND:
            return selection, fit
        first = first or (selection, fit)
        if not selection.smaller:
            return first
        selection = selection.instead(fit.status.value)


def check_part(compared: Dataset, data: Dataset) -> list[Notice]:
    """Say if a model was chosen by a part of the data."""
    if compared.configurations == data.configurations:
        return []
    return [
        JUDGED_IN_PART(
            f"The data are large for so many effects: the model was chosen by {compared.configurations} of "
            f"{counted(data.configurations, 'training configuration')}, evenly spaced, and fitted to all of them."
        )
    ]


SMALLER_MODEL: Final = Rule(
    "smaller-model",
    "note",
    "`auto` took a smaller model, because the fit of the one it [chose](models.md#let-the-data-choose) first was not "
    "sound",
)
ORDER_IN_THE_MODEL: Final = Rule(
    "order-in-the-model",
    "note",
    "`auto` took warm-up or approach: predictions without an order are those of the middle of the session",
)
PERIODS_FOUND: Final = Rule(
    "periods-found",
    ("note", "warning"),
    "errors that repeat with the joints' angles, which `auto` found; a warning where other numbers of periods would "
    "look the same",
)


def check_choice(selection: Selection) -> list[Notice]:
    """Return what to know of a model that was chosen."""
    found = []
    if selection.passed_over:
        effects, status = selection.passed_over[0]
        found.append(
            SMALLER_MODEL(
                f"The model that was chosen first ({listed(effects) or 'geometric'}) ended in {status}, so a smaller "
                "one was taken. More configurations, which move every joint, could bear it."
            )
        )
    ordered = [name for name in selection.model.effects if name in ORDERED]
    if ordered:
        found.append(
            ORDER_IN_THE_MODEL(
                f"The model follows the order of this campaign ({listed(ordered)}). That cleans the other parameters. "
                "Predictions whose place in an order is not known, of other sessions for example, are those of the "
                "middle of this one."
            )
        )
    if selection.lines:
        found.append(
            PERIODS_FOUND(
                f"Errors that repeat with the joints' angles were found and taken out: "
                f"{'; '.join(line.words for line in selection.lines)}. The numbers of periods stand in the calibrated "
                "robot as transmission_periods.",
                "warning" if any(line.aliases for line in selection.lines) else "note",
            )
        )
    return found
