"""What jobs accept, and how they refuse the rest: every refusal names the parameter."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from numbers import Integral, Real
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from truearm.arrays import finite_number, number_array
from truearm.errors import InputError, did_you_mean, wrong_kind
from truearm.files import new_file, refuse_overwriting, writable_file, writable_folder
from truearm.library import is_robot, load_robot, urdf_source
from truearm.measurement.dataset import Dataset
from truearm.measurement.readers.canonical import read_csv
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.units import accepted_range, sized_si

if TYPE_CHECKING:
    from truearm.simulation.devices import Device

T = TypeVar("T")


@contextmanager
def refusals_of(parameter: str) -> Iterator[None]:
    """Let refusals of what a parameter holds name it, beside the file or the place that they name."""
    try:
        yield
    except InputError as error:
        if error.parameter is None:
            _name(error, parameter)
        raise


def _name(error: InputError, parameter: str) -> None:
    """Let a refusal name a parameter."""
    error.parameter = parameter
    error.args = (error.message(str),)


def robot_argument(robot: object, parameter: str = "robot") -> Robot:
    """Return the robot that was given, or that a library id, robot file or URDF names."""
    if isinstance(robot, Robot):
        return robot
    if isinstance(robot, str | Path):
        try:
            return load_robot(robot)
        except InputError as error:  # the library calls whatever it is given the robot
            _name(error, parameter)
            raise
    raise wrong_kind("a robot belongs here", robot, parameter, "a Robot, a library id, a robot file or a URDF")


def data_argument(data: object, parameter: str = "data") -> Dataset:
    """Return the dataset that was given, or that a canonical CSV file holds."""
    if isinstance(data, Dataset):
        return data
    if isinstance(data, str | Path):
        path = path_argument(data, parameter)
        if is_robot(data):
            raise InputError(
                "this is a robot, and measurements belong here",
                parameter=parameter,
                came=str(data),
                allowed="a canonical CSV file",
                cure="The robot comes first, then the measurements.",
            )
        with refusals_of(parameter):
            return read_csv(path)
    raise wrong_kind("measurements belong here", data, parameter, "a Dataset, or a canonical CSV file")


def path_argument(path: object, parameter: str) -> Path:
    """Return a path that was given as a text or a path."""
    if isinstance(path, str | Path) and "\0" not in str(path):
        if str(path):
            return Path(path)
        raise InputError("no file is given", parameter=parameter, came=str(path))
    raise wrong_kind(
        "a path belongs here", path, parameter, "the path of a file or folder, as a text or a pathlib.Path"
    )


def folder_for(names: Iterable[str], out: object, *read: object, parameter: str = "out") -> Path:
    """Return the folder for files of some names, or refuse one that cannot be written to, before any long work.

    Parameters
    ----------
    read
        What the job was given: none of these, as far as they are files, may be overwritten.
    """
    folder = path_argument(out, parameter)
    with refusals_of(parameter):
        writable_folder(folder)
        for name in names:
            refuse_overwriting(folder / name, _files_of(read))
    return folder


def file_for(out: object, *read: object, parameter: str = "out") -> Path:
    """Return where a file shall be written, or refuse a place that cannot be; `read` as for :func:`folder_for`."""
    path = path_argument(out, parameter)
    with refusals_of(parameter):
        writable_file(path)
        refuse_overwriting(path, _files_of(read))
    return path


def new_file_for(out: object, parameter: str = "out") -> Path:
    """Return where a file shall be written that does not exist yet, or refuse a place that cannot be."""
    with refusals_of(parameter):
        return new_file(path_argument(out, parameter))


def _files_of(given: Iterable[object]) -> list[Path]:
    named = [value for value in given if isinstance(value, str | Path)]
    return [(urdf_source(value) or (Path(value), None))[0] for value in named]


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


def gravity_argument(gravity: object, parameter: str = "gravity") -> tuple[float, float, float] | None:
    """Return the acceleration of free fall that was given [m/s^2]; None for None."""
    if gravity is None:
        return None
    values = numbers_argument(gravity, parameter, 3, "0,0,-9.81 for a robot that stands, in m/s^2")
    return values[0], values[1], values[2]


def numbers_argument(values: object, parameter: str, count: int, allowed: str) -> tuple[float, ...]:
    """Return `count` finite numbers."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise wrong_kind(f"{count} numbers belong here", values, parameter, allowed)
    found = [*values]
    if len(found) != count:
        raise InputError(f"{count} numbers belong here", parameter=parameter, came=len(found), allowed=allowed)
    return tuple(finite_number(value, parameter) for value in found)


