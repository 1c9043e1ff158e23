"""A campaign opened: what was asked for checked, what was fixed at the start written down or held against it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final, Unpack

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, did_you_mean, is_one_line, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.command.arguments import (
    command_argument,
    folder_for,
    length_argument,
    names_argument,
    python_call,
    robot_argument,
    whole_argument,
)
from truearm.engine.data.controller_joints import in_model_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.rows import Configurations
from truearm.engine.data.readers.sheets import joints_in_file
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.measuring.begun import (
    BEGUN,
    AskedOfSource,
    VirtualSource,
    begin,
    listener,
    quality_of_device,
    source_kind,
    virtual_source,
    watched_source,
)
from truearm.measuring.campaign import Campaign
from truearm.measuring.lines_of_sight import extent_notices, sight_notices
from truearm.measuring.reading_log import LOG, About, read_about
from truearm.measuring.result import DATA, PAGE, Measured
from truearm.measuring.session import LONGEST_ROUND, MOST_SAMPLES, Quality, Session
from truearm.measuring.sources import Source

_LONGEST_NAME: Final = 100
#: Configurations between two rounds of the nests, where nothing is said.
_EVERY: Final = 10
#: Column of a plan that names what a device reads at a configuration, and what separates the names.
_READS: Final = "reads"
_BETWEEN: Final = "; "


class Asked(AskedOfSource, total=False):
    """What :func:`truearm.measure` is asked for of a plan; what is not named is None."""

    targets: Sequence[str] | None
    nests: Sequence[str] | None
    every: int
    most_deviation: float | None
    most_settling: float | None
    fewest_samples: int | None
    about: str | Path | None


@dataclass(frozen=True, eq=False)
class Sight:
    """Lines of sight at the configuration that is measured next: to the targets, or to the nests in their round."""

    names: tuple[str, ...]  #: Of the targets or nests.
    origin: Array  #: Where the instrument is, in the world [m], ``(3,)``.
    targets: Array  #: Where the nominal robot has them, or where the nests stand [m], ``(k, 3)``.
    visible: NDArray[np.bool_]  #: Which the instrument can read, ``(k,)``.
    outstanding: NDArray[np.bool_]  #: Which are still to be measured, ``(k,)``.


class OpenCampaign(Campaign):
    """A campaign that knows its robot and plan, and writes what came of it.

    Attributes:
        robot: The nominal robot.
        placed: The same where a virtual instrument sees it; None for a real instrument, which nobody has placed.
        joints: Of the plan, as the model counts them [rad or m], ``(n, joints)``.
        sighted: What a virtual instrument cannot read of the plan, known before the first reading.
    """

    def __init__(
        self,
        session: Session,
        source: Source,
        folder: Path,
        *,
        robot: Robot,
        placed: Robot | None,
        plan: _Plan,
        said: _Said,
        sighted: tuple[Notice, ...],
    ) -> None:
        super().__init__(session, source, folder)
        self.robot, self.placed, self.joints, self.sighted = robot, placed, plan.joints, sighted
        self._plan, self._said, self._folder = plan, said, folder
        self._flange = robot.world_poses(plan.joints)[0]

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know so far: what cannot be read, whether lengths can be meant, and how it was measured."""
        told = super().notices
        if any(one.level == "warning" for one in self.sighted):  # it says what that one would say again
            told = tuple(one for one in told if one.code != "many-left-out")
        return (*self.sighted, *extent_notices(self.session, self._flange), *told)

    def measured(self) -> Measured:
        """Return what has come of it so far."""
        return Measured(
            title=self.robot.title,
            plan=str(self._plan.path),
            session=self.session,
            configurations=self._plan.configurations,
            about=self._said.about,
            instrument=self._said.instrument,
            folder=self._folder,
            command=self._said.command,
            told=self.notices,
            simulated=self.placed is not None,
        )

    def finish(self) -> Measured:
        """Write measurements and report, and return what has come of it; it may go on afterwards."""
        found = self.measured()
        found.write()
        return found


