"""A campaign opened: what was asked for checked, what was fixed at the start written down or held against it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from truearm.arrays import finite_number
from truearm.errors import InputError, did_you_mean, refusals_of
from truearm.files import path_argument
from truearm.jobs.arguments import (
    command_argument,
    deviation_argument,
    folder_for,
    length_argument,
    name_argument,
    names_argument,
    payload_argument,
    robot_argument,
    whole_argument,
)
from truearm.jobs.measuring_begun import BEGUN, begin
from truearm.measurement.controller_joints import in_model_joints
from truearm.measurement.dataset import Dataset
from truearm.measurement.measuring.about import About, read_about
from truearm.measurement.measuring.campaign import Campaign
from truearm.measurement.measuring.reading_log import LOG
from truearm.measurement.measuring.readings import Quality
from truearm.measurement.measuring.session import LONGEST_ROUND, Session
from truearm.measurement.measuring.sources import Source
from truearm.measurement.readers.columns import joints_in_file
from truearm.measurement.readers.rows import Configurations
from truearm.modeling.chain import Array
from truearm.modeling.parts import Payload
from truearm.modeling.robot import Robot
from truearm.printable import is_one_line
from truearm.results.measured import DATA, PAGE, Measured

if TYPE_CHECKING:
    from truearm.measurement.measuring.watched_folder import WatchedFolder

_LONGEST_NAME: Final = 100
_MOST_DISTURBED: Final = 0.9
_MOST_SAMPLES: Final = 1_000_000


@dataclass(frozen=True, eq=False)
class Sight:
    """Lines of sight at the configuration that is measured next, or was measured last.

    Attributes
    ----------
    names
        Of the targets.
    origin
        Where the instrument is, in the world [m], ``(3,)``.
    targets
        Where the nominal robot has them [m], ``(k, 3)``.
    visible
        Which the instrument can read, ``(k,)``.
    outstanding
        Which are still to be measured, ``(k,)``.
    """

    names: tuple[str, ...]
    origin: Array
    targets: Array
    visible: NDArray[np.bool_]
    outstanding: NDArray[np.bool_]


class OpenCampaign(Campaign):
    """A campaign that knows its robot and plan, and writes what came of it.

    Attributes
    ----------
    robot
        The nominal robot.
    placed
        The same where a virtual instrument sees it; None for a real instrument, which nobody has placed.
    joints
        Of the plan, as the model counts them [rad or m], ``(n, joints)``.
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
    ) -> None:
        super().__init__(session, source, folder)
        self.robot, self.placed, self.joints = robot, placed, plan.joints
        self._plan, self._said, self._folder = plan, said, folder

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
    before: Array | None


@dataclass(frozen=True)
class _Said:
    about: About
    instrument: str
    command: str


