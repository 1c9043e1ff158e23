"""From the numbers of a program's targets to poses and joints, and back; its tools and frames."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truearm.engine.base.errors import InputError, nearest_names
from truearm.engine.programs.cell import Cell, Placed
from truearm.engine.programs.program import Edit, Form, Program, ProgramTarget, rewritten
from truearm.engine.robot.chain import Array
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import IDENTITY, homogeneous


def poses_of(program: Program) -> Array:
    """Return the poses of targets in their frames, ``(n, 4, 4)`` [m]; NaN where a target is given by joints."""
    targets = program.targets
    poses = np.full((len(targets), 4, 4), np.nan)
    for form, rows in _by_form(targets):
        if form.kind == "pose":
            poses[rows] = _poses(form, np.array([targets[row].values for row in rows]))
    for generation in _generations(targets):
        for row in generation:
            target, offset = targets[row], poses[row].copy()
            parent = poses[target.parent]
            poses[row] = parent @ offset
            if not target.turned:
                poses[row, :3, 3] = parent[:3, 3] + offset[:3, 3]
    return poses


def joints_of(robot: Robot, program: Program) -> Array:
    """Return the joint positions of the model for targets given by joints, ``(n, joints)`` [rad or m]; else NaN.

    Raises:
        InputError: If a target has not as many joints as the robot, or its pulses are not known.
    """
    targets = program.targets
    joints = np.full((len(targets), len(robot.joints)), np.nan)
    for form, rows in _by_form(targets):
        if form.kind == "pose":
            continue
        for row in rows:
            if len(targets[row].values) != len(robot.joints):
                raise InputError(
                    "the target has not as many joints as the robot",
                    where=place(program, targets[row]),
                    came=f"{len(targets[row].values)} joints",
                    allowed=f"{len(robot.joints)} for {robot.name}",
                )
        values = np.array([targets[row].values for row in rows])
        if form.kind == "pulses":
            counted = robot.controller.from_pulses(values)
        else:
            counted = values * _joint_units(robot, form)
        joints[rows] = robot.controller.to_model(counted)
    return joints


def offsets_in_order(program: Program) -> Iterator[int]:
    """Go through the targets that are offsets, each after the one that it is an offset from."""
    for generation in _generations(program.targets):
        yield from generation


def place(program: Program, target: ProgramTarget) -> str:
    """Return where a target stands, for a message."""
    return program.sources[target.source].where(target.line)


def pose_numbers(program: Program, before: Array, after: Array, rows: NDArray[np.intp]) -> dict[int, Array]:
    """Return new numbers of some targets given by poses, by their index, in the units of their forms.

    Args:
        before, after: Poses of all targets in their frames, ``(n, 4, 4)`` [m], as the program has them and as it shall.
        rows: Which targets.
    """
    targets = program.targets
    offsets = after.copy()
    for row in rows:
        target = targets[row]
        if target.parent is not None:
            parent = after[target.parent]
            offsets[row] = np.linalg.inv(parent) @ after[row]
            if not target.turned:
                offsets[row, :3, 3] = after[row, :3, 3] - parent[:3, 3]
    by_row: dict[int, Array] = {}
    for form, members in _by_form(targets, rows):
        if form.kind == "pose":
            numbers = numbers_of(form, offsets[members], np.array([targets[row].values for row in members]))
            by_row |= dict(zip(members.tolist(), numbers, strict=True))
    return by_row


def joint_numbers(robot: Robot, program: Program, joints: Array, rows: NDArray[np.intp]) -> dict[int, Array]:
    """Return new numbers of some targets given by joints, as :func:`pose_numbers`; `joints` are those of all."""
    by_row: dict[int, Array] = {}
    for form, members in _by_form(program.targets, rows):
        if form.kind == "pose":
            continue
        counted = robot.controller.from_model(joints[members])
        if form.kind == "pulses":
            numbers = robot.controller.to_pulses(counted)
        else:
            numbers = counted / _joint_units(robot, form)
        by_row |= dict(zip(members.tolist(), numbers, strict=True))
    return by_row


def numbers_of(form: Form, poses: Array, near: Array) -> Array:
    """Return the numbers of poses ``(n, 4, 4)``, of all the writings of an orientation the one nearest to `near`."""
    position = poses[:, :3, 3] / form.length
    if form.orientation is None:
        return np.asarray(position)
    turned = form.orientation.numbers(poses[:, :3, :3], near[:, 3:] * form.angle) / form.angle
    return np.concatenate([position, turned], axis=1)


def edits_of(program: Program, numbers: dict[int, Array]) -> list[Edit]:
    """Return what changes in the text when targets get new numbers; a number that stays the same is not among it."""
    edits = []
    for index, new in numbers.items():
        target = program.targets[index]
        text, (lengths, others) = program.sources[target.source].text, target.form.decimals
        fewest = [lengths] * 3 + [others] * (len(new) - 3) if target.form.kind == "pose" else [others] * len(new)
        for number, (span, value, decimals) in enumerate(zip(target.places, new.tolist(), fewest, strict=True)):
            if span is not None:
                old = text[span[0] : span[1]] or "0"
                word = rewritten(old, value, decimals)
                if word != old:
                    absent = span[0] == span[1]
                    edits.append(
                        Edit(target.source, *span, target.form.absent[number].format(word) if absent else word)
                    )
    return edits


def after_edits(targets: Sequence[ProgramTarget], edits: Sequence[Edit]) -> list[ProgramTarget] | None:
    """Return targets as they are read when their numbers are edited; None where only reading tells.

    That is where a number has no place of its own in the text, or gets one.
    """
    if not all(all(target.places) for target in targets) or any(edit.start == edit.stop for edit in edits):
        return None
    words: dict[int, dict[int, str]] = {}
    for source, start, _, text in edits:
        words.setdefault(source, {})[start] = text
    new = []
    for target in targets:
        own = words.get(target.source, {})
        numbers = zip(target.values, target.places, strict=True)
        new.append(replace(target, values=tuple([float(own.get(span[0], old)) for old, span in numbers if span])))
    return new


def _poses(form: Form, values: Array) -> Array:
    turned = np.eye(3) if form.orientation is None else form.orientation.matrices(values[:, 3:] * form.angle)
    return homogeneous(turned, values[:, :3] * form.length)


def _joint_units(robot: Robot, form: Form) -> Array:
    return np.array([form.angle if joint.kind == "revolute" else form.length for joint in robot.joints])


def _by_form(
    targets: Sequence[ProgramTarget], rows: NDArray[np.intp] | None = None
) -> Iterator[tuple[Form, NDArray[np.intp]]]:
    groups: dict[int, tuple[Form, list[int]]] = {}
    for row in range(len(targets)) if rows is None else rows.tolist():
        form = targets[row].form
        groups.setdefault(id(form), (form, []))[1].append(row)
    for form, members in groups.values():
        yield form, np.array(members)


def _generations(targets: Sequence[ProgramTarget]) -> Iterator[list[int]]:
    """Return the targets that are offsets, those of offsets after these."""
    known = {row for row, target in enumerate(targets) if target.parent is None}
    left = [row for row in range(len(targets)) if row not in known]
    while left:
        ready = [row for row in left if targets[row].parent in known]
        if not ready:  # an offset from itself
            raise ValueError("offsets in a circle")
        yield ready
        known.update(ready)
        left = [row for row in left if row not in known]


# The tools and frames of a program's targets: where the controller has them, and where they really are.
Kind = Literal["tool", "frame"]
#: Whether real places were given, or have to be assumed; or follow from base or flange, which the calibration held.
Provenance = Literal["identified", "assumed", "held"]
#: Where the nominal base, or flange, is in the identified one, ``(4, 4)``; or that for the targets in each frame.
Shift = Array | Mapping[str, Array]


def provenance(
    programs: Sequence[Program], cell: Cell, kind: Kind, kept_rows: Sequence[Collection[int]] | None = None
) -> Provenance:
    """Return whether the real places of all tools or frames in use were given, or of none.

    Args:
        kept_rows: Of each program the targets that stay, by index: where their tools and frames are does not count.

    Raises:
        InputError: If only some of them were given, or none that the programs use.
    """
    placed = cell.tools if kind == "tool" else cell.frames
    used: set[str] = set()
    needed: dict[str, str] = {}
    for program, staying in zip(programs, kept_rows or [()] * len(programs), strict=True):
        for row, target in enumerate(program.targets):
            if row in staying:
                continue
            name = target.tool if kind == "tool" else target.frame
            used.add(name)
            if name not in needed and (kind == "tool" or target.form.kind == "pose"):
                needed[name] = place(program, target)
    own, without = {
        "tool": ("flange", "the flange is taken to be where it agrees best with the nominal one"),
        "frame": ("base", "the base is shifted so that the targets do not move on average"),
    }[kind]
    if placed and needed and not any(name.lower() in placed for name in used):
        first = next(iter(needed))
        raise InputError(
            f"no {kind} that the programs use is in the file",
            parameter=f"{kind}s",
            where=needed[first],
            came=", ".join(sorted({name or own for name in placed})),
            allowed=", ".join(name or own for name in needed),
            cure=f"Call the {kind}s in the file as the programs do, or leave out `{kind}s`.",
        )
    known = {name for name in used if placed.get(name.lower(), Placed(None, None)).identified is not None}
    missing = [name for name in needed if name not in known]
    if known and missing:
        raise InputError(
            f"only some of the {kind}s in use have a real place in the file",
            parameter=f"{kind}s",
            where=needed[missing[0]],
            came=missing[0] or own,
            cure=f"Give it one too, or none of them: without any, {without}.",
        )
    if kind == "tool" and not needed and any(entry.identified is not None for entry in placed.values()):
        return "identified"  # no target that is corrected has one
    return "identified" if known else "assumed"


class Places:
    """Where the frames, or the tools, of a program's targets are on the nominal and the real robot: ``(n, 4, 4)``."""

    def __init__(self, program: Program, placed: dict[str, Placed], kind: Kind, own: Array) -> None:
        defined = {name.lower(): t for name, t in (program.tools if kind == "tool" else program.frames).items()}
        names = [(target.tool if kind == "tool" else target.frame).lower() for target in program.targets]
        unique = {name: number for number, name in enumerate(dict.fromkeys(names))}
        self._names = tuple(unique)
        self._index = np.array([unique[name] for name in names], dtype=int)
        nominal, real = [], []
        for name in unique:
            entry = placed.get(name, Placed(None, None))
            transform = IDENTITY if name == "" else defined.get(name, entry.controller)
            if transform is None and entry.identified is not None:
                raise _measured_only(program, names.index(name), kind)
            if transform is None:
                raise _undefined(program, name, names, kind, [*defined, *placed])
            nominal.append(own @ transform.matrix)
            real.append(None if entry.identified is None else entry.identified.matrix)
        self._nominal = np.array(nominal).reshape(-1, 4, 4)
        self._real: list[Array | None] = real

    @property
    def nominal(self) -> Array:
        """In the base or flange of the nominal robot."""
        return np.asarray(self._nominal[self._index])

    @property
    def measured(self) -> Array | None:
        """Where the nominal base or flange is in the identified one by the first place that was measured."""
        pairs = zip(self._nominal, self._real, strict=True)
        return next((real @ np.linalg.inv(nominal) for nominal, real in pairs if real is not None), None)

    @property
    def names(self) -> tuple[str, ...]:
        """What they are called, in small letters."""
        return self._names

    def among(self, names: Collection[str]) -> NDArray[np.bool_]:
        """Return which targets have one of these names, ``(n,)``."""
        return np.asarray(np.array([name in names for name in self._names], dtype=bool)[self._index])

    def numbers(self, names: Sequence[str]) -> NDArray[np.intp]:
        """Return the place of each target's name among names of all programs, ``(n,)``; 0 if there are none."""
        number = {name: index for index, name in enumerate(names)}
        return np.asarray(np.array([number.get(name, 0) for name in self._names], dtype=np.intp)[self._index])

    def apart(self, shift: Array) -> dict[str, float]:
        """Return how far those that were measured are from the nominal ones [m], by name, with the shift of these."""
        every = zip(self._names, self._nominal, self._real, strict=True)
        return {
            name: float(np.linalg.norm(real[:3, 3] - (shift @ nominal)[:3, 3]))
            for name, nominal, real in every
            if real is not None
        }

    def real(self, rows: NDArray[np.intp], shift: Shift) -> Array:
        """Return them in the identified base or flange; where it was not measured, with the shift that is assumed."""
        every = []
        for name, nominal, real in zip(self._names, self._nominal, self._real, strict=True):
            by = shift[name] if isinstance(shift, Mapping) else shift
            every.append(by @ nominal if real is None else real)
        return np.asarray(np.reshape(every, (-1, 4, 4))[self._index[rows]])


