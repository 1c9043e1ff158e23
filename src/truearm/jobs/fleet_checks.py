"""What a fleet of measured robots asks for, tried before anything is computed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final, NoReturn

from truearm.errors import InputError, Words, with_parameters
from truearm.fleets.entries import RobotEntry
from truearm.fleets.manifest import Manifest
from truearm.fleets.options import OPTIONS
from truearm.fleets.recorded import ROBOTS
from truearm.jobs.arguments import folder_for, robot_argument, whole_argument
from truearm.jobs.calibrate import ACCEPTED, calibrate
from truearm.results.calibration import RESULT_FILES

#: Robots with the same options of which these are tried.
_MOST_TRIED: Final = 50
#: No result of the options depends on it before the fit.
_OF_THE_SPLIT: Final = "seed"


class _AcceptedError(Exception):
    """A calibration has taken everything that it was given."""


def check_options(asked: Manifest) -> None:
    """Refuse options that no robot can be calibrated with, by the checks of the calibration itself.

    Robots with the same options are tried one after the other until one can be calibrated: data of a single robot may
    be wrong, and that is its own failure.

    Raises:
        InputError: Naming where the option stands, or the robot that is not known.
    """
    groups: dict[str, list[RobotEntry]] = {}
    for robot in asked.robots:
        if not Path(robot.robot).suffix:
            with _refusals_at(robot.places["robot"]):
                robot_argument(robot.robot)
        if _OF_THE_SPLIT in robot.options:
            with _refusals_at(robot.places[_OF_THE_SPLIT]):
                whole_argument(robot.options[_OF_THE_SPLIT], _OF_THE_SPLIT)
        own = {name: value for name, value in robot.options.items() if name != _OF_THE_SPLIT}
        groups.setdefault(json.dumps(own, sort_keys=True, default=str), []).append(robot)
    for robots in groups.values():
        _try(robots[:_MOST_TRIED])


def _try(robots: list[RobotEntry]) -> None:
    refused: InputError | None = None
    for robot in robots:
        try:
            calibrate(robot.robot, robot.data, **robot.options, progress=_stop)
        except _AcceptedError:
            return
        except InputError as error:
            if refused is None and (place := _place_of(error, robot)) is not None:
                refused = _in_the_manifest(error, place)
        except (ArithmeticError, ValueError, LookupError):  # of this robot: its row will say so
            continue
    if refused is not None:
        raise refused


@contextmanager
def _refusals_at(place: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise _in_the_manifest(error, place) from error


def _in_the_manifest(error: InputError, place: str) -> InputError:
    """Return a refusal of an option as the manifest spells options."""

    def spelled(name: str, value: str | None) -> str:
        return f"'{name}'" if value is None else f"'{name}: {value}'"

    came = error.came
    return InputError(
        with_parameters(error.what, spelled),
        where=place,
        came=Words(with_parameters(came, spelled)) if isinstance(came, str) and "`" in came else came,
        allowed=None if error.allowed is None else with_parameters(error.allowed, spelled),
        cure=None if error.cure is None else with_parameters(error.cure, spelled),
    )


def _stop(words: str) -> None:
    if words == ACCEPTED:
        raise _AcceptedError


def _place_of(error: InputError, robot: RobotEntry) -> str | None:
    """Return where the option stands that is refused; None where nothing but the robot's files is wrong."""
    named = [name for name in (error.parameter or "").split(", ") if name in OPTIONS]
    return next((robot.places[name] for name in named if name in robot.places), None)


def check_folders(asked: Manifest, folder: Path) -> None:
    """Refuse folders of robots that hold what is not truearm's, and files in them that this fleet reads.

    Raises:
        InputError: Naming the file.
    """
    within = folder / ROBOTS
    for robot in asked.robots:
        own = within / robot.name
        if own.is_symlink():
            raise InputError(
                "this is a link, and the folder itself belongs here",
                parameter="out",
                where=str(own),
                cure="Remove the link, or choose another `out`.",
            )
        if own.exists():
            folder_for(RESULT_FILES, own, ours=True)
    place = within.resolve()
    for path in asked.inputs:
        if path.resolve().is_relative_to(place):
            _refuse_own(path)


def _refuse_own(path: Path) -> NoReturn:
    raise InputError(
        "this file is read, and stands where the fleet writes",
        parameter="out",
        where=str(path),
        cure="Choose another `out`, or copy the file.",
    )
