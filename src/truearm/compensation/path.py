"""A path followed by a robot: its joint motion, corrected, and as programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truearm.compensation.corrected_path import (
    KNOWLEDGE,
    STAGES,
    TIP,
    CorrectedPath,
    Knowledge,
    correct_path,
    path_program,
)
from truearm.compensation.limit import (
    CorrectionLimit,
    check_size,
    controller_notices,
    controller_question,
    correction_limit,
    kinematics_file,
    ledger_of,
    ledger_to_write,
    refuse_proprietary_controller,
    with_controller,
)
from truearm.engine.base.errors import Notice, Rule, counted, listed, millimetres, refusals_of
from truearm.engine.base.files import path_argument
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    array_argument,
    files_of,
    folder_beside,
    joints_argument,
    pushed_argument,
    robot_argument,
    wrench_argument,
)
from truearm.engine.command.split import MAKER, accept_argument, changed_since, faults_of, refuse_unaccepted
from truearm.engine.command.texts import positions_of
from truearm.engine.diagnose.external_force import check_force
from truearm.engine.document.document import Block, detail, say, under
from truearm.engine.document.records import Record, joints_lines
from truearm.engine.motion.path_file import read_path
from truearm.engine.programs import BY_NAME
from truearm.engine.programs.chosen_targets import refuse_unanswered
from truearm.engine.programs.corrected_targets import LedgerEntry, corrected_digests, remember
from truearm.engine.programs.gauge import turns_between
from truearm.engine.programs.new_program import NewProgram
from truearm.engine.programs.program import Language, Source
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import JointsOf
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import homogeneous
from truearm.engine.robot.urdf_writing import counting, joint_cells, joint_headings

if TYPE_CHECKING:
    from truearm.compensation.jobs import FollowPath

#: Files that are always written.
MOTION: Final = "motion.csv"
REPORT: Final = "report.html"
#: Written for a calibrated robot, and for one with masses.
CORRECTED: Final = "corrected.csv"
LOADS: Final = "loads.csv"


@dataclass(frozen=True, eq=False, repr=False)
class FollowedPath(Record):
    """The joint motion along a path, and what corrects it."""

    robot: Robot  #: The robot, with what it carries.
    path: CorrectedPath  #: The path, its joint motions and the errors that the calibrated robot predicts along it.
    programs: Mapping[str, str]  #: Texts of programs by the names of their files.
    command: str  #: How to run it again.
    warnings: tuple[Notice, ...] = ()  #: What to know about it.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    #: Whose joint positions the files hold: the ``model``'s, or those that the ``controller`` shows.
    joints_are: JointsOf = "model"
    #: Where the targets of corrected programs are remembered, and what; None for nowhere.
    ledger: tuple[Path, tuple[LedgerEntry, ...]] | None = None

    @property
    def joints(self) -> Array:
        """Joint positions to command, of the model, ``(n, joints)`` [rad or m]."""
        return self.path.joints[self.path.best]

    @property
    def stages(self) -> tuple[Knowledge, ...]:
        """What the corrections that were made know, from nothing to most."""
        return tuple(name for name in KNOWLEDGE if name in self.path.joints)

    @property
    def answer(self) -> tuple[str, str]:
        """What the path is, and what can be said of its correction."""
        path = self.path
        trajectory = path.planned.trajectory
        first = (
            f"{counted(len(path.planned.kinds), 'section')} ({', '.join(path.planned.kinds)}), "
            f"{trajectory.distance[-1] * 1e3:.1f} mm in {trajectory.time[-1]:.2f} s, "
            f"{counted(len(trajectory.time), 'sample')}."
        )
        if not path.calibrated:
            return first, "The robot is not calibrated: there is nothing to correct."
        return first, (
            "What is left after the last correction is what the model says of itself: the real robot misses the path "
            "by the model's error."
        )

    def blocks(self) -> Iterator[Block]:
        """Give how long the path is, and how far the robot is from it before and after correction, in mm and s."""
        path, (first, last) = self.path, self.answer
        trajectory = path.planned.trajectory
        yield say(
            first,
            *(["Off the path, as the calibrated robot predicts it in motion:"] if path.calibrated else []),
            samples=len(trajectory.time),
            seconds=float(trajectory.time[-1]),
            length_mm=float(trajectory.distance[-1]) * 1e3,
            sections=list(path.planned.kinds),
            frame=path.planned.frame,
            calibrated=path.calibrated,
        )
        yield under("error_mm", (self._error(name) for name in self.stages if path.calibrated))
        yield (detail if path.calibrated else say)(last)
        yield detail(*joints_lines(self.joints_are), joints_are=self.joints_are, programs=list(self.programs))

    def _error(self, name: Knowledge) -> Block:
        error = self.path.errors[name] * 1e3
        mean, most = float(error.mean()), float(error.max())
        words = (
            f"  {STAGES[name]:<{max(len(STAGES[stage]) for stage in self.stages)}}  mean {mean:.3f}  max {most:.3f} mm"
        )
        return under(name, [say(words, mean=mean, max=most)])

    def motion_csv(self) -> str:
        """Return what the controller would command: time, section, joint positions, and where the tip shall be."""
        return self._csv(self.path.motion.joints, self.path.planned.trajectory.position, ())

    def corrected_csv(self) -> str:
        """Return the corrected joint positions, where the tip shall be, and the predicted error before and after."""
        path = self.path
        errors = (("error_before [mm]", path.errors["nothing"]), ("error_after [mm]", path.errors[path.best]))
        return self._csv(self.joints, path.planned.trajectory.position, errors)

    def loads_csv(self) -> str:
        """Return force and moment of the load at every joint along the path, in the joint's own axes."""
        loads = self.path.loads
        assert loads is not None
        names = [
            f"{kind}_{axis}_{joint} [{unit}]"
            for joint in range(1, len(loads) + 1)
            for kind, unit in (("force", "N"), ("moment", "N m"))
            for axis in "xyz"
        ]
        rows = loads.transpose(2, 0, 1).reshape(loads.shape[2], -1)
        return _table(
            ["time [s]", *names],
            [[repr(t), *(f"{v:.6g}" for v in row)] for t, row in zip(self._times(), rows.tolist(), strict=True)],
        )

    def contents(self) -> dict[str, str]:
        """Return the texts of all files by their names."""
        from truearm.compensation.path_page import path_page

        files = {MOTION: self.motion_csv()}
        if self.path.calibrated:
            files[CORRECTED] = self.corrected_csv()
        if self.path.loads is not None:
            files[LOADS] = self.loads_csv()
        return files | dict(self.programs) | {REPORT: path_page(self)}

    @property
    def written(self) -> tuple[str, ...]:
        """Names of all files."""
        return tuple(self.contents())

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write all files into a folder; return them."""
        contents = self.contents()
        out = output_folder(folder, contents, self.inputs, "folder")
        if self.ledger is not None:
            remember(*self.ledger)
        write_files(out, contents, self.command)
        return tuple(out / name for name in contents)

    def _times(self) -> list[float]:
        return [round(t, 9) for t in self.path.motion.time.tolist()]

    def _csv(self, joints: Array, tip: Array, errors: tuple[tuple[str, Array], ...]) -> str:
        controller = counting(self.robot, self.joints_are)
        heading = ["time [s]", "section", *joint_headings(self.robot.joints, controller)]
        heading += [f"tip_{axis} [mm]" for axis in "xyz"] + [name for name, _ in errors]
        cells = joint_cells(joints, self.robot.joints, controller)
        millimetres = np.round(tip * 1e3, 6) + 0.0
        rows = []
        for row, time in enumerate(self._times()):
            cell = [repr(time), str(int(self.path.planned.section[row])), *cells[row]]
            rows.append([*cell, *map(repr, millimetres[row].tolist()), *(f"{v[row] * 1e3:.6f}" for _, v in errors)])
        return _table(heading, rows)


def _table(heading: list[str], rows: list[list[str]]) -> str:
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heading)
    writer.writerows(rows)
    return stream.getvalue()


#: A program that leaves the path by no more than this between its targets is said nothing of [m].
_FAR = 0.02e-3


def follow(asked: FollowPath) -> FollowedPath:
    """Follow a path, correct it, and write what was asked for."""
    chosen = [BY_NAME[name] for name in (BY_NAME if "all" in asked.languages else asked.languages)]
    inputs = (asked.robot, asked.file, *kinematics_file(asked.controller_kinematics))
    folder = None
    if asked.out is not None:
        folder = folder_beside((MOTION, CORRECTED, LOADS, REPORT), MOTION, asked.out, *inputs)
    pushed = wrench_argument(asked.wrench, asked.wrench_frame)
    allowed = None
    if asked.accept_correction is not None:
        allowed = CorrectionLimit.of(asked.accept_correction, "accept_correction")
    calibrated = with_controller(robot_argument(asked.robot), asked.controller_kinematics, "controller_kinematics")
    arm = pushed_argument(asked.loads.on(calibrated), pushed)
    accepted = accept_argument(asked.accept, arm)
    if chosen:
        refuse_unaccepted(arm, accepted)
    joints_are = joints_argument(asked.joints, arm)
    followed = _followed(asked, arm, joints_are)
    notices = [*changed_since(asked.robot), *faults_of(arm), *check_force([(arm, followed.joints[followed.best])])]
    if chosen and followed.calibrated:
        notices += _check_size(followed, correction_limit(calibrated), allowed)
    texts = _texts(asked, arm, followed, chosen, notices)
    ledger = None
    if chosen and followed.calibrated:
        ledger, unremembered = ledger_to_write(ledger_of(asked.robot))
        notices += unremembered
    result = FollowedPath(
        arm,
        followed,
        texts,
        asked.again,
        tuple(dict.fromkeys(notices)),
        files_of(*inputs),
        joints_are,
        None if ledger is None else (ledger, _entries(arm, chosen, texts)),
    )
    if folder is not None:
        result.save(folder)
    return result


def _followed(asked: FollowPath, arm: Robot, joints_are: JointsOf) -> CorrectedPath:
    near = None
    if asked.seed_joints is not None:
        seed = positions_of(asked.seed_joints, arm, joints_are, "seed_joints")
        near = array_argument(seed, "seed_joints", (len(arm.joints),), f"{len(arm.joints)} numbers, one for each joint")
    with refusals_of("file"):
        return correct_path(arm, read_path(path_argument(asked.file, "file")), near)


def _texts(
    asked: FollowPath, arm: Robot, followed: CorrectedPath, chosen: Sequence[Language], notices: list[Notice]
) -> dict[str, str]:
    """Return the texts of the programs, and add what is to be said of them."""
    if not chosen:
        return {}
    with refusals_of("name" if asked.move_to == "joints" else "move_to"):
        content = path_program(followed, arm, asked.name, targets=asked.move_to, spacing=asked.spacing)
        return _programs(arm, content, chosen, notices)


def _check_size(followed: CorrectedPath, limit: CorrectionLimit, accepted: CorrectionLimit | None) -> list[Notice]:
    """Refuse a correction that errors of the robot do not explain, or say that it was accepted."""
    before, after = (
        homogeneous(rotation, position)
        for position, rotation in (
            followed.nominal.forward(followed.joints[name], target=TIP) for name in ("nothing", followed.best)
        )
    )
    turned = np.linalg.norm(turns_between(before, after), axis=1)
    trajectory = followed.planned.trajectory
    return check_size(
        np.linalg.norm(after[:, :3, 3] - before[:, :3, 3], axis=1),
        turned if followed.planned.orientation == "full" else np.zeros_like(turned),
        limit,
        accepted,
        where=lambda row: f"{followed.planned.source}, {trajectory.distance[row] * 1e3:.1f} mm along the path",
        check="Check the payload, the force, and that the calibration is of this robot.",
        parameter="file",
    )


def _entries(arm: Robot, languages: Sequence[Language], texts: Mapping[str, str]) -> tuple[LedgerEntry, ...]:
    """Return what is remembered of corrected programs."""
    sources = [Source(Path(file), text) for file, text in texts.items()]
    day = date.today().isoformat()
    return tuple(
        LedgerEntry(program=str(path), date=day, robot=arm.name, targets=corrected_digests((), targets))
        for language in languages
        for program in language.programs(
            [source for source in sources if source.path.suffix.lower() in language.suffixes]
        )
        for path, targets in program.by_file().items()
    )


BETWEEN_TARGETS: Final = Rule(
    "between-targets",
    "warning",
    "between its targets the program leaves the path by more than 0.02 mm",
    cure="Take a smaller `spacing`.",
)
UNTIMED_MOVES: Final = Rule(
    "untimed-moves",
    "note",
    "the language cannot say how long a joint motion takes, so what motion adds to the loads may be another",
    cure="Write `move_to=poses`, or run the program slowly.",
)


def _programs(arm: Robot, content: NewProgram, languages: Sequence[Language], notices: list[Notice]) -> dict[str, str]:
    """Return the files of a program in every language, and add what is to be said of them."""
    texts: dict[str, str] = {}
    for language in languages:
        assert language.new is not None
        files = language.new(content)
        theirs = not arm.maker or language.runs_on(arm.maker)
        if content.corrected and theirs:
            as_read = [language.read([Source(Path(file), text) for file, text in files.items()])]
            refuse_proprietary_controller(arm, as_read)
            refuse_unanswered([controller_question(arm, as_read)])
            notices += controller_notices(arm, as_read)
        texts |= files
    foreign = [dialect for dialect in languages if arm.maker and not dialect.runs_on(arm.maker)]
    if foreign:
        written = ", ".join(f"{dialect.name} of {dialect.makers[0]}" for dialect in foreign)
        notices.append(MAKER(f"{arm.name} is of {arm.maker}, and programs were written in {written}."))
    if content.beside > _FAR:
        notices.append(
            BETWEEN_TARGETS(
                f"Between its targets the program leaves the path by up to {millimetres(content.beside)} mm."
            )
        )
    untimed = [dialect.name for dialect in languages if content.untimed(dialect.name)]
    if untimed:
        notices.append(
            UNTIMED_MOVES(
                f"{listed(untimed)} cannot say how long a joint motion takes: the robot goes as fast as it is set to, "
                "and what motion adds to the loads is another than was corrected."
            )
        )
    return texts
