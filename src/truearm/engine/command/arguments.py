"""What jobs accept, and how they refuse the rest: every refusal names the parameter."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeGuard, TypeVar

import numpy as np

from truearm.engine.base.arrays import finite_number, number_array
from truearm.engine.base.errors import InputError, did_you_mean, listed, name_parameter, refusals_of, wrong_kind
from truearm.engine.base.files import exists, path_argument, read_bytes
from truearm.engine.base.limits import limit, refuse_beyond
from truearm.engine.base.manifest import hash_of, sets_in
from truearm.engine.base.units import accepted_range, sized_si
from truearm.engine.base.writing import new_file, output_file, output_folder
from truearm.engine.data.controller_joints import in_model_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.canonical import read_csv
from truearm.engine.data.readers.configurations import read_configurations, read_stops
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.library import is_robot, load_robot, urdf_source
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import WRENCH_FRAMES, Wrench

if TYPE_CHECKING:
    from truearm.engine.twin.devices.device import Device


T = TypeVar("T")

#: Where a force acts that acts on no target.
FLANGE: Final = "flange"
_CANONICAL: Final = "a canonical CSV file"
#: Whose joint positions can be asked for.
JOINTS_OF: Final[dict[str, JointsOf]] = {"controller": "controller", "model": "model"}


def robot_argument(robot: object, parameter: str = "robot") -> Robot:
    """Return the robot that was given, or that a library id, robot file or URDF names."""
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | Path):
        try:
            return load_robot(robot)
        except InputError as error:  # the library calls whatever it is given the robot
            name_parameter(error, parameter)
            raise
    raise wrong_kind("a robot belongs here", robot, parameter, "a Robot, a library id, a robot file or a URDF")


def refuse_swapped(robot: object, data: object, job: str) -> None:
    """Refuse a robot where measurements belong, and measurements in its place.

    Args:
        job: Named with both in their order.
    """
    if not (isinstance(robot, str | Path) and isinstance(data, str | Path)):
        return
    if is_robot(data) and not is_robot(robot):
        raise InputError(
            "robot and measurements are exchanged",
            parameter="robot",
            came=str(robot),
            allowed="a library id, a robot file or a URDF",
            cure=f"Write 'truearm {job} {data} {robot}'.",
        )


def data_argument(
    data: object, parameter: str = "data", read: Callable[[Path], Dataset] = read_csv, allowed: str = _CANONICAL
) -> Dataset:
    """Return the dataset that was given, or that a file holds: a canonical CSV, or what `read` reads."""
    if isinstance(data, Dataset):
        return data
    if isinstance(data, str | Path):
        path = path_argument(data, parameter)
        if is_robot(data):
            raise InputError(
                "this is a robot, and measurements belong here",
                parameter=parameter,
                came=str(data),
                allowed=allowed,
                cure="Exchange robot and measurements, or name the file of measurements.",
            )
        with refusals_of(parameter):
            return read(path)
    raise wrong_kind("measurements belong here", data, parameter, f"a Dataset, or {allowed}")


def readings_argument(robot: Robot, data: object, parameter: str = "data") -> Dataset:
    """Return measurements of a robot, at the joint positions of its model, whatever those are that came."""
    measured = data_argument(data, parameter)
    with refusals_of(parameter):
        return in_model_joints(robot, measured)


def configurations_argument(robot: Robot, data: object, parameter: str) -> Dataset:
    """Return where an arm stands, by its model: with measurements, or without them as the table of a plan has it."""
    dataset = data_argument(data, parameter, read_configurations, f"{_CANONICAL}, or that of a plan")
    with refusals_of(parameter):
        return in_model_joints(robot, dataset)


def stops_argument(robot: Robot, data: object, parameter: str) -> Dataset | None:
    """Return where an arm stops right before each configuration, by its model; None where what is given has none."""
    if not isinstance(data, str | Path):
        return None
    with refusals_of(parameter):
        dataset = read_stops(path_argument(data, parameter))
        return None if dataset is None else in_model_joints(robot, dataset)


def joints_argument(joints: object, robot: Robot, parameter: str = "joints") -> JointsOf:
    """Return whose joint positions a file shall hold: for None the controller's, where they differ from the model's."""
    if joints is None:
        return "controller" if robot.controller.counts_otherwise else "model"
    chosen = choice_argument(joints, parameter, JOINTS_OF)
    if chosen == "controller":
        with refusals_of(parameter):
            robot.controller.check_counts(robot.name)
    return chosen


def folder_for(names: Iterable[str], out: object, *read: object, parameter: str = "out", ours: bool = False) -> Path:
    """Return the folder for files of some names, or refuse one that cannot be written to, before any long work.

    Args:
        read: What the job was given: none of these, as far as they are files, may be overwritten.
        ours: Whether only files may be overwritten that truearm has written there and nobody has changed since.
    """
    return output_folder(out, names, files_of(*read), parameter, ours=ours)


def folder_beside(names: Iterable[str], mark: str, out: object, *read: object) -> Path:
    """Return the folder for files as :func:`folder_for` does, but refuse the folder of another kind of result.

    Args:
        mark: The file by which a result of this kind is known.
    """
    wanted = tuple(names)
    folder = folder_for(wanted, out, *read, ours=True)
    for file_set in sets_in(folder):
        if mark not in file_set.files and any(name in file_set.files for name in wanted):
            raise InputError(
                f"{listed([name for name in wanted if name in file_set.files])} there belong to another result",
                parameter="out",
                where=str(folder),
                came=f"the folder of {next(iter(file_set.files))}",
                cure="Choose another folder.",
            )
    return folder


def file_for(out: object, *read: object, parameter: str = "out", ours: bool = False) -> Path:
    """Return where a file shall be written, or refuse a place that cannot be; the rest as for :func:`folder_for`."""
    return output_file(out, files_of(*read), parameter, ours=ours)


def new_file_for(out: object, parameter: str = "out") -> Path:
    """Return where a file shall be written that does not exist yet, or refuse a place that cannot be."""
    with refusals_of(parameter):
        return new_file(path_argument(out, parameter))


def files_of(*values: object) -> tuple[Path, ...]:
    """Return which files a job was given."""
    named = [value for value in values if isinstance(value, str | Path)]
    return tuple((urdf_source(value) or (Path(value), None))[0].absolute() for value in named)


def hashes_of(**arguments: object) -> dict[str, str]:
    """Return the SHA-256 of each file that was given, by its parameter.

    They are taken before the files are read: of one that changes meanwhile, the hash is not that of the file later.
    """
    hashes = {}
    for parameter, value in arguments.items():
        with refusals_of(parameter):
            for path in files_of(value):
                if exists(path) and path.is_file():
                    hashes[parameter] = hash_of(read_bytes(path))
    return hashes


def files_argument(files: object, parameter: str) -> dict[str, Path]:
    """Return the files that were given by name."""
    if not isinstance(files, Mapping):
        raise wrong_kind("files by name belong here", files, parameter, "a dict of names and paths")
    for name in files:
        if not isinstance(name, str):
            raise wrong_kind("a name belongs here", name, parameter, "a text")
    return {name: path_argument(path, parameter) for name, path in files.items()}


def payload_argument(payload: object, parameter: str = "payload") -> Payload | None:
    """Return the payload that was given, or that a text such as ``2.7kg,50mm,25mm,100mm`` names; None for None."""
    return None if payload is None else Payload.of(payload, parameter)


def wrench_argument(wrench: object, frame: object, parameter: str = "wrench") -> Wrench | None:
    """Return what acts on the tool, of an object, a text or six numbers, in the axes of a frame; None for None."""
    option = f"{parameter}_frame"
    if wrench is None:
        if frame is not None:
            raise InputError(
                "a frame says in whose axes a force is, and no force is given",
                parameter=option,
                came=frame,
                cure=f"Give `{parameter}`, or leave it out.",
            )
        return None
    axes_of = "base" if frame is None else choice_argument(frame, option, {name: name for name in WRENCH_FRAMES})
    if not isinstance(wrench, Wrench):
        return Wrench.of(wrench, axes_of, parameter)
    if frame is not None and axes_of != wrench.frame:
        raise InputError("the wrench says its own frame", parameter=option, came=frame, allowed=wrench.frame)
    return wrench


def pushed_argument(robot: Robot, wrench: Wrench | None, tool: Transform | str | None = None) -> Robot:
    """Return a robot with what acts on its tool, or refuse what it is not rated for."""
    return robot if wrench is None else robot.with_wrench(wrench, tool)


def pushed_at_argument(robot: Robot, wrench: Wrench | None, at: object) -> Robot:
    """Return a robot with what acts on one of its targets, or on its flange, by name.

    Raises:
        InputError: If there is no such target, or several and none is named.
    """
    names = [target.name for target in robot.targets]
    if wrench is None:
        if at is not None:
            raise InputError(
                "no force is given", parameter="wrench_at", came=at, cure="Give `wrench`, or leave it out."
            )
        return robot
    if at is None and len(names) > 1:
        raise InputError(
            "there are several targets, and a force acts on one point",
            parameter="wrench_at",
            where=robot.name,
            allowed=", ".join([*names, FLANGE]),
            cure="Name the target that is the tool's point, or the flange.",
        )
    if at is None:
        place = names[0] if names else None
    else:
        known: dict[str, str | None] = {**{name: name for name in names}, FLANGE: None}
        place = choice_argument(at, "wrench_at", known, "target")
    return robot.with_wrench(wrench, robot.tool_place(place))


def gravity_argument(gravity: object, parameter: str = "gravity") -> tuple[float, float, float] | None:
    """Return the acceleration of free fall that was given [m/s^2]; None for None."""
    if gravity is None:
        return None
    values = numbers_argument(gravity, parameter, 3, "0,0,-9.81 for a robot that stands, in m/s^2")
    return values[0], values[1], values[2]


def numbers_argument(values: object, parameter: str, count: int, allowed: str) -> tuple[float, ...]:
    """Return `count` finite numbers."""
    if isinstance(values, Real) and not isinstance(values, bool) and count != 1:
        raise InputError(f"{count} numbers belong here", parameter=parameter, came=1, allowed=allowed)
    if not _is_sequence(values):
        raise wrong_kind(f"{count} numbers belong here", values, parameter, allowed)
    numbers = [*values]
    if len(numbers) != count:
        raise InputError(f"{count} numbers belong here", parameter=parameter, came=len(numbers), allowed=allowed)
    return tuple(finite_number(value, parameter) for value in numbers)


def _is_sequence(values: object) -> TypeGuard[Sequence[object]]:
    """Return whether these are values in an order: a list, a tuple, an array of one axis."""
    if isinstance(values, Sequence):
        return not isinstance(values, str | bytes | bytearray | memoryview)
    return getattr(values, "ndim", 0) == 1 and isinstance(values, Iterable)


def whole_argument(value: object, parameter: str, lowest: int = 0, highest: int | None = None) -> int:
    """Return a whole number within limits."""
    span = f"{lowest} or more" if highest is None else f"{lowest} to {highest}"
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise wrong_kind("a whole number belongs here", value, parameter, span)
    number = int(value)
    if number < lowest or (highest is not None and number > highest):
        raise InputError("the number is out of range", parameter=parameter, came=number, allowed=span)
    return number


def count_argument(value: object, parameter: str, lowest: int = 1) -> int:
    """Return how many of something there shall be, no more than the limit of the parameter's name allows."""
    most = limit(parameter)
    if isinstance(value, Integral) and int(value) > most:
        refuse_beyond(parameter, int(value), parameter=parameter)
    return whole_argument(value, parameter, lowest, most)