def whole_argument(value: object, parameter: str, lowest: int = 0, highest: int | None = None) -> int:
    """Return a whole number within limits."""
    span = f"{lowest} or more" if highest is None else f"{lowest} to {highest}"
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise wrong_kind("a whole number belongs here", value, parameter, span)
    number = int(value)
    if number < lowest or (highest is not None and number > highest):
        raise InputError("the number is out of range", parameter=parameter, came=number, allowed=span)
    return number


def length_argument(value: object, parameter: str, lowest: float = -math.inf) -> float:
    """Return a length that can be meant [m], `lowest` or more."""
    length = finite_number(value, parameter, allowed="a length")
    least, most = accepted_range("m")
    if not max(least, lowest) <= length <= most:
        span = f"up to {most:g} m" if lowest == -math.inf else f"{lowest:g} m to {most:g} m"
        raise InputError("the length is out of range", parameter=parameter, came=f"{length:g} m", allowed=span)
    return length


def deviation_argument(value: object, parameter: str) -> float:
    """Return a standard deviation of lengths that can be meant [m]."""
    return sized_si(finite_number(value, parameter), "m", parameter=parameter, deviation=True)


def lengths_argument(
    values: object, parameter: str, count: int, lowest: float = -math.inf, *, one_for_all: bool = False
) -> tuple[float, ...]:
    """Return `count` lengths [m], each `lowest` or more.

    Parameters
    ----------
    one_for_all
        Whether a single number may stand for all of them.
    """
    if one_for_all and isinstance(values, Real):
        return (length_argument(values, parameter, lowest),) * count
    found = numbers_argument(values, parameter, count, f"{count} lengths{', or one for all' if one_for_all else ''}")
    return tuple(length_argument(value, parameter, lowest) for value in found)


def array_argument(values: object, parameter: str, shape: tuple[int | str, ...], allowed: str) -> Array:
    """Return an array of finite numbers, not an empty one; `shape` as for :func:`truearm.arrays.number_array`."""
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
    if isinstance(value, str):
        return value
    raise wrong_kind("a name belongs here", value, parameter, "a text")


def choice_argument(value: object, parameter: str, known: Mapping[str, T], what: str | None = None) -> T:
    """Return what a name stands for, of those that are known.

    Parameters
    ----------
    what
        What it is the name of, for the message; the parameter if None.
    """
    if not isinstance(value, str):
        raise wrong_kind("a name belongs here", value, parameter, ", ".join(known))
    if value in known:
        return known[value]
    raise InputError(
        f"there is no {what or parameter} of this name",
        parameter=parameter,
        came=value,
        allowed=", ".join(known),
        cure=did_you_mean(value, known),
    )


def choices_argument(values: object, parameter: str, known: Collection[str], what: str) -> tuple[str, ...]:
    """Return a sequence of names of those that are known."""
    if isinstance(values, str | bytes) or not isinstance(values, Sequence):
        raise wrong_kind("a sequence of names belongs here", values, parameter, ", ".join(known))
    return tuple(choice_argument(value, parameter, {name: name for name in known}, what) for value in values)


def device_argument(device: object, parameter: str = "device") -> Device:
    """Return the instrument of a name."""
    from truearm.simulation.devices import DEVICES  # with its inverse kinematics, only where it is asked for

    return choice_argument(device, parameter, {known.name: known for known in DEVICES})


def paths_argument(paths: object, parameter: str, what: str) -> list[Path]:
    """Return a sequence of at least one path; `what` one path is, for the message."""
    if isinstance(paths, str | bytes) or not isinstance(paths, Sequence):
        raise wrong_kind(f"a sequence of {what}s belongs here", paths, parameter, "a list of paths")
    if not paths:
        raise InputError(f"no {what} is given", parameter=parameter, came="nothing", allowed="one or more")
    return [path_argument(path, parameter) for path in paths]


def python_call(job: str, /, *given: object, **keywords: object) -> str:
    """Return the call of a job in Python, objects by the kind they are; keywords that are None are left out."""
    words = [_written(value) for value in given]
    words += [f"{name}={_written(value)}" for name, value in keywords.items() if value is not None]
    return f"truearm.{job}({', '.join(words)})"


def _written(value: object) -> str:
    if isinstance(value, Path):
        return repr(str(value))
    if isinstance(value, Payload):
        return repr(value.text)
    if isinstance(value, list | tuple):
        words = ", ".join(_written(entry) for entry in value)
        return f"[{words}]"
    plain = value is None or isinstance(value, str | bool | int | float)
    return repr(value) if plain else type(value).__name__.upper()