@dataclass(frozen=True, eq=False)
class _Plan:
    path: Path
    configurations: Configurations
    joints: Array
    reads: tuple[str, ...]
    before: Array | None

    @property
    def begun(self) -> list[Any]:
        """What must be the same when the measuring goes on, as JSON writes it."""
        stops = [] if self.before is None else self.before.tolist()
        return [[*self.configurations.labels], self.joints.tolist(), stops, [*self.reads]]

    def reads_of(self, targets: Sequence[str]) -> dict[str, tuple[str, ...]] | None:
        """Return which targets are read at each configuration, by its label; None if the plan says nothing of them.

        A target that the plan names nowhere is read everywhere: it is called otherwise, or comes on top.
        """
        rows = [{*words.split(_BETWEEN)} for words in self.reads]
        other = {*targets}.difference(*rows) if rows else {*targets}
        if len(other) == len({*targets}):
            return None
        return {
            label: tuple(name for name in targets if name in row or name in other)
            for label, row in zip(self.configurations.labels, rows, strict=True)
        }


@dataclass(frozen=True)
class _Said:
    about: About
    instrument: str
    command: str


def open_campaign(
    plan: str | Path, robot: Robot | str | Path, out: str | Path, *, command: str | None = None, **asked: Unpack[Asked]
) -> OpenCampaign:
    """Open the measuring of a plan; keywords as for :func:`truearm.measure`.

    Raises:
        InputError: If anything cannot be used, or the folder holds the measuring of another plan.
    """
    if unknown := {*asked} - {*Asked.__annotations__, *AskedOfSource.__annotations__}:
        raise TypeError(f"open_campaign() takes no keyword {sorted(unknown)[0]!r}")
    path = path_argument(plan, "plan")
    kind = source_kind(asked)
    truth, mapping, about = asked.get("truth"), asked.get("mapping"), asked.get("about")
    between = whole_argument(asked.get("every", _EVERY), "every", 1, LONGEST_ROUND)
    call = command_argument(command) or _call(path, robot, out, {**asked, "every": between})
    read = (path, robot, truth, mapping, about, asked.get("constraints"))
    folder_for((LOG, BEGUN), out, *read)
    folder = folder_for((DATA, PAGE), out, *read, ours=True)
    nominal = robot_argument(robot)
    with refusals_of("plan"):
        planned = _planned(path, nominal)
    said = About() if about is None else _about(about)
    targets, nests = _names(asked.get("targets"), "targets"), _names(asked.get("nests"), "nests")
    quality = _quality(asked)
    source: Source
    virtual: VirtualSource | None = None
    if kind == "device":
        nests = nests or ()
        virtual = virtual_source(asked, nominal, planned.joints, planned.before, nests)
        source, known = virtual.source, tuple(target.name for target in virtual.placed.targets)
        _refuse_unknown(targets, known)
        quality = quality_of_device(
            quality, source, *(asked.get(name) for name in ("most_deviation", "most_settling", "fewest_samples"))
        )
        instrument = f"a virtual {source.device.name} that measures a twin"
    elif kind == "watch":
        source = watched = watched_source(asked.get("watch"), mapping, planned.configurations.labels, folder)
        instrument = f"files in {watched.folder}"
        nests = tuple(watched.content.references) if nests is None else nests
        known = tuple(name for name in watched.names or () if name not in nests)
    else:
        source = port = listener(asked.get("listen"), asked.get("token"))
        nests, known, instrument = nests or (), (), f"lines sent to port {port.port}"
    try:
        names = targets or (tuple(target.name for target in nominal.targets) if virtual is None else ()) or known
        _refuse_names(names, nests)
        session = Session(planned.configurations.labels, names, nests, between, quality, planned.reads_of(names))
        sighted: tuple[Notice, ...] = ()
        if virtual is not None:
            sighted = sight_notices(session, virtual.source.device, virtual.placed, planned.joints)
        begin(folder, planned.begun, nominal, session, None if virtual is None else virtual.entries, said)
        return OpenCampaign(
            session,
            source,
            folder,
            robot=nominal,
            placed=None if virtual is None else virtual.placed,
            plan=planned,
            said=_Said(said, instrument, call),
            sighted=sighted,
        )
    except BaseException:
        source.close()
        raise