def length_argument(value: object, parameter: str, lowest: float = -math.inf) -> float:
    """Return a length that can be meant [m], `lowest` or more."""
    length = finite_number(value, parameter, allowed="a length")
    least, most = accepted_range("m")
    if not max(least, lowest) <= length <= most:
        span = "up to" if lowest == -math.inf else f"{lowest * 1e3:g} mm to"
        raise InputError(
            "the length is out of range",
            parameter=parameter,
            came=f"{length * 1e3:g} mm",
            allowed=f"{span} {most * 1e3:g} mm",
        )
    return length


def deviation_argument(value: object, parameter: str) -> float:
    """Return a standard deviation of lengths that can be meant [m]."""
    return sized_si(finite_number(value, parameter), "m", parameter=parameter, deviation=True)


def lengths_argument(
    values: object, parameter: str, count: int, lowest: float = -math.inf, *, one_for_all: bool = False
) -> tuple[float, ...]:
    """Return `count` lengths [m], each `lowest` or more.

    Args:
        one_for_all: Whether a single number may stand for all of them.
    """
    if one_for_all and isinstance(values, Real):
        return (length_argument(values, parameter, lowest),) * count
    numbers = numbers_argument(values, parameter, count, f"{count} lengths{', or one for all' if one_for_all else ''}")
    return tuple(length_argument(value, parameter, lowest) for value in numbers)


