"""What a result was made of and with, as it says itself, and which settings differ from that now."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from truearm.engine.base.errors import InputError, counted
from truearm.engine.command.split import train_count
from truearm.engine.robot.robot import Robot
from truearm.studio.settings import Settings

#: How the history of a result says what :func:`truearm.calibrate` was asked for.
_HISTORY: Final = re.compile(
    r"model ([^,]+), (\d+) of (\d+) configurations of (.*?) \((?:sha256|readings) [^)]*\), seed (\d+), loss ([^,]+),"
)
#: Numbers that a file holds in other units come back within this share.
_SAME: Final = 1e-12


@dataclass(frozen=True)
class MadeWith:
    """What a result was made of and with."""

    robot: Robot | None  #: The calibrated one; None if it is not there.
    model: str  #: By its name, with joint effects that were added.
    by_default: bool  #: Whether no model was named.
    #: Name of the file of measurements; None if the history of the result is written otherwise, and so for the rest.
    data: str | None
    train: int  #: train, configurations: how many it was trained on, of how many.
    configurations: int
    seed: int  #: seed, loss: as for :func:`truearm.calibrate`.
    loss: str
    excluded: int  #: How many readings were excluded.

    def line(self) -> str:
        """Return all of it in one line."""
        told = [] if self.robot is None else [self.robot.name]
        if self.data is not None:
            of = counted(self.configurations, "configuration")
            told.append(f"{self.data} (trained on {self.train} of {of}, seed {self.seed})")
        told.append(f"model {self.model}")
        told += [] if self.data is None else [f"loss {self.loss}"]
        told += [] if self.robot is None else [f"payload {_payload(self.robot)}"]
        told.append(f"{counted(self.excluded, 'reading')} excluded" if self.excluded else "no reading excluded")
        return ", ".join(told)

    def differing(self, settings: Settings, robot: Robot) -> dict[str, tuple[str, str]]:
        """Return what differs from what is chosen now: by its name, what it was and what it is.

        Args:
            robot: The one that is chosen, with the payload of the settings.
        """
        found: dict[str, tuple[object, object]] = {}
        if settings.model is not None or not self.by_default:
            found["model"] = (self.model, settings.model or "by default")
        if self.data is not None:
            found["training part"] = (self.train, self._trained(settings.train))
            found["seed"] = (self.seed, settings.seed)
            found["loss"] = (self.loss, settings.loss)
        if self.robot is not None and not _near(
            [self.robot.payload.mass, *self.robot.payload.cog], [robot.payload.mass, *robot.payload.cog]
        ):
            found["payload"] = (_payload(self.robot), _payload(robot))
        if self.robot is not None and not _near(self.robot.gravity, robot.gravity):
            found["gravity"] = (_gravity(self.robot), _gravity(robot))
        return {name: (str(then), str(now)) for name, (then, now) in found.items() if then != now}

    def _trained(self, train: object) -> int | str:
        """Return how many configurations the settings would train on; what they say if these are not so many."""
        try:
            return train_count(train, self.configurations, "")
        except InputError:
            return str(train)


def made_with(result: dict[str, Any], robot: Robot | None) -> MadeWith:
    """Return what a result was made of and with.

    Args:
        result: The file result.json.
        robot: The calibrated one of the same folder.
    """
    excluded = sum(int(one["readings"]) for one in result.get("excluded", ()))
    by_default = "because" in result["model"]
    match = _HISTORY.search(str(result.get("history", "")))
    if match is None:
        return MadeWith(robot, str(result["model"]["name"]), by_default, None, 0, 0, 0, "", excluded)
    model, train, of, data, seed, loss = match.groups()
    return MadeWith(robot, model, by_default, data, int(train), int(of), int(seed), loss, excluded)


def _payload(robot: Robot) -> str:
    return robot.payload.text if robot.payload.mass else "none"


def _gravity(robot: Robot) -> str:
    return ",".join(f"{part:g}" for part in robot.gravity)


def _near(one: Any, other: Any) -> bool:
    return bool(np.allclose(one, other, rtol=_SAME, atol=_SAME))