def sight(campaign: OpenCampaign) -> Sight | None:
    """Return the lines of sight at the configuration that is next; None where nobody knows where the robot stands."""
    from truearm.measuring.virtual_instrument import VirtualInstrument

    step, robot = campaign.session.next, campaign.placed
    if step is None or robot is None or not isinstance(campaign.source, VirtualInstrument):
        return None
    if step.kind == "nests":
        names = campaign.session.nests
        return Sight(
            names,
            np.zeros(3),
            np.array([campaign.source.nests[name] for name in names]),
            np.array([name not in campaign.source.hides[step.configuration] for name in names]),
            np.array([name in step.names for name in names]),
        )
    names = tuple(target.name for target in robot.targets)
    q = campaign.joints[step.configuration : step.configuration + 1]
    return Sight(
        names,
        np.zeros(3),
        np.array([robot.world_poses(q, name)[0][0] for name in names]),
        campaign.source.visible(step.configuration),
        np.array([name in step.names for name in names]),
    )


def _call(plan: Path, robot: object, out: object, asked: Asked) -> str:
    """Return the call that does the same, without the token: it stands in no file."""
    said = {name: value for name, value in asked.items() if name != "token"}
    if said["every"] == _EVERY:
        del said["every"]
    return python_call("measure", plan, robot, out=out, **said)


# -- what was asked for ----------------------------------------------------------------------------------------


def _planned(path: Path, robot: Robot) -> _Plan:
    """Return the configurations of a plan, and their joint positions as the model counts them."""
    cells, found = joints_in_file(path)
    n = len(found.labels)
    if n < len(found.of_row):
        raise InputError(
            "a configuration of the plan appears twice",
            where=cells.source,
            came=found.labels[int(np.argmax(np.bincount(found.of_row)))],
            cure="Give every row its own label: one row is one standstill.",
        )
    data = Dataset(
        source=cells.source,
        labels=found.labels,
        joints=found.joints,
        joint_kinds=found.kinds,
        targets=("any",),
        configuration=np.arange(n),
        target=np.zeros(n, dtype=np.intp),
        position=np.full((n, 3), np.nan),
        joints_are=found.joints_are,
    )
    at = cells.names.index(_READS) if _READS in cells.names else None
    reads = () if at is None else cells.columns[at]
    stops = found.before
    before = None if stops is None else replace(data, joints=stops.joints, joint_kinds=stops.kinds)
    return _Plan(
        path,
        found,
        in_model_joints(robot, data).joints,
        reads,
        None if before is None else in_model_joints(robot, before).joints,
    )


def _about(about: object) -> About:
    path = path_argument(about, "about")
    with refusals_of("about"):
        return read_about(path)


def _quality(asked: Asked) -> Quality:
    deviation, settling, samples = (asked.get(n) for n in ("most_deviation", "most_settling", "fewest_samples"))
    return Quality(
        None if deviation is None else length_argument(deviation, "most_deviation", 0.0),
        None if settling is None else length_argument(settling, "most_settling", 0.0),
        1 if samples is None else whole_argument(samples, "fewest_samples", 1, MOST_SAMPLES),
    )


def _names(names: object, parameter: str) -> tuple[str, ...] | None:
    if names is None:
        return None
    found = names_argument(names, parameter, "names of points")
    given = [str(name) for name in names]  # type: ignore[attr-defined]
    if len(given) > len(found):
        twice = next(name for name in found if given.count(name) > 1)
        raise InputError("a point is named twice", parameter=parameter, came=twice, cure="Name each once.")
    for name in found:
        if not is_one_line(name) or len(name) > _LONGEST_NAME or name != name.strip():
            raise InputError(
                "a name belongs here",
                parameter=parameter,
                came=name,
                allowed=f"one line of up to {_LONGEST_NAME} characters",
            )
    return found


def _refuse_unknown(targets: Sequence[str] | None, known: Sequence[str]) -> None:
    unknown = [name for name in targets or () if name not in known]
    if unknown:
        raise InputError(
            "the tool has no such target",
            parameter="targets",
            came=unknown[0],
            allowed=", ".join(known),
            cure=did_you_mean(unknown[0], known),
        )


def _refuse_names(targets: Sequence[str], nests: Sequence[str]) -> None:
    if not targets:
        raise InputError(
            "nobody says which targets are measured",
            parameter="targets",
            allowed="the names by which the readings call them",
            cure="Name them, or take a robot file that has targets.",
        )
    both = [name for name in nests if name in targets]
    if both:
        raise InputError("a name stands for a target and for a nest", parameter="targets, nests", came=both[0])
