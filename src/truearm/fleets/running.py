"""Many robots: those of a series that were measured, or a whole series simulated."""

from __future__ import annotations

import json
import os
import pickle
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from truearm.calibration.calibrate import calibrate
from truearm.engine.base.errors import InputError, Words, counted, kind_of, refusals_of, with_parameters
from truearm.engine.base.files import noted_reads, path_argument
from truearm.engine.base.parts import Cluster, done_parts
from truearm.engine.base.version import __version__
from truearm.engine.base.workers import Given, ThisProcess, Workers, processes, with_workers
from truearm.engine.command.arguments import folder_for, robot_argument
from truearm.fleets.entries import OPTIONS, RobotEntry
from truearm.fleets.manifest import Manifest, experiment, read_manifest
from truearm.fleets.parts import Finished, Task, finished
from truearm.fleets.recorded import RECORD, ROBOTS, Known, Recorded, refuse_link
from truearm.fleets.result import FLEET_FILES, Fleet, Run

if TYPE_CHECKING:
    from truearm.fleets.fleet import CalibrateFleet

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
                OPTIONS[_OF_THE_SPLIT].kind.check(robot.options[_OF_THE_SPLIT], _OF_THE_SPLIT)
        own = {name: value for name, value in robot.options.items() if name != _OF_THE_SPLIT}
        groups.setdefault(json.dumps(own, sort_keys=True, default=str), []).append(robot)
    for robots in groups.values():
        _try(robots[:_MOST_TRIED])


def _try(robots: list[RobotEntry]) -> None:
    from truearm.calibration.calibrating import ACCEPTED  # with all that a calibration needs, only for measured robots

    def stop(words: str) -> None:
        if words == ACCEPTED:
            raise _AcceptedError

    refused: InputError | None = None
    for robot in robots:
        try:
            calibrate(robot.robot, robot.data, **robot.options, progress=stop)
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

    value = error.came
    return InputError(
        with_parameters(error.what, spelled),
        where=place,
        came=Words(with_parameters(value, spelled)) if isinstance(value, str) and "`" in value else value,
        allowed=None if error.allowed is None else with_parameters(error.allowed, spelled),
        cure=None if error.cure is None else with_parameters(error.cure, spelled),
    )


def _place_of(error: InputError, robot: RobotEntry) -> str | None:
    """Return where the option stands that is refused; None where nothing but the robot's files is wrong."""
    named = [name for name in (error.parameter or "").split(", ") if name in OPTIONS]
    return next((robot.places[name] for name in named if name in robot.places), None)


def check_folders(asked: Manifest, folder: Path) -> None:
    """Refuse folders of robots that hold what is not truearm's, and files in them that this fleet reads.

    Raises:
        InputError: Naming the file.
    """
    from truearm.calibration.result import RESULT_FILES

    within = folder / ROBOTS
    for robot in asked.robots:
        own = within / robot.name
        refuse_link(own)
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


def calibrated_fleet(asked: CalibrateFleet) -> Fleet:
    """Do the parts that are missing, and judge all."""
    path = path_argument(asked.manifest, "manifest")
    folder = folder_for((RECORD, *FLEET_FILES), asked.out, path)
    with refusals_of("manifest"):
        manifest = read_manifest(path)
    folder_for(FLEET_FILES, asked.out, *manifest.inputs, ours=True)
    with refusals_of("manifest"):
        make = _tasks(manifest, folder.absolute())
    recorded = Recorded(folder, manifest)
    missing = recorded.missing()
    if manifest.experiment is None and missing:
        check_folders(manifest, folder)
        asked.progress("checking the options")
        with refusals_of("manifest"):
            check_options(manifest)
    chosen = _workers(asked, missing) if missing else ThisProcess()
    try:
        with with_workers(chosen), recorded.alone() as known:
            run = _computed(recorded, known, make, chosen, asked.progress)
            asked.progress("reading the parts")
            fleet = Fleet(recorded, run, asked.again)
            fleet.write()
    except KeyboardInterrupt as stop:
        on_disk = len(recorded.on_disk())
        words = f"{on_disk} of {counted(manifest.parts, 'part')} {'are' if manifest.parts > 1 else 'is'} on disk"
        raise KeyboardInterrupt(f"Stopped: {words}; run it again to go on.") from stop
    return fleet


def _workers(asked: CalibrateFleet, parts: int) -> Workers:
    if asked.executor is not None:
        return Given(asked.executor)
    if asked.scheduler is not None:
        return Cluster(asked.scheduler, insecure=asked.insecure)
    return processes(min(asked.workers or os.cpu_count() or 1, parts))


def _tasks(asked: Manifest, folder: Path) -> Callable[[int], Task]:
    """Return what makes the task of a part."""
    if asked.experiment is None:
        robots = asked.robots
        return lambda part: Task(part, __version__, robots=tuple(robots[n] for n in asked.numbers(part)), folder=folder)
    with noted_reads() as noted:
        pickled = pickle.dumps(experiment(asked.experiment, f"{asked.file}, experiment"))
    for name, known in asked.hashes.items():
        if {*noted.get((asked.file.parent / name).absolute(), ())} - {known}:
            raise InputError("this file changed while it was read", where=name, cure="Run this again.")
    return lambda part: Task(part, __version__, pickled, tuple(asked.numbers(part)))


def _computed(
    recorded: Recorded, known: Known, make: Callable[[int], Task], workers: Workers, progress: Callable[[str], None]
) -> Run:
    """Let workers do what is missing, and write each part as it comes."""
    asked, before = recorded.manifest, len(known.finished)
    tasks = (make(part) for part in range(asked.parts) if part not in known.finished)
    messages, lost = [*known.again], list[int]()
    completed, failed, began = before, 0, time.perf_counter()

    def tell(words: str) -> None:
        messages.append(words)
        progress(words)

    progress(f"part {completed} of {asked.parts}")
    for outcome in done_parts(finished, tasks, workers, tell):
        completed += 1
        if outcome.lost:
            lost.append(outcome.part.part)
            continue
        failed += _written(recorded, outcome.part.part, outcome.result, workers)
        left = (time.perf_counter() - began) / (completed - before) * (asked.parts - completed)
        words = f", {counted(failed, 'robot')} failed" if failed else ""
        progress(f"part {completed} of {asked.parts}{words}, about {left:.0f} s left")
    names = [name for part in sorted(lost) for name in asked.names(part)]
    return Run(asked.parts, before, tuple(messages), tuple(names))


def _written(recorded: Recorded, part: int, result: object, workers: Workers) -> int:
    """Write what came back of a part, and return how many of its robots failed; what belongs to no part is refused."""
    try:
        if not (isinstance(result, Finished) and isinstance(result.text, str) and type(result.failed) is int):
            raise TypeError(f"an object of type {kind_of(result)} came back")
        recorded.write(part, result.text)
    except InputError:
        raise
    except (TypeError, ValueError) as error:
        if not isinstance(workers, Given):
            raise
        raise InputError(
            "the executor has returned something else than what was found of the robots that it was given",
            parameter="executor",
            where=f"part {part + 1}",
            came=Words(str(error) if isinstance(error, TypeError) else "a result of another part, or a changed one"),
            cure="Give one whose futures hold what the function returned. Run this again with it: what is on disk is "
            "not computed twice.",
        ) from error
    return result.failed
