"""What a calibration is asked for."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import Excluding, IntoFolder, Loaded, Long, Noted, OfCell, OfData, Repeatable, Split
from truearm.engine.command.kinds import Choice, Flag, Given, Names, NumberOr, Whole
from truearm.engine.command.request import as_in, job, option

if TYPE_CHECKING:
    from truearm.calibration.result import Calibration
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.fit.bounds import Bounds
    from truearm.engine.fit.losses import Loss
    from truearm.engine.fit.rounds import Redundant
    from truearm.engine.robot.robot import Robot

#: Training configurations from which on `auto` predicts as well as `geometric` where nothing is known of loads. On
#: twins whose joints have play and on twins that have none, its median error is then at most 3 % larger.
ENOUGH: Final = 15


def _models() -> Collection[str]:
    from truearm.calibration.calibrating import MODELS

    return MODELS


def _effects() -> Collection[str]:
    from truearm.engine.robot.effects import EFFECTS

    return [effect.name for effect in EFFECTS]


class Calibrate(OfData, Split, Loaded, Excluding, Noted, IntoFolder, Repeatable, Long):
    """Identify the real robot from measurements and judge it on configurations it has not seen.

    Writes calibrated.yaml, result.json, report.html and calibrated.urdf into a folder. The parameter values of the
    robot that is given are the start.
    """

    job = "calibrate"
    refuses = (
        "For anything that cannot be used, with a message that says what to do. Where a sound result stays, it is a "
        ":class:`truearm.calibration.parts.ResultKeptError`, which has the new one as its attribute ``result``."
    )
    model: str | None = option(
        Choice("MODEL", _models),
        "auto: every joint effect, as large as the data tell; offsets, joints, geometric, elastic, tilting, full; "
        "frames: base, tool and fixtures alone.",
        default=None,
        shown=f"auto where loads are known or {ENOUGH} configurations are trained on, else geometric; offsets for "
        "fewer where the robot was calibrated before",
        more="It is ``geometric`` too with `effects`, `zones`, `monte_carlo`, a `redundancy` other than ``prior``, and "
        "where readings are lengths or of fixtures, or an error of the data is told. "
        "``auto`` chooses nothing: what the training part does not support shrinks to nothing.",
    )
    loss: Loss = option(
        Choice("LOSS", ("linear", "huber", "cauchy", "l1", "l1-components")),
        "linear, huber, cauchy, l1 or l1-components.",
        default="linear",
        more="``l1`` is the sum of the distances of the readings, ``l1-components`` of the absolute values of their "
        "coordinates.",
    )
    redundancy: Redundant = option(
        Choice("HOW", ("prior", "drop", "none")),
        "prior (keep all, near nominal), drop (hold and name redundant ones), none (no priors, all free; with `bounds` "
        "or `hold`).",
        default="prior",
    )
    bounds: Bounds | str | Path | None = option(Given("FILE"), "Limits of parameter values.", default=None, shown=False)
    hold: Sequence[str] = option(
        Names("WHAT,...", "base, targets, fixtures, or names of these"),
        "What is known and not found: base, targets, fixtures, or names; `frames` says where.",
        default=(),
        more="The calibration is an absolute one then.",
    )
    frames: str | Path | None = as_in(
        OfCell,
        "frames",
        default=None,
        shown=False,
        more="Of the schema ``truearm-cell/1``: what is held stands there, targets as its tools, base and fixtures as "
        "its frames.",
    )
    bootstrap: int = option(
        Whole(low=20, counts=True, or_zero=True),
        "Deviations from N fits to configurations drawn anew.",
        default=0,
        shown="from the residuals",
    )
    effects: Sequence[str] = option(
        Names(known=_effects, what="effect", commas=False),
        "A joint effect to add to the model.",
        default=(),
        word="effect",
    )
    base_changes: Sequence[str] = option(
        Names("AT,...", repeated=False),
        "Configurations from which on the instrument or the robot's base stood elsewhere.",
        default=(),
        more="The motion is found along with the model (``geometric`` for ``auto``) from the training configurations, "
        "and taken out of the readings; no deviation contains what is not known of it.",
    )
    without: Sequence[str] = option(
        Names("LABEL,..."),
        "Configurations to leave out.",
        default=(),
        more="Neither part of the split knows them.",
    )
    monte_carlo: int | None = option(
        Whole(low=100, counts=True),
        "Simulate N calibrations for intervals beside the linear ones.",
        default=None,
        shown=False,
        more="With the linear loss and without bounds; seeded by `seed`.",
    )
    zones: int | str | Path | None = option(
        NumberOr("N|FILE"),
        "Try a model for each of N zones, or for those of a file.",
        default=None,
        shown=False,
        more="A model is kept if it is better on the held-out configurations there; it is written as "
        "``zone-NAME.yaml``, and ``zones.yaml`` says where they are.",
    )
    replace: bool = option(
        Flag(),
        "Replace a sound result in DIR even by one that is worse than nominal, or otherwise bad.",
        default=False,
        repeated=False,
    )

    def check(self) -> None:
        """Refuse what does not go together."""
        if self.effects and self.model == "auto":
            raise InputError(
                "the model auto has every joint effect",
                parameter="effects",
                came=self.effects[0],
                cure="Name another model.",
            )
        if self.monte_carlo is not None:
            self._check_simulated()
        for value, name in ((self.monte_carlo, "monte_carlo"), (self.zones, "zones")):
            if value is not None and self.hold:
                raise InputError(
                    "this is not made with places that are held",
                    parameter=name,
                    cure="Leave it out, or leave out `hold`.",
                )

    def _check_simulated(self) -> None:
        """Refuse fits that are no plain least squares."""
        if self.loss != "linear":
            raise InputError(
                "calibrations are simulated by least squares, and other losses are for noise that is not normal",
                parameter="monte_carlo",
                came=f"the loss {self.loss}",
                cure="Leave `loss` out, or leave `monte_carlo` out: the deviations then follow from the scatter of the "
                "configurations.",
            )
        if self.bounds is not None:
            raise InputError(
                "calibrations are simulated without bounds",
                parameter="monte_carlo",
                came=str(self.bounds) if isinstance(self.bounds, str | Path) else "bounds",
                cure="Leave `bounds` out, or leave `monte_carlo` out.",
            )
        if self.bootstrap:
            raise InputError(
                "simulated calibrations are compared with the deviations of the fit itself, not with those of a "
                "bootstrap",
                parameter="monte_carlo, bootstrap",
                cure="Leave one of them out.",
            )

    def model_for(self, robot: Robot, training: Dataset) -> tuple[str, str]:
        """Return the name of the model, and why it is this one; the latter is empty if it was named.

        Args:
            robot: The nominal one, with its loads.
            training: The training part.
        """
        from truearm.engine.fit.every_effect import AUTO, loads_bend
        from truearm.engine.robot.robot_file.seal import calibrated_soundly

        if self.model is not None:
            return self.model, ""
        because = {
            "effects are added to it": bool(self.effects),
            "zones are asked for": self.zones is not None,
            "calibrations are simulated": self.monte_carlo is not None,
            f"redundancy is {self.redundancy}": self.redundancy != "prior",
            "readings are lengths or of fixtures": training.fixture is not None or not training.has_position.any(),
        }
        for reason, is_so in because.items():
            if is_so:
                return "geometric", reason
        count = training.configurations
        if count < ENOUGH and calibrated_soundly(robot):
            return "offsets", f"the robot was calibrated before, and {count} configurations are few"
        if loads_bend(robot, training):
            return AUTO, "loads are known"
        if count >= ENOUGH:
            return AUTO, f"{count} configurations are enough"
        return "geometric", f"loads are not known, and {count} configurations are few"

    def run(self) -> Calibration:
        """Calibrate."""
        from truearm.calibration.calibrating import calibrated

        return calibrated(self)


calibrate = job(Calibrate)
