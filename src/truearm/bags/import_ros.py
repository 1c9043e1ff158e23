"""What an import from a recording of a ROS cell is asked for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError, wrong_kind
from truearm.engine.command.groups import IntoFile, JointsGiven, Long, Repeatable
from truearm.engine.command.kinds import Choice, File, NamedFiles, Names, Number, Text
from truearm.engine.command.request import job, option, required

if TYPE_CHECKING:
    from truearm.bags.result import ImportedBag
    from truearm.bags.streams import Times


class _Topics(NamedFiles):
    """Topics by the names of what they show."""

    what = "topic"

    def check(self, value: Any, name: str) -> Any:
        """Refuse what are no topics by name, and one with two names."""
        if not isinstance(value, Mapping):
            raise wrong_kind("topics by name belong here", value, name, "a dict of names and topics")
        for target, topic in value.items():
            if not isinstance(target, str) or not isinstance(topic, str):
                wrong = topic if isinstance(target, str) else target
                raise wrong_kind("a name and a topic belong here", wrong, name, "texts")
        if len(set(value.values())) < len(value):
            raise InputError("one topic has two names", parameter=name, came=", ".join(value.values()))
        return dict(value)


class _JointNames(Names):
    def check(self, value: Any, name: str) -> Any:
        """Refuse no names, and one that comes twice."""
        names = super().check(value, name)
        if not names or len(names) != len(value):
            raise InputError("each joint has one name", parameter=name, came=", ".join(map(str, value)))
        return names


class ImportRos(JointsGiven, IntoFile, Repeatable, Long):
    """Standstills in a bag of ROS: joint positions, and points or poses of targets. ROS is not needed.

    Writes a page beside the file, with its name and the ending .html.
    """

    job = "import_ros"
    words = "import ros"
    refuses = "If the bag cannot be read, or holds no standstill in which a target was seen."
    file: str | Path = required(File("BAG"), "A .bag file of ROS 1, or the folder of a bag of ROS 2.", kw_only=False)
    targets: Mapping[str, str] | None = option(
        _Topics("NAME=TOPIC"),
        "Topic of points or poses of a target.",
        default=None,
        word="target",
        shown="the only one",
    )
    references: Mapping[str, str] | None = option(
        _Topics("NAME=TOPIC"), "Topic of a point beside the robot.", default=None, word="reference", shown=False
    )
    joint_topic: str | None = option(Text("TOPIC"), "Topic of the joint positions.", default=None, shown="the only one")
    joint_names: Sequence[str] | None = option(
        _JointNames("NAME,NAME,...", "names of joints", repeated=False),
        "The robot's joints from base to flange, as the messages call them.",
        default=None,
        formerly="joints",
        shown="by the numbers at their ends",
    )
    prismatic: Sequence[str] = option(
        Names("NAME,...", "names of joints", repeated=False), "Joints that slide.", default=(), shown="none"
    )
    times: Times = option(
        Choice(known=("stamp", "bag")), "When a message was: by its header, or by the recorder.", default="stamp"
    )
    still: float = option(
        Number("deg", low=0.0, above=True),
        "How far a joint may move in a standstill; one that slides 1 m per rad.",
        default=math.radians(0.02),
    )
    shortest_dwell: float = option(
        Number("s", low=0.05, high=3600.0), "The shortest standstill.", default=1.0, formerly="hold"
    )
    settle: float = option(
        Number("s", low=0.0), "What is left out at the beginning and end of a standstill.", default=0.3
    )

    def check(self) -> None:
        """Refuse a name for two things, and a standstill of which nothing is left."""
        targets, references = self.targets or {}, self.references or {}
        if both := [name for name in references if name in targets]:
            raise InputError(
                "a name stands for a target and for a point beside the robot", parameter="references", came=both[0]
            )
        if references and not targets:
            raise InputError("a point beside the robot is given, and no target", parameter="targets")
        if 2.0 * self.settle >= self.shortest_dwell:
            raise InputError(
                "nothing is left of the shortest standstill",
                parameter="settle",
                came=f"{self.settle:g} s at either end of {self.shortest_dwell:g} s",
                allowed=f"less than {self.shortest_dwell / 2:g} s",
                cure="Leave out less, or ask for longer standstills with `shortest_dwell`.",
            )

    def run(self) -> ImportedBag:
        """Import."""
        from truearm.bags.result import of_bag

        return of_bag(self)


import_ros = job(ImportRos)
