"""Groups of options that several jobs have."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from truearm.engine.command.kinds import (
    Again,
    Callback,
    Choice,
    Doing,
    File,
    Flag,
    Given,
    Gravity,
    Names,
    NotesKind,
    Number,
    NumberOr,
    Numbers,
    PayloadKind,
    Positions,
    Text,
    TruthKind,
    Whole,
    WrenchKind,
)
from truearm.engine.command.request import Request, as_in, option, required

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from truearm.engine.data.dataset import Dataset
    from truearm.engine.motion.constraints import Constraints
    from truearm.engine.motion.largest_cube import Direction
    from truearm.engine.robot.chain import Array
    from truearm.engine.robot.controller import JointsOf
    from truearm.engine.robot.parts import Payload
    from truearm.engine.robot.robot import Robot
    from truearm.engine.robot.wrench import Wrench, WrenchFrame

Train = int | Literal["all"] | None


def _silent(words: str) -> None:
    """Tell nobody."""


def _devices() -> list[str]:
    from truearm.engine.twin.devices import DEVICES

    return [device.name for device in DEVICES]


def _languages() -> list[str]:
    from truearm.engine.programs import PROGRAM_LANGUAGES

    return [*PROGRAM_LANGUAGES]


def _models() -> list[str]:
    from truearm.engine.fit.models import MODELS

    return [model.name for model in MODELS]


class OfModel(Request):
    """Which parameters."""

    model: str = option(
        Choice("MODEL", _models), "Whose parameters count, as in 'truearm calibrate'; no auto.", default="geometric"
    )


class OfRobot(Request):
    """Which robot."""

    robot: Robot | str | Path = required(Given("ROBOT"), "A library id, a robot file or a URDF.", kw_only=False)


class OfPlan(Request):
    """Which plan."""

    plan: str | Path = required(
        File("PLAN.csv"),
        "Configurations, as 'truearm plan' writes them.",
        kw_only=False,
        more="In the order of measuring: ``configuration`` and ``joint_1 [deg]`` .. or ``axis_1 [deg]`` ..",
    )


class ByMapping(Request):
    """Which column is what."""

    mapping: str | Path = required(
        File("MAPPING.yaml|PRESET"),
        "Which column is what: a file, or one of spatial-analyzer and t-mac.",
        kw_only=False,
        word="map",
        more="The schema of a file is ``truearm-mapping/1``.",
    )


class Measured(Request):
    """What was measured."""

    data: Dataset | str | Path = required(Given("DATA.csv"), "Measurements in the canonical CSV.", kw_only=False)


class OfData(Measured, OfRobot):
    """Which robot, and what was measured on it."""


@dataclass(frozen=True)
class Loads:
    """What a robot carries, and which way is down; None as its file says."""

    payload: Payload | None  #: On the flange.
    gravity: tuple[float, float, float] | None  #: Free fall in the base frame [m/s^2].

    def on(self, robot: Robot) -> Robot:
        """Return a robot that carries them."""
        return robot.with_payload(self.payload, self.gravity)


class Carrying(Request):
    """What the robot carries."""

    payload: Payload | str | None = option(
        PayloadKind("MASS,X,Y,Z"),
        'What the flange carries, with its centre of gravity in the flange frame: "2.7kg,50mm,25mm,100mm".',
        default=None,
        shown="as the robot file says",
    )

    @property
    def loads(self) -> Loads:
        """What was given, checked."""
        payload: Any = self.payload
        return Loads(payload, None)


class Mounted(Request):
    """How the robot is mounted."""

    gravity: Sequence[float] | None = option(
        Gravity("X,Y,Z"),
        "Free fall in the robot's base frame, 0,0,9.81 for a robot that hangs.",
        default=None,
        shown="as the robot file says",
    )


class Loaded(Carrying, Mounted):
    """What the robot carried, and how it is mounted."""

    @property
    def loads(self) -> Loads:
        """What was given, checked."""
        gravity: Any = self.gravity
        return replace(super().loads, gravity=gravity)


class AtTarget(Request):
    """Which target goes to poses."""

    target: str | None = option(Text("NAME"), "Which target is the tip.", default=None, shown="the flange")


class AtPlace(Request):
    """Which place on the flange goes to poses."""

    tip: Sequence[float] | None = option(
        Numbers("X,Y,Z", "mm", 3), "Where the tip is in the flange frame.", default=None, shown="the flange"
    )


class AtTip(AtTarget, AtPlace):
    """What goes to poses."""


class Near(Request):
    """Where the joints begin."""

    seed_joints: Array | Sequence[float] | str | None = option(
        Positions("DEG,DEG,.."),
        "Joint positions to stay near to (mm if sliding), of the kind that is written.",
        default=None,
        formerly="seed",
        shown="zeros",
        more="That is a text; numbers are positions of the model, ``(joints,)`` or one row a pose [rad; m for "
        "prismatic joints].",
    )


class InCube(Request):
    """Which cube poses are in."""

    plane: str = option(
        Choice("CORNERS", ("C1-C2-C7-C8", "C2-C3-C8-C5", "C3-C4-C5-C6", "C4-C1-C6-C7")),
        "Diagonal plane of the cube.",
        default="C1-C2-C7-C8",
    )
    ahead: Direction = option(
        Choice(known=("+x", "-x", "+y", "-y")), "Where the largest cube is searched.", default="+x"
    )
    nearest: float = option(Number("mm"), "How far ahead the largest cube begins.", default=0.0)
    lowest: float = option(Number("mm"), "How high the largest cube begins.", default=0.0, formerly="floor")


class Instrument(Request):
    """How well an instrument reads poses."""

    noise: float = option(
        Number("mm", low=0.0, deviation=True), "Standard deviation of a coordinate that is read.", default=1e-5
    )
    noise_rot: float = option(
        Number("deg", low=0.0, deviation=True),
        "Of the instrument: standard deviation of an angle.",
        default=math.radians(0.005),
    )


class Declared(Request):
    """How well is known what was touched or drawn."""

    sigma: float | None = option(
        Number("mm", low=0.0, above=True, deviation=True),
        "Standard deviation of what was touched or drawn.",
        default=None,
        shown="not declared",
    )


class SeenBy(Request):
    """Which instrument reads."""

    device: str | None = option(
        Choice("NAME", _devices),
        "An instrument of 'truearm devices'.",
        default=None,
        shown="one that sees every target everywhere",
    )


class Drawn(Request):
    """Where random numbers begin."""

    seed: int = option(Whole("S"), "Of all that is drawn.", default=0)


class Split(Drawn):
    """What is trained on, and what judges."""

    train: Train = option(
        NumberOr("N|all"),
        "Configurations to train on; the rest judges.",
        default=None,
        shown="70 %",
        more="They are the first of ``numpy.random.default_rng(seed).permutation(n)``; ``all`` holds nothing out. "
        "Where joints come back to a posture, all configurations there are in one part.",
    )


class Noted(Request):
    """What a person notes."""

    notes: Mapping[str, str] | None = option(
        NotesKind("KEY=VALUE"),
        "What the result shall say beside the figures: date, serial, operator, instrument, ...",
        default=None,
        word="note",
        shown=False,
    )


class Commanded(Request):
    """What says how it was asked for, in its results."""

    command: str | None = option(
        Again(), "How to run it again, as results say it", default=None, word="", shown="this call", repeated=False
    )


class Repeatable(Commanded):
    """What says how it was asked for, in its results, and can be asked for that."""

    @property
    def again(self) -> str:
        """How to run it again."""
        return self.command or self.as_python()


class Long(Request):
    """What takes so long that somebody may want to be told how far it is."""

    progress: Callable[[str], None] = option(
        Callback(), "Called with a few words at each step", default=_silent, word="", repeated=False
    )


class InParts(Request):
    """What is done in parts, by whoever can do them."""

    workers: int | None = option(
        Whole(low=1, counts=True),
        "Processes of this machine that share the work.",
        default=None,
        shown="one a processor",
        more="One is this process itself.",
    )

    executor: Executor | None = option(
        Doing(), "An executor that does the parts, which stays open", default=None, word="", repeated=False
    )


class Excluding(Request):
    """Which readings do not count."""

    exclude: str | Path | None = option(
        File("FILE"),
        "Readings to exclude: configuration, target and reason.",
        default=None,
        shown=False,
        more="They count as missing, and the split stays.",
    )


class ForceFrame(Request):
    """Whose axes a force is given in."""

    wrench_frame: WrenchFrame | None = option(
        Choice(known=("base", "tool", "world", "controller")),
        "Whose axes `wrench` is given in.",
        default=None,
        shown="base",
        more="Of the tool are those of the target or the flange.",
    )


class Forced(ForceFrame):
    """What acts on the tool besides weight."""

    wrench: Wrench | Sequence[float] | str | None = option(
        WrenchKind("FX,FY,FZ,MX,MY,MZ"),
        "What acts on the tool besides weight: a force [N] at its point and a moment [N m], or with units: "
        '"0N,0N,80N,0Nm,0Nm,1.5Nm".',
        default=None,
        shown="nothing",
    )


class ForcedAt(Forced):
    """What acts on one of several targets."""

    wrench_at: str | None = option(
        Text("NAME"), "The target on which `wrench` acts, or flange.", default=None, shown="the only target"
    )


class JointsGiven(Request):
    """Whose joint positions are given."""

    joints_are: JointsOf | None = option(
        Choice(known=("controller", "model")),
        "Whose joint positions they are: as the controller shows them, or the model's.",
        default=None,
        shown="the model's",
    )


class JointsWritten(Request):
    """Whose joint positions are written."""

    joints: JointsOf | None = option(
        Choice(known=("controller", "model")),
        "Whose joint positions to write: as the controller shows them (axis_i), or the model's (joint_i).",
        default=None,
        shown="the controller's where the robot file says that they differ",
    )


class Programmed(Request):
    """A program that drives what is planned."""

    program: str | None = option(
        Choice("rapid|krl|fanuc|urscript|inform|val3", _languages),
        "Write a program in this language.",
        default=None,
        shown=False,
    )
    dwell: float | None = option(
        Number("s", low=0.0, high=300.0, above=True),
        "How long it stands where it is measured.",
        default=None,
        shown="2",
    )


class OfController(Request):
    """What a controller computes with."""

    controller_kinematics: str | Path | None = option(
        File("nominal|proprietary|unknown|FILE"),
        "What the controller computes poses with: the robot file's table, a calibration of its maker that nobody can "
        "read, unknown, or a kinematics file (calibration.conf).",
        default=None,
        shown="as the robot file says, else asked",
        more="The file is one that `import_ur_kinematics` reads.",
    )


class Accepting(Request):
    """What is accepted of a correction."""

    accept: Sequence[str] = option(
        Names(example="names of notices", commas=False),
        "Accept what speaks against the calibration, as rank-loss, or against a program: skipped, not-better-here, "
        "maker.",
        default=(),
        more="Of the calibration: ``rank-loss``, ``not-converged``, ``implausible``, or a notice of the level error "
        "that it ended with, such as ``wrong-robot``. Of a program: ``maker`` for the language of another maker; "
        "``other-kinematics`` for kinematics of the controller that are not this arm's; ``skipped`` where some targets "
        "cannot be corrected and stay as they are; ``numbers-read`` where it computes with numbers of corrected "
        "targets; and ``not-better-here`` to correct also targets that would rather get worse.",
    )
    accept_correction: str | None = option(
        Given("LENGTH,ANGLE"),
        "How far targets may be moved and turned, for instance 95mm,3deg; a larger correction is refused.",
        default=None,
        shown="twice the robot's largest deviation",
    )


class Constrained(Request):
    """What configurations must keep."""

    constraints: Constraints | str | Path | None = option(
        Given("FILE"),
        "What a configuration must keep: boxes, which also hide targets, limits of joints, a floor.",
        default=None,
        shown=False,
    )


class Clearing(Request):
    """How much room is kept."""

    clearance: float | None = option(
        Number("mm", low=0.0),
        "Room that the arm keeps to floor, boxes and its own links, on the ways too.",
        default=None,
        shown="50 mm",
    )


class InCell(Constrained, Clearing):
    """What stands in the cell."""


class InBox(Request):
    """Where poses are."""

    centre: Sequence[float] | None = option(
        Numbers("X,Y,Z", "mm", 3),
        "Of the cube, the box or the sphere, in the base frame.",
        default=None,
        shown="the largest cube",
    )


class OfCell(Request):
    """Where tools and frames are."""

    tools: str | Path | None = option(
        File("FILE"),
        "A cell file: where the tools really are on the flange.",
        default=None,
        shown="best with nominal",
        more="See :mod:`truearm.engine.programs.cell`.",
        formerly="tool",
    )
    frames: str | Path | None = option(
        File("FILE"),
        "A cell file: where frames really are.",
        default=None,
        shown="no shift on average",
        more="See :mod:`truearm.engine.programs.cell`.",
        formerly="frame",
    )


class OnFloor(Request):
    """Where the floor is."""

    floor: float | None = option(
        Number("mm"),
        "Height of the floor in the base frame, kept clear.",
        default=None,
        shown="0; where the robot hangs, its mounting surface",
        more="It is 0 or less. Where the robot's gravity says that it does not stand, only 0 is taken: the surface on "
        "which it is mounted. With `clearance` it is kept by all that moves, as are boxes and the arm's own links: in "
        "every configuration, and on the ways from the safe one to the first, on to each other and back.",
    )
    no_floor: bool = option(Flag(), "There is no floor and no mounting surface to keep clear.", default=False)


class FromHome(Request):
    """Where an arm starts and ends."""

    home: Sequence[float] | str | None = option(
        Positions("DEG,DEG,.."),
        "The safe configuration to start and end in (mm if sliding), of the kind that is written.",
        default=None,
        shown="one is found",
        more="That is a text; numbers are positions of the model [rad; m for prismatic joints].",
    )


class OfTruth(Request):
    """What a simulated robot truly is, and whose joint positions its data hold."""

    truth: Robot | str | Path = required(
        TruthKind("NAME|FILE"),
        "nominal, random, gear-errors, tooth-errors, a truth of the robot file ('truearm show'), or a file.",
        kw_only=True,
        word="truth",
        more="``random``: geometry and joint zeros drawn from their priors; ``gear-errors``, ``tooth-errors``: the "
        "same with errors of encoders and gears. A file, or a robot, has its own base, and its own targets if it has "
        "some.",
    )
    joints: JointsOf = as_in(JointsWritten, "joints", default="model", shown=True)


class AmongCandidates(Request):
    """Among what configurations are chosen."""

    candidates: int = option(Whole(low=1, counts=True), "Random configurations to choose from.", default=5000)
    noise: float = option(
        Number("mm", low=0.0, above=True, deviation=True),
        "Standard deviation of a coordinate about a well identified model.",
        default=1e-4,
    )


class IntoFile(Request):
    """What writes a file."""

    out: str | Path | None = option(
        File("FILE"), "File to write.", default=None, shown="none is written", needed=True, repeated=False
    )


class AlsoIntoFile(Request):
    """What writes a file where one is asked for."""

    out: str | Path | None = as_in(IntoFile, "out", default=None)


class IntoNewFile(Request):
    """What writes a file that does not exist yet."""

    out: str | Path | None = as_in(
        IntoFile, "out", default=None, needed=True, help="File to write; nothing is overwritten."
    )


class IntoFolder(Request):
    """What writes files into a folder."""

    out: str | Path | None = option(
        File("DIR"), "Folder for the results.", default=None, shown="none are written", needed=True, repeated=False
    )


class AlsoIntoFolder(Request):
    """What writes files into a folder where one is asked for."""

    out: str | Path | None = as_in(IntoFolder, "out", default=None)