def open_campaign(
    plan: str | Path,
    robot: Robot | str | Path,
    out: str | Path,
    *,
    device: str | None = None,
    truth: Robot | str | Path | None = None,
    noise: float | None = None,
    seed: int | None = None,
    disturbed: float | None = None,
    drift: float | None = None,
    payload: Payload | str | None = None,
    watch: str | Path | None = None,
    mapping: str | Path | None = None,
    listen: int | None = None,
    token: str | None = None,
    targets: Sequence[str] | None = None,
    nests: Sequence[str] | None = None,
    every: int = 10,
    most_deviation: float | None = None,
    most_settling: float | None = None,
    fewest_samples: int | None = None,
    about: str | Path | None = None,
    command: str | None = None,
) -> OpenCampaign:
    """Open the measuring of a plan; parameters as for :func:`truearm.measure`.

    Raises
    ------
    InputError
        If anything cannot be used, or the folder holds the measuring of another plan.
    """
    path = path_argument(plan, "plan")
    kind = _one_source(device, watch, listen)
    _refuse_beside(
        kind,
        device={
            "truth": truth,
            "noise": noise,
            "seed": seed,
            "disturbed": disturbed,
            "drift": drift,
            "payload": payload,
        },
        watch={"mapping": mapping},
        listen={"token": token},
    )
    call = command_argument(command) or f"truearm.measure({str(path)!r}, .., out={str(out)!r})"
    between = whole_argument(every, "every", 1, LONGEST_ROUND)
    folder_for((LOG, BEGUN), out, path, robot, truth, mapping, about)
    folder = folder_for((DATA, PAGE), out, path, robot, truth, mapping, about, ours=True)
    nominal = robot_argument(robot)
    with refusals_of("plan"):
        planned = _planned(path, nominal)
    said = About() if about is None else _about(about)
    asked = {name: _names(value, name) for name, value in (("targets", targets), ("nests", nests))}
    quality = Quality(
        None if most_deviation is None else length_argument(most_deviation, "most_deviation", 0.0),
        None if most_settling is None else length_argument(most_settling, "most_settling", 0.0),
        1 if fewest_samples is None else whole_argument(fewest_samples, "fewest_samples", 1, _MOST_SAMPLES),
    )
    source: Source
    placed: Robot | None = None
    virtual: dict[str, Any] | None = None
    if device is not None:
        made = _Virtual(
            name_argument(device, "device"),
            "random" if truth is None else truth,
            None if noise is None else deviation_argument(noise, "noise"),
            0 if seed is None else whole_argument(seed, "seed"),
            0.0 if disturbed is None else _share(disturbed),
            0.0 if drift is None else length_argument(drift, "drift", 0.0),
        )
        nests_named = asked["nests"] or ()
        source, placed = _virtual(made, nominal, payload, planned, nests_named)
        known: tuple[str, ...] | None = tuple(target.name for target in placed.targets)
        if asked["targets"] is not None and (unknown := [n for n in asked["targets"] if n not in (known or ())]):
            raise InputError(
                "the tool has no such target",
                parameter="targets",
                came=unknown[0],
                allowed=", ".join(known or ()),
                cure=did_you_mean(unknown[0], known or ()),
            )
        quality = _of_device(quality, source, most_deviation, most_settling, fewest_samples)
        virtual, instrument = made.entries(), f"a virtual {device} that measures a twin"
    elif watch is not None:
        folder_watched = _watched(watch, mapping, planned, folder)
        source, instrument = folder_watched, f"files in {folder_watched.folder}"
        references = tuple(folder_watched.content.references)
        nests_named = references if asked["nests"] is None else asked["nests"]
        fixed = folder_watched.names
        known = None if fixed is None else tuple(name for name in fixed if name not in nests_named)
    else:
        from truearm.measurement.measuring.listening import Listener

        source = Listener(whole_argument(listen, "listen", 0, 65535), _token(token))
        nests_named, known, instrument = asked["nests"] or (), None, f"lines sent to port {source.port}"
    try:
        names = asked["targets"] or tuple(target.name for target in nominal.targets if device is None) or known or ()
        _refuse_names(names, nests_named)
        session = Session(planned.configurations.labels, names, nests_named, between, quality)
        begin(folder, planned.configurations, planned.joints, nominal, session, virtual, said)
        return OpenCampaign(
            session,
            source,
            folder,
            robot=nominal,
            placed=placed,
            plan=planned,
            said=_Said(said, instrument, call),
        )
    except BaseException:
        source.close()
        raise


def sight(campaign: OpenCampaign) -> Sight | None:
    """Return the lines of sight at the configuration that is next; None where nobody knows where the robot stands."""
    from truearm.simulation.virtual_instrument import VirtualInstrument

    step, robot = campaign.session.next, campaign.placed
    if step is None or robot is None or not isinstance(campaign.source, VirtualInstrument):
        return None
    names = tuple(target.name for target in robot.targets)
    q = campaign.joints[step.configuration : step.configuration + 1]
    return Sight(
        names,
        np.zeros(3),
        np.array([robot.world_poses(q, name)[0][0] for name in names]),
        campaign.source.visible(step.configuration),
        np.array([step.kind == "configuration" and name in step.names for name in names]),
    )


def _share(disturbed: object) -> float:
    share = finite_number(disturbed, "disturbed", lowest=0.0)
    if share > _MOST_DISTURBED:
        raise InputError(
            "too many readings would be disturbed",
            parameter="disturbed",
            came=f"{share:g}",
            allowed=f"0 to {_MOST_DISTURBED:g}, a share",
        )
    return share


# -- what was asked for ----------------------------------------------------------------------------------------


