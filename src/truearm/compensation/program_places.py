"""The tools and frames of a program's targets: where the controller has them, and where they really are."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from truearm.compensation.cell import Cell, Placed
from truearm.compensation.program_poses import place
from truearm.compensation.programs.program import Program
from truearm.errors import InputError, nearest_names
from truearm.modeling.chain import Array
from truearm.modeling.transform import IDENTITY

Kind = Literal["tool", "frame"]
#: Whether real places were given, or have to be assumed; or follow from base or flange, which the calibration held.
Provenance = Literal["identified", "assumed", "held"]
#: Where the nominal base, or flange, is in the identified one, ``(4, 4)``; or that for the targets in each frame.
Shift = Array | Mapping[str, Array]


def provenance(
    programs: Sequence[Program], cell: Cell, kind: Kind, kept: Sequence[Collection[int]] | None = None
) -> Provenance:
    """Return whether the real places of all tools or frames in use were given, or of none.

    Args:
        kept: Of each program the targets that stay, by their index: where their tools and frames are does not count.

    Raises:
        InputError: If only some of them were given, or none that the programs use.
    """
    given = cell.tools if kind == "tool" else cell.frames
    used: set[str] = set()
    needed: dict[str, str] = {}
    for program, staying in zip(programs, kept or [()] * len(programs), strict=True):
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
    if given and needed and not any(name.lower() in given for name in used):
        first = next(iter(needed))
        raise InputError(
            f"no {kind} that the programs use is in the file",
            parameter=f"{kind}s",
            where=needed[first],
            came=", ".join(sorted({name or own for name in given})),
            allowed=", ".join(name or own for name in needed),
            cure=f"Call the {kind}s in the file as the programs do, or leave out `{kind}s`.",
        )
    known = {name for name in used if given.get(name.lower(), Placed(None, None)).identified is not None}
    missing = [name for name in needed if name not in known]
    if known and missing:
        raise InputError(
            f"only some of the {kind}s in use have a real place in the file",
            parameter=f"{kind}s",
            where=needed[missing[0]],
            came=missing[0] or own,
            cure=f"Give it one too, or none of them: without any, {without}.",
        )
    return "identified" if known else "assumed"


class Places:
    """Where the frames, or the tools, of a program's targets are on the nominal and the real robot: ``(n, 4, 4)``."""

    def __init__(self, program: Program, given: dict[str, Placed], kind: Kind, own: Array) -> None:
        defined = {name.lower(): t for name, t in (program.tools if kind == "tool" else program.frames).items()}
        names = [(target.tool if kind == "tool" else target.frame).lower() for target in program.targets]
        unique = {name: number for number, name in enumerate(dict.fromkeys(names))}
        self._names = tuple(unique)
        self._index = np.array([unique[name] for name in names], dtype=int)
        nominal, real = [], []
        for name in unique:
            entry = given.get(name, Placed(None, None))
            here = IDENTITY if name == "" else defined.get(name, entry.controller)
            if here is None and entry.identified is not None:
                raise _measured_only(program, names.index(name), kind)
            if here is None:
                raise _undefined(program, name, names, kind, [*defined, *given])
            nominal.append(own @ here.matrix)
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