def _measured_only(program: Program, row: int, kind: Kind) -> InputError:
    """Return the refusal of a measured place beside which nothing says what the controller has."""
    target = program.targets[row]
    pendant = {"tool": "UTOOL, TOOL_DATA, TCP", "frame": "UFRAME, BASE_DATA, wobjdata"}[kind]
    return InputError(
        f"the file says where this {kind} was measured, and nothing says which numbers the controller has for it",
        parameter=f"{kind}s",
        where=place(program, target),
        came=target.tool if kind == "tool" else target.frame,
        cure=f"Read its numbers on the pendant ({pendant}) and write them into the entry, as in controller: "
        f"{{translation: [..], wpr: [..]}}; or give the file that defines the {kind} along with the program. If the "
        "numbers of the entry are the controller's own and nothing was measured, write of: controller.",
    )


def _undefined(program: Program, name: str, names: list[str], kind: str, known: list[str]) -> InputError:
    target = program.targets[names.index(name)]
    near = nearest_names(name, known)
    return InputError(
        f"this {kind} is used and never defined",
        parameter=f"{kind}s",
        where=place(program, target),
        came=target.tool if kind == "tool" else target.frame,
        cure=(f"Did you mean {' or '.join(near)}? " if near else "")
        + f"Give the file that defines it along with the program, or say with `{kind}s` where the controller has it.",
    )
