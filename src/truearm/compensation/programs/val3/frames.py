"""Staubli VAL3: frames and tools, which are chains of fathers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import Final, Literal

import numpy as np

from truearm.compensation.programs.program import Source
from truearm.compensation.programs.val3.data import Element, Variable
from truearm.errors import InputError
from truearm.modeling.orientations import MOVING_XYZ_ANGLES
from truearm.modeling.transform import IDENTITY, Transform

#: What the chains end at.
_GROUND: Final = {"frame": "world", "tool": "flange"}

#: Of an application: its variables by name, the names of those that its programs change, and its unit of length [m].
Application = tuple[Mapping[str, Variable], Set[str], float]


def name_of(variable: str, key: str) -> str:
    """Return the name of an element: of the first one, that of its variable."""
    return variable if key == "0" else f"{variable}[{key}]"


def father_of(element: Element, type_: Literal["frame", "tool"]) -> str:
    """Return the name of what an element is relative to, empty for the robot's own base or flange."""
    name = element.father.removesuffix("[0]")
    return "" if name == _GROUND[type_] else name


def transforms(
    type_: Literal["frame", "tool"], sources: Sequence[Source], applications: Sequence[Application]
) -> dict[str, Transform]:
    """Return the frames or tools by name, without those that a program changes or that rest on unknown ones."""
    found: dict[str, Transform] = {}
    for application in applications:
        for bare, variable in application[0].items():
            if variable.type != type_ or bare == _GROUND[type_]:
                continue
            for key, element in variable.elements.items():
                name = name_of(bare, key)
                transform = _chained(type_, sources, application, name)
                if transform is not None and found.setdefault(name, transform) != transform:
                    raise InputError(
                        f"{name} is not the same in two applications",
                        where=sources[variable.source].where(element.line),
                        cure="Correct the applications one by one.",
                    )
    return found


def _chained(
    type_: Literal["frame", "tool"], sources: Sequence[Source], application: Application, name: str
) -> Transform | None:
    """Return the product of a frame or tool and its fathers."""
    variables, changed, length = application
    chain: list[Transform] = []
    seen: set[str] = set()
    while name:
        bare, _, key = name.partition("[")
        variable = variables.get(bare)
        element = variable.elements.get(key.rstrip("]") or "0") if variable is not None else None
        if variable is None or element is None or variable.type != type_ or not element.father or bare in changed:
            return None
        if name in seen:
            sources[variable.source].refuse(element.line, f"{name} is its own father")
        seen.add(name)
        chain.append(_transform(element, length))
        name = father_of(element, type_)
    product = IDENTITY
    for transform in reversed(chain):
        product = _product(product, transform)
    return product


def _transform(element: Element, length: float) -> Transform:
    numbers = np.array(element.values)
    R = MOVING_XYZ_ANGLES.matrices(np.radians(numbers[None, 3:]))[0]
    return Transform.from_matrix(R, numbers[:3] * length)


def _product(first: Transform, second: Transform) -> Transform:
    R = first.rotation
    return Transform.from_matrix(R @ second.rotation, np.array(first.translation) + R @ np.array(second.translation))
