"""What is asked for of inclinometers: plans, simulated readings, and what these tell of the joints."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import (
    AmongCandidates,
    Clearing,
    Drawn,
    FromHome,
    IntoFolder,
    JointsWritten,
    Loaded,
    Long,
    Noted,
    OfRobot,
    OfTruth,
    OnFloor,
    Repeatable,
    Split,
)
from truearm.engine.command.kinds import Choice, File, Given, Kind, Number
from truearm.engine.command.request import Request, job, option, required

if TYPE_CHECKING:
    from truearm.engine.data.dataset import Dataset
    from truearm.engine.data.inclinations import Inclinations
    from truearm.inclinometers.pairs import InclinometerPlan, InclinometerSimulation
    from truearm.inclinometers.tilting import Tilting


class _Even(Kind):
    """How many configurations, in pairs."""

    metavar = "N"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what is no even number."""
        from truearm.engine.command.arguments import count_argument

        count = count_argument(value, name, 2)
        if count % 2:
            raise InputError(
                "inclinations are compared two by two",
                parameter=name,
                came=count,
                allowed="an even number",
                cure=f"Use `{name}={count + 1}`.",
            )
        return count

    def read(self, typed: Any, name: str) -> Any:
        """Return the number of a text."""
        try:
            return int(typed)
        except ValueError:
            raise InputError(
                "for inclinometers a number of configurations belongs here",
                parameter=name,
                came=typed,
                allowed="an even number",
            ) from None


class InPairs(Request):
    """In what pairs of configurations inclinometers are read."""

    poses: int = required(
        _Even(), "How many configurations for the inclinometers, an even number.", kw_only=True, word="poses"
    )
    pull: float = option(
        Number("N", low=0.0, high=1e4),
        "Of a string or weight on the flange under which inclinometers are read; 0: gravity alone.",
        default=20.0,
        more="It acts along or against an axis of the base. By gravity alone joints move within a pair, and there are "
        "no poses.",
    )


class PlanInclinometers(
    InPairs, OfRobot, AmongCandidates, Drawn, Loaded, JointsWritten, OnFloor, FromHome, Clearing, Repeatable, Long
):
    """Choose pairs of configurations in which two-axis inclinometers on all links tell most of the joints.

    Poses under sideways pulls are chosen beside, for joints whose axes stand upright. The robot has masses.
    """

    job = "plan_inclinometers"
    words = "plan"
    of_device = "inclinometers"
    out: str | Path | None = option(
        File("PLAN"),
        "CSV file to write, with its ways beside it.",
        default=None,
        needed=True,
        repeated=False,
        more="None writes nothing, see :meth:`InclinometerPlan.save`.",
    )

    def run(self) -> InclinometerPlan:
        """Plan."""
        from truearm.inclinometers.pairs import planned

        return planned(self)


class SimulateInclinometers(InPairs, OfTruth, OfRobot, Drawn, Loaded, Long):
    """Read two-axis inclinometers on all links of a digital twin, and its poses under sideways pulls.

    Configurations are those of :func:`truearm.plan_inclinometers` with ``candidates=1500`` and ``noise=1e-5``. Angles
    are rounded to 0.001 deg, poses have 0.01 mm of noise a coordinate.
    """

    job = "simulate_inclinometers"
    words = "simulate"
    of_device = "inclinometers"
    out: str | Path | None = option(
        File("DATA.csv"),
        "File of inclinations to write, and one that ends in -pushed for the poses beside it.",
        default=None,
        needed=True,
        repeated=False,
        more="None writes nothing.",
    )

    def run(self) -> InclinometerSimulation:
        """Simulate."""
        from truearm.inclinometers.pairs import simulated

        return simulated(self)


def _models() -> Collection[str]:
    from truearm.inclinometers.tilting import MODELS

    return MODELS


class FindTilting(OfRobot, Split, Loaded, Noted, IntoFolder, Repeatable, Long):
    """Find tilt, backlash and stiffness of the joints by inclinometers, then the geometry with these held.

    Writes calibrated.yaml, result.json, report.html and calibrated.urdf into a folder, and with poses geometry.html.
    Tilt, backlash and compliance are looked for anew, whatever the robot says of them; what the file of inclinations
    says of the load at single configurations comes on top of the payload.
    """

    job = "tilting"
    inclinations: Inclinations | str | Path = required(
        Given("INCLINATIONS.csv"), "What inclinometers on the links read.", kw_only=False
    )
    poses: Dataset | str | Path | None = option(
        Given("[POSES.csv]"),
        "Measurements in the canonical CSV, for the geometry.",
        default=None,
        shown=False,
        more="None ends after the first stage.",
        kw_only=False,
        is_argument=True,
    )
    pushed: Dataset | str | Path | None = option(
        Given("PUSHED.csv"),
        "Measurements in pairs of configurations under two forces, for joints whose axes stand upright.",
        default=None,
        shown=False,
        more="Joint positions are the same within a pair. They are not used for the geometry.",
    )
    model: str = option(
        Choice("MODEL", _models), "What the poses tell: offsets, joints or geometric.", default="geometric"
    )

    def check(self) -> None:
        """Refuse a split of poses that are not there."""
        if self.poses is None and self.train is not None:
            raise InputError("there are no poses to split", parameter="train", cure="Give `poses`, or leave it out.")

    def run(self) -> Tilting:
        """Find it."""
        from truearm.inclinometers.tilting import tilting_identified

        return tilting_identified(self)


plan_inclinometers = job(PlanInclinometers)
simulate_inclinometers = job(SimulateInclinometers)
tilting = job(FindTilting)