def _one_source(device: object, watch: object, listen: object) -> str:
    given = [name for name, value in (("device", device), ("watch", watch), ("listen", listen)) if value is not None]
    if len(given) == 1:
        return given[0]
    raise InputError(
        "readings come from one source" if given else "nobody says where readings come from",
        parameter=", ".join(given) or "device, watch, listen",
        allowed="a virtual device, a folder to watch, or a port to listen on",
        cure="Keep one of them." if given else "Give one of them.",
    )


def _refuse_beside(kind: str, **options: dict[str, object]) -> None:
    for of, given in options.items():
        for name, value in given.items():
            if value is not None and of != kind:
                raise InputError(
                    f"this belongs to `{of}`, and readings come from `{kind}`", parameter=name, cure="Leave it out."
                )


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
    stops = found.before
    before = None if stops is None else replace(data, joints=stops.joints, joint_kinds=stops.kinds)
    return _Plan(
        path,
        found,
        in_model_joints(robot, data).joints,
        None if before is None else in_model_joints(robot, before).joints,
    )


def _about(about: object) -> About:
    path = path_argument(about, "about")
    with refusals_of("about"):
        return read_about(path)


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


def _token(token: object) -> str | None:
    if token is None:
        return None
    text = name_argument(token, "token")
    if not 16 <= len(text) <= 200 or not all(c.isascii() and (c.isalnum() or c in "-_") for c in text):
        raise InputError(
            "this is no token that keeps others out",
            parameter="token",
            allowed="16 to 200 letters, digits, - and _",
            cure="Leave it out: then one is made.",
        )
    return text


# -- sources ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Virtual:
    device: str
    truth: Robot | str | Path
    noise: float | None
    seed: int
    disturbed: float
    drift: float

    def entries(self) -> dict[str, Any]:
        """Return what must be the same when it goes on."""
        truth = self.truth.name if isinstance(self.truth, Robot) else Path(self.truth).name
        return {**self.__dict__, "truth": truth}


def _virtual(
    asked: _Virtual, nominal: Robot, payload: object, planned: _Plan, nests: tuple[str, ...]
) -> tuple[Source, Robot]:
    from truearm.simulation.devices import seen_by
    from truearm.simulation.truths import truth_twin
    from truearm.simulation.virtual_instrument import VirtualInstrument, virtual_device

    device = virtual_device(asked.device)
    with refusals_of("truth"):
        truth = asked.truth if isinstance(asked.truth, Robot) else str(path_argument(asked.truth, "truth"))
        twin = truth_twin(nominal, truth, np.random.default_rng(asked.seed))
    twin = replace(twin, robot=twin.robot.with_payload(payload_argument(payload)))
    twin, placed = seen_by(device, nominal, twin)
    source = VirtualInstrument(
        device,
        twin,
        placed,
        planned.joints,
        nests,
        asked.seed,
        asked.disturbed,
        asked.drift,
        asked.noise,
        planned.before,
    )
    return source, placed


def _of_device(quality: Quality, source: Any, *said: object) -> Quality:
    """Return what is asked of the readings of a virtual device: what is expected of it where nothing else is said."""
    from truearm.simulation.virtual_instrument import SAMPLES

    expected = Quality.of_instrument(source.sigma, SAMPLES)
    mine = [quality.deviation, quality.settling, quality.samples]
    usual = [expected.deviation, expected.settling, expected.samples]
    deviation, settling, samples = (
        theirs if given is None else own for own, theirs, given in zip(mine, usual, said, strict=True)
    )
    return Quality(deviation, settling, samples)  # type: ignore[arg-type]


def _watched(watch: object, mapping: object, planned: _Plan, out: Path) -> WatchedFolder:
    from truearm.measurement.measuring.watched_folder import WatchedFolder

    folder = path_argument(watch, "watch")
    if mapping is None:
        raise InputError(
            "nobody says what the columns of the rows mean",
            parameter="mapping",
            allowed="a mapping file, as `truearm import table` takes it",
            cure="Let `truearm import guess` write one for a file of the instrument.",
        )
    if folder.exists() and out.exists() and folder.resolve() == out.resolve():
        raise InputError(
            "the folder that is watched is written to", parameter="out", came=str(out), cure="Choose another."
        )
    with refusals_of("mapping"):
        return WatchedFolder(folder, path_argument(mapping, "mapping"), planned.configurations.labels)