def array_argument(values: object, parameter: str, shape: tuple[int | str, ...], allowed: str) -> Array:
    """Return an array of finite numbers, not an empty one; `shape` as for ``number_array``."""
    array = number_array(values, parameter, shape, allowed=allowed)
    if not array.size:
        raise InputError("the array is empty", parameter=parameter, allowed=allowed)
    return array


def flag_argument(value: object, parameter: str) -> bool:
    """Return True or False."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise wrong_kind("yes or no belongs here", value, parameter, "True, False")


def name_argument(value: object, parameter: str) -> str:
    """Return a name."""
    return _text(value, parameter, "a name")


def command_argument(command: object) -> str | None:
    """Return how the caller would run a job again; None if it was not said."""
    if isinstance(command, str) and not command:
        raise InputError("the command is empty", parameter="command", came=command)
    return None if command is None else _text(command, "command", "how to run it again")


def _text(value: object, parameter: str, what: str) -> str:
    if isinstance(value, str):
        return value
    raise wrong_kind(f"{what} belongs here", value, parameter, "a text")


def executor_argument(executor: object) -> Executor | None:
    """Return who does parts of work; None for None."""
    if executor is None or isinstance(executor, Executor):
        return executor
    raise wrong_kind("an executor belongs here", executor, "executor", "a concurrent.futures.Executor")


def choice_argument(value: object, parameter: str, known: Mapping[str, T], what: str | None = None) -> T:
    """Return what a name stands for, of those that are known.

    Args:
        what: What it is the name of, for the message; the parameter if None.
    """
    if not isinstance(value, str):
        raise wrong_kind("a name belongs here", value, parameter, ", ".join(known))
    if value in known:
        return known[value]
    if not known:
        raise InputError(f"there is no {what or parameter}", parameter=parameter, came=value)
    raise InputError(
        f"there is no {what or parameter} of this name",
        parameter=parameter,
        came=value,
        allowed=", ".join(known),
        cure=did_you_mean(value, known),
    )


def choices_argument(values: object, parameter: str, known: Collection[str], what: str) -> tuple[str, ...]:
    """Return names of those that are known, each once."""
    if not _is_sequence(values):
        raise wrong_kind("a sequence of names belongs here", values, parameter, ", ".join(known))
    named = [choice_argument(value, parameter, {name: name for name in known}, what) for value in values]
    return tuple(dict.fromkeys(named))


def names_argument(values: object, parameter: str, allowed: str = "names of configurations") -> tuple[str, ...]:
    """Return names that only the data know, each once; numbers are names too."""
    if not _is_sequence(values):
        raise wrong_kind("a sequence of names belongs here", values, parameter, allowed)
    for value in values:
        if isinstance(value, bool) or not isinstance(value, str | Integral):
            raise wrong_kind("a name belongs here", value, parameter, allowed)
    return tuple(dict.fromkeys(str(value) for value in values))


#: Characters that a note may have, its name and what it says, and how many notes there may be.
_NOTE: Final = (40, 200)
_MOST_NOTES: Final = 20


def notes_argument(notes: object, parameter: str = "notes") -> dict[str, str]:
    """Return what a person notes about a measurement, by its name, in the order given; None is nothing."""
    if notes is None:
        return {}
    if not isinstance(notes, Mapping):
        raise wrong_kind("notes by name belong here", notes, parameter, "a dict of names and texts")
    if len(notes) > _MOST_NOTES:
        raise InputError("there are too many notes", parameter=parameter, came=len(notes), allowed=f"{_MOST_NOTES}")
    checked = {}
    for name, note in notes.items():
        for text, most in zip((name, note), _NOTE, strict=True):
            if not isinstance(text, str):
                raise wrong_kind("a text belongs here", text, parameter, "a text")
            if not text.strip() or len(text) > most or not text.isprintable():
                raise InputError(
                    "a note is a name and a text of one line",
                    parameter=parameter,
                    came=text,
                    allowed=f"a name of 1 to {_NOTE[0]} characters, and a text of 1 to {_NOTE[1]}",
                )
        checked[name.strip()] = note.strip()
    return checked


def device_argument(device: object, parameter: str = "device") -> Device:
    """Return the instrument of a name."""
    from truearm.engine.twin.devices import DEVICES  # with its inverse kinematics, only where it is asked for

    return choice_argument(device, parameter, {known.name: known for known in DEVICES})


def paths_argument(paths: object, parameter: str, what: str) -> list[Path]:
    """Return a sequence of at least one path; `what` one path is, for the message."""
    if not _is_sequence(paths):
        raise wrong_kind(f"a sequence of {what}s belongs here", paths, parameter, "a list of paths")
    if not len(paths):
        raise InputError(f"no {what} is given", parameter=parameter, came="nothing", allowed="one or more")
    return [path_argument(path, parameter) for path in paths]


#: So many numbers of an array are written out.
_FEW: Final = 16


def written_in_python(value: object) -> str:
    """Return a value as Python writes it, an object by the kind it is."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Path):
        return repr(str(value))
    if isinstance(value, Payload | Wrench):
        return repr(value.text)
    if isinstance(value, np.ndarray) and value.ndim == 1 and len(value) <= _FEW:
        value = value.tolist()
    if isinstance(value, list | tuple):
        words = ", ".join(written_in_python(entry) for entry in value)
        return f"[{words}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{name!r}: {written_in_python(entry)}' for name, entry in value.items())}}}"
    plain = value is None or isinstance(value, str | bool | int | float)
    return repr(value) if plain else type(value).__name__.upper()
