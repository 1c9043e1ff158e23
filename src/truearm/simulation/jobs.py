"""What is asked of a simulated robot: measurements of it, by which instruments, and what each parameter does."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import (
    AlsoIntoFolder,
    AtTarget,
    Drawn,
    ForcedAt,
    Instrument,
    IntoFile,
    Loaded,
    Long,
    Measured,
    OfModel,
    OfRobot,
    OfTruth,
    Repeatable,
    SeenBy,
    Split,
)
from truearm.engine.command.kinds import Choice, CountOr, Number, Whole
from truearm.engine.command.request import Request, as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.simulation.influence import Frames, InfluenceResult
    from truearm.simulation.influences import Combination
    from truearm.simulation.simulate import DeviceList, Simulation


class Simulate(OfTruth, OfRobot, SeenBy, Drawn, Loaded, ForcedAt, IntoFile, Long):
    """Measure a digital twin whose truth is known, with a simulated instrument.

    Configurations are measured in their order: what depends on the way the arm came, or on how long it has been moving,
    follows from it. Where the table of a plan says where to stop right before each (approach_i), the joints come from
    there. The data then count these stops in their order, so that no configuration follows another. They also say what
    acted on the flange (force_x to moment_z). The file is a canonical CSV. Inclinometers are a device of the command
    alone; in Python there is truearm.simulate_inclinometers.
    """

    job = "simulate"
    poses: int | Dataset | str | Path = required(
        CountOr("N|FILE.csv"),
        "Configurations, drawn evenly within the limits; or those of a file.",
        kw_only=True,
        word="poses",
        more="Such as :func:`truearm.poses` or :func:`truearm.plan` writes.",
    )
    noise: float | None = as_in(Instrument, "noise", default=None, shown="the deviation of the device")

    def check(self) -> None:
        """Refuse readings without noise, and a device for given configurations."""
        if self.noise is None and self.device is None:
            raise InputError("no noise is given", parameter="noise", cure="Give `noise`, or a `device`.")
        if self.device is not None and not isinstance(self.poses, int):
            raise InputError(
                "a device finds its own configurations",
                parameter="poses, device",
                came=f"{self.device} and {getattr(self.poses, 'source', self.poses)}",
                cure="Give a number of `poses`, or leave `device` out and give the `noise`.",
            )

    def run(self) -> Simulation:
        """Simulate."""
        from truearm.simulation.simulate import simulated

        return simulated(self)


class ListDevices(Request):
    """List the instruments that can be simulated and planned for, with what each is good for."""

    job = "devices"

    def run(self) -> DeviceList:
        """List them."""
        from truearm.engine.twin.devices import DEVICES
        from truearm.simulation.simulate import DeviceList

        return DeviceList(DEVICES)


class FindInfluence(OfRobot, OfModel, Split, Loaded, AlsoIntoFolder, Repeatable, Long):
    """Change one parameter after the other and see what the tip does; with `data`, identify by that.

    With readings the configurations are theirs, and the parameters are identified pose by pose by minimum norm and by
    influence (Patel, sections 3.6 and 3.7), from all poses at once, and as 'truearm calibrate' does it. With `out` it
    writes influence.csv, result.json and report.html.
    """

    job = "influence"
    data: Dataset | str | Path | None = as_in(Measured, "data", default=None, kw_only=False, metavar="[DATA.csv]")
    target: str | None = as_in(
        AtTarget, "target", default=None, shown="the first of the data or the robot, or the flange"
    )
    angle: float = option(
        Number("deg", low=0.0, high=10.0, above=True),
        "By how much angles are changed.",
        default=math.radians(0.05),
        more="What is neither an angle nor a length is changed by its prior.",
    )
    length: float = option(
        Number("mm", low=0.0, high=100.0, above=True), "By how much lengths are changed.", default=1e-4
    )
    poses: int | None = option(
        Whole(low=1, counts=True),
        "Random configurations, without `data`.",
        default=None,
        shown="118",
        more="Drawn evenly within the limits.",
    )
    placement: Frames = option(
        Choice(known=("placed", "robot")),
        "Where base and targets are: fitted with the nominal robot, or as its file says.",
        default="placed",
        formerly="frames",
        more="Where they were fitted they are held, except that the whole calibration finds them anew.",
    )
    combination: Combination = option(
        Choice("HOW", ("mean", "scaled-mean", "best-pose")),
        "One set out of those of all poses: mean, scaled-mean or best-pose.",
        default="mean",
        word="combine",
    )

    def check(self) -> None:
        """Refuse what says nothing with readings, or nothing without them."""
        if self.data is not None and self.poses is not None:
            raise InputError(
                "the configurations are those of the readings",
                parameter="poses",
                came=self.poses,
                cure="Leave `poses` out.",
            )
        if self.data is None and self.train is not None:
            raise InputError("there are no readings to split", parameter="train", cure="Give `data`, or leave it out.")

    def run(self) -> InfluenceResult:
        """Find it."""
        from truearm.simulation.influence import analysed

        return analysed(self)


simulate = job(Simulate)
devices = job(ListDevices)
influence = job(FindInfluence)
