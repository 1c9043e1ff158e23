"""A campaign opened: what was asked for checked, what was fixed at the start written down or held against it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, Notice, did_you_mean, refusals_of
from truearm.engine.command.arguments import folder_for, robot_argument
from truearm.engine.data.controller_joints import in_model_joints
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.readers.rows import Configurations
from truearm.engine.data.readers.sheets import joints_in_file
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.measuring.begun import (
    BEGUN,
    VirtualSource,
    begin,
    quality_of_device,
    virtual_source,
    watched_source,
)
from truearm.measuring.campaign import Campaign
from truearm.measuring.lines_of_sight import extent_notices, sight_notices
from truearm.measuring.reading_log import LOG, About, read_about
from truearm.measuring.result import DATA, PAGE, Measured
from truearm.measuring.session import Quality, Session
from truearm.measuring.sources import Source

if TYPE_CHECKING:
    from truearm.measuring.measure import Measure

#: Column of a plan that names what a device reads at a configuration, and what separates the names.
_READS: Final = "reads"
_BETWEEN: Final = "; "


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
        stated: _Stated,
        sighted: tuple[Notice, ...],
    ) -> None:
        super().__init__(session, source, folder)
        self.robot, self.placed, self.joints, self.sighted = robot, placed, plan.joints, sighted
        self._plan, self._stated, self._folder = plan, stated, folder
        self._flange = robot.world_poses(plan.joints)[0]

    @property
    def notices(self) -> tuple[Notice, ...]:
        """What to know so far: what cannot be read, whether lengths can be meant, and how it was measured."""
        notices = super().notices
        if any(notice.level == "warning" for notice in self.sighted):  # it says what that one would say again
            notices = tuple(notice for notice in notices if notice.code != "many-left-out")
        return (*self.sighted, *extent_notices(self.session, self._flange), *notices)

    def measured(self) -> Measured:
        """Return what has come of it so far."""
        return Measured(
            title=self.robot.title,
            plan=str(self._plan.path),
            session=self.session,
            configurations=self._plan.configurations,
            about=self._stated.about,
            instrument=self._stated.instrument,
            folder=self._folder,
            command=self._stated.command,
            measuring_notices=self.notices,
            simulated=self.placed is not None,
        )

    def finish(self) -> Measured:
        """Write measurements and report, and return what has come of it; it may go on afterwards."""
        measured = self.measured()
        measured.write()
        return measured


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
class _Stated:
    about: About
    instrument: str
    command: str


def opened(asked: Measure) -> OpenCampaign:
    """Open the measuring of a plan.

    Raises:
        InputError: If anything cannot be used, or the folder holds the measuring of another plan.
    """
    path = Path(asked.plan)
    read = (path, asked.robot, asked.truth, asked.mapping, asked.about, asked.constraints)
    folder_for((LOG, BEGUN), asked.out, *read)
    folder = folder_for((DATA, PAGE), asked.out, *read, ours=True)
    nominal = robot_argument(asked.robot)
    with refusals_of("plan"):
        planned = _planned(path, nominal)
    about = About()
    if asked.about is not None:
        with refusals_of("about"):
            about = read_about(Path(asked.about))
    of = _source(asked, nominal, planned, folder)
    virtual = of.virtual
    try:
        own = tuple(target.name for target in nominal.targets) if virtual is None else ()
        names = tuple(asked.targets or own or of.known)
        _refuse_names(names, of.nests)
        quality = Quality(asked.most_deviation, asked.most_settling, asked.fewest_samples or 1)
        sighted: tuple[Notice, ...] = ()
        if virtual is not None:
            quality = quality_of_device(asked, virtual.source)
        session = Session(planned.configurations.labels, names, of.nests, asked.every, quality, planned.reads_of(names))
        if virtual is not None:
            sighted = sight_notices(session, virtual.source.device, virtual.placed, planned.joints)
        begin(folder, planned.begun, nominal, session, None if virtual is None else virtual.entries, about)
        return OpenCampaign(
            session,
            of.source,
            folder,
            robot=nominal,
            placed=None if virtual is None else virtual.placed,
            plan=planned,
            stated=_Stated(about, of.instrument, asked.again),
            sighted=sighted,
        )
    except BaseException:
        of.source.close()
        raise


@dataclass(frozen=True, eq=False)
class _Opened:
    """A source of readings."""

    source: Source
    virtual: VirtualSource | None  #: Of a virtual instrument.
    nests: tuple[str, ...]
    known: tuple[str, ...]  #: Targets that it knows.
    instrument: str  #: What it is, in words.


def _source(asked: Measure, nominal: Robot, planned: _Plan, folder: Path) -> _Opened:
    """Open where readings come from."""
    nests = None if asked.nests is None else tuple(asked.nests)
    if asked.source == "device":
        virtual = virtual_source(asked, nominal, planned.joints, planned.before, nests or ())
        known = tuple(target.name for target in virtual.placed.targets)
        _refuse_unknown(asked.targets, known)
        words = f"a virtual {virtual.source.device.name} that measures a twin"
        return _Opened(virtual.source, virtual, nests or (), known, words)
    if asked.source == "watch":
        watched = watched_source(asked, planned.configurations.labels, folder)
        nests = tuple(watched.content.references) if nests is None else nests
        known = tuple(name for name in watched.names or () if name not in nests)
        return _Opened(watched, None, nests, known, f"files in {watched.folder}")
    from truearm.measuring.sources import Listener

    assert asked.listen is not None
    port = Listener(asked.listen, asked.token)
    return _Opened(port, None, nests or (), (), f"lines sent to port {port.port}")


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


# -- what was asked for ----------------------------------------------------------------------------------------


def _planned(path: Path, robot: Robot) -> _Plan:
    """Return the configurations of a plan, and their joint positions as the model counts them."""
    cells, joints = joints_in_file(path)
    n = len(joints.labels)
    if n < len(joints.of_row):
        raise InputError(
            "a configuration of the plan appears twice",
            where=cells.source,
            came=joints.labels[int(np.argmax(np.bincount(joints.of_row)))],
            cure="Give every row its own label: one row is one standstill.",
        )
    data = Dataset(
        source=cells.source,
        labels=joints.labels,
        joints=joints.joints,
        joint_kinds=joints.kinds,
        targets=("any",),
        configuration=np.arange(n),
        target=np.zeros(n, dtype=np.intp),
        position=np.full((n, 3), np.nan),
        joints_are=joints.joints_are,
    )
    at = cells.names.index(_READS) if _READS in cells.names else None
    reads = () if at is None else cells.columns[at]
    stops = joints.before
    before = None if stops is None else replace(data, joints=stops.joints, joint_kinds=stops.kinds)
    return _Plan(
        path,
        joints,
        in_model_joints(robot, data).joints,
        reads,
        None if before is None else in_model_joints(robot, before).joints,
    )


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
