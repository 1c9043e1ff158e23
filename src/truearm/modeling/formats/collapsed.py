"""Robots with the constant transforms between their joint variables multiplied into one."""

from __future__ import annotations

from dataclasses import replace

from truearm.modeling.chain import Array, Element
from truearm.modeling.formats.urdf_tree import product
from truearm.modeling.robot import Robot


def collapsed(robot: Robot) -> tuple[list[Array], list[Array]]:
    """Return the constant transforms around the joint variables of `robot`, each ``(4, 4)``.

    Returns:
        origins: From one joint variable to the next, from the base on and to the flange at last. A joint's own value
            (its zero) belongs to the one before it, because the joint turns about that very axis.
        behind: From each joint variable to the end of its link, in whose frame its centre of gravity is given.
    """
    origins, behind = [], []
    pending: list[Element] = []
    for link in robot.link_elements:
        moving = next(i for i, element in enumerate(link) if element.variable is not None)
        own_zero = replace(link[moving], variable=None)
        origins.append(product([*pending, *link[:moving], own_zero], robot.values))
        pending = list(link[moving + 1 :])
        behind.append(product(pending, robot.values))
    return [*origins, product([*pending, *robot.flange_elements], robot.values)], behind
