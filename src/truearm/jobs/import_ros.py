"""Measurements from a recording of a ROS cell."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Final

from truearm.arrays import finite_number
from truearm.errors import InputError, refusals_of, wrong_kind
from truearm.files import path_argument
from truearm.jobs.arguments import (
    JOINTS_OF,
    choice_argument,
    command_argument,
    file_for,
    files_of,
    name_argument,
    names_argument,
    progress_argument,
    python_call,
)
from truearm.measurement.bags.recording import found_in
from truearm.measurement.bags.streams import TIMES, Times, read_streams
from truearm.modeling.controller import JointsOf
from truearm.results.imported_bag import PAGE, ImportedBag

#: How long a standstill may be asked to last [s].
_LONGEST: Final = 3600.0


def import_ros(
    file: str | Path,
    *,
    targets: Mapping[str, str] | None = None,
    references: Mapping[str, str] | None = None,
    joint_topic: str | None = None,
    joint_names: Sequence[str] | None = None,
    prismatic: Sequence[str] = (),
    joints_are: JointsOf = "model",
    times: Times = "stamp",
    still: float = 3.5e-4,
    hold: float = 1.0,
    settle: float = 0.3,
    out: str | Path | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> ImportedBag:
    """Read the standstills in a ROS 1 or ROS 2 bag: joint positions, and what an instrument saw of targets.

    Parameters
    ----------
    file
        A ``.bag`` file of ROS 1, or the folder of a bag of ROS 2.
    targets
        The topic of each target by its name; None for the only topic that holds points or poses.
    references
        The same of points beside the robot.
    joint_topic
        Topic of the joint positions; None for the only one.
    joint_names
        Names of the robot's joints in its order; None where numbers at their ends tell it.
    prismatic
        Those of them that slide.
    joints_are
        Whose joint positions they are: the ``model``'s, or as the robot's ``controller`` shows them.
    times
        When a message was: the ``stamp`` of its header, or as the recorder of the ``bag`` noted it.
    still
        How far a joint may move in a standstill [rad; m for those that slide].
    hold
        The shortest standstill [s].
    settle
        What is left out at its beginning and its end [s].
    out
        Canonical CSV file to write, and a page beside it; None writes nothing, see :meth:`ImportedBag.save`.
    command
        How to run it again, for the page; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        If the bag cannot be read, or holds no standstill in which a target was seen.
    """
    progress_argument(progress)
    bag = path_argument(file, "file")
    of_targets, of_references = _topics(targets, "targets"), _topics(references, "references")
    if both := [name for name in of_references if name in of_targets]:
        raise InputError(
            "a name stands for a target and for a point beside the robot", parameter="references", came=both[0]
        )
    if of_references and not of_targets:
        raise InputError("a point beside the robot is given, and no target", parameter="targets")
    allowed = "names of joints"
    named = None if joint_names is None else names_argument(joint_names, "joint_names", allowed)
    given = () if joint_names is None else joint_names  # may be an array, which is neither true nor false
    if named is not None and (not named or len(named) != len(given)):
        raise InputError("each joint has one name", parameter="joint_names", came=", ".join(map(str, given)))
    sliding = names_argument(prismatic, "prismatic", allowed)
    if joint_topic is not None:
        name_argument(joint_topic, "joint_topic")
    whose = choice_argument(joints_are, "joints_are", JOINTS_OF)
    clock = choice_argument(times, "times", {name: name for name in TIMES})
    within = finite_number(still, "still", lowest=1e-9, allowed="an angle above zero")
    shortest = finite_number(hold, "hold", lowest=0.05, allowed=f"0.05 s to {_LONGEST:g} s")
    left_out = finite_number(settle, "settle", lowest=0.0, allowed="0 s or more")
    if shortest > _LONGEST:
        raise InputError(
            "a standstill of this length is out of range",
            parameter="hold",
            came=f"{shortest:g} s",
            allowed=f"0.05 s to {_LONGEST:g} s",
        )
    if 2.0 * left_out >= shortest:
        raise InputError(
            "nothing is left of the shortest standstill",
            parameter="settle",
            came=f"{left_out:g} s at either end of {shortest:g} s",
            allowed=f"less than {shortest / 2:g} s",
            cure="Leave out less, or ask for longer standstills with `hold`.",
        )
    call = command_argument(command) or python_call(
        "import_ros",
        bag,
        targets=targets,
        references=references,
        joint_topic=joint_topic,
        joint_names=joint_names,
        prismatic=sliding or None,
        joints_are=whose,
        times=clock,
        still=within,
        hold=shortest,
        settle=left_out,
    )
    if out is not None:
        table = file_for(out, bag)
        if table.suffix == PAGE:
            raise InputError("the measurements are a CSV file", parameter="out", came=table.name, allowed="DATA.csv")
        file_for(table.with_suffix(PAGE), bag)
    with refusals_of("file"):
        progress("reading the bag")
        joints, seen = read_streams(bag, {**of_targets, **of_references} or None, joint_topic, named, clock)
        if unknown := [name for name in sliding if name not in joints.names]:
            raise InputError(
                "there is no such joint", parameter="prismatic", came=unknown[0], allowed=", ".join(joints.names)
            )
        progress("looking for standstills")
        found = found_in(
            bag,
            joints,
            seen,
            references=of_references,
            prismatic=sliding,
            joints_are=whose,
            still=within,
            hold=shortest,
            settle=left_out,
        )
    imported = ImportedBag(found, call, files_of(bag))
    if out is not None:
        progress("writing the files")
        imported.save(table)
    return imported


def _topics(topics: object, parameter: str) -> dict[str, str]:
    """Return topics by the names of what they show."""
    if topics is None:
        return {}
    if not isinstance(topics, Mapping):
        raise wrong_kind("topics by name belong here", topics, parameter, "a dict of names and topics")
    for name, topic in topics.items():
        if not isinstance(name, str) or not isinstance(topic, str):
            raise wrong_kind(
                "a name and a topic belong here", topic if isinstance(name, str) else name, parameter, "texts"
            )
    if len(set(topics.values())) < len(topics):
        raise InputError("one topic has two names", parameter=parameter, came=", ".join(topics.values()))
    return dict(topics)
