"""Robots from one convention into another, with the same kinematics.

The joint axes of a robot are lines in space; every convention is a way to write such lines down. A conversion looks at
them at zero joint positions, with the current values, and writes them anew. Sense and zero of every joint stay, so
joint positions, limits and joint effects mean what they meant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from truearm.engine.base.errors import InputError, did_you_mean
from truearm.engine.robot.balancers import Anchor, Balancer
from truearm.engine.robot.chain import Array
from truearm.engine.robot.controller import ControllerKinematics
from truearm.engine.robot.conventions import convention
from truearm.engine.robot.conversion.links import (
    Links,
    cpc,
    dh,
    exponentials,
    hayati,
    joint_errors,
    mcpc,
    origins,
    s_model,
    translations,
    zero_reference,
)
from truearm.engine.robot.conversion.own_axes import in_its_axes
from truearm.engine.robot.lines import at_zero, base_and_flange, joint_axes
from truearm.engine.robot.parts import Inertia, Joint, LinkMass
from truearm.engine.robot.robot import Robot
from truearm.engine.robot.transform import Transform

CONVERSIONS: Final[Mapping[str, Callable[[Robot], Links]]] = {
    "standard-dh": partial(dh, convention_name="standard-dh"),
    "modified-dh": partial(dh, convention_name="modified-dh"),
    "hayati": partial(hayati, modified=False),
    "modified-hayati": partial(hayati, modified=True),
    "s-model": s_model,
    "cpc": cpc,
    "mcpc": mcpc,
    "zero-reference": zero_reference,
    "product-of-exponentials": exponentials,
    "translations": translations,
    "joint-errors": joint_errors,
    "urdf": origins,
}

#: A frame that moves by less [m, rad] has not moved, and a flange behind it that is as small is none.
_SAME_FRAME: Final = 1e-12
#: Decimals [m, rad] behind which there is only the rounding of right angles.
_DECIMALS: Final = 15
#: How far [cosine] the base's z may turn and still point where weights have been taken to hang from: 1 deg.
_UPRIGHT: Final = float(np.cos(np.radians(1.0)))


def converted(robot: Robot, convention_name: str) -> Robot:
    """Return a robot in another convention, every pose the same; its current values become the nominal ones.

    Targets, limits, joint effects, tools and payload stay. Link masses move with their links' frames. The base frame
    stays where the convention can start from it; one that starts on the first axis (DH, Hayati, S-model, CPC, MCPC)
    gets the frame on that axis which is nearest to the base, and gravity and the controller's base frame are given in
    it. If that turns the base's z, against which weights hang, by more than 1 deg, the masses are left out. Truths are
    left out too, because they are values of parameters that are no more. The robot's history says whether the base
    moved and what was left out.

    Raises:
        InputError: If there is no such convention, or the convention cannot describe the robot: axes that are nearly
            parallel in a DH table or the S-model.
    """
    if convention_name not in CONVERSIONS:
        raise InputError(
            "there is no such convention",
            where=robot.name,
            came=convention_name,
            allowed=", ".join(CONVERSIONS),
            cure=did_you_mean(convention_name, CONVERSIONS),
        )
    base, flange = base_and_flange(robot)
    links = CONVERSIONS[convention_name](robot)
    moved = links.base is not None and bool(np.abs(links.base - base).max() > _SAME_FRAME)
    stay = {
        name: p.restarted(p.value)
        for name, p in robot.known.items()
        if p.group not in ("geometry", "joint zero") and not (moved and p.group == "base")
    }
    controller = robot.controller
    if controller.kinematics.rows:  # a converted robot has lost the nominal values that they stand beside
        controller = replace(controller, kinematics=ControllerKinematics())
    result = replace(
        robot,
        convention_name=convention_name,
        controller=controller,
        joints=tuple(
            replace(joint, row=_tidy(row, convention(convention_name).row_units(joint.kind)))
            for joint, row in zip(robot.joints, links.rows, strict=True)
        ),
        flange=Transform(),
        masses=(),
        truths={},
        known=stay,
        proof=None,
    )
    if moved and links.base is not None:
        x, y, z = (round(float(v), _DECIMALS) + 0.0 for v in links.base[:3, :3].T @ base[:3, :3] @ robot.gravity)
        its = np.linalg.inv(links.base) @ base @ robot.controller.base.matrix
        controller = replace(controller, base=_transform(its))
        result = replace(_based(result, links.base), gravity=(x, y, z), controller=controller)
    behind = np.linalg.inv(at_zero(result, result.rigid.trunk.elements)) @ flange
    if np.abs(behind - np.eye(4)).max() > _SAME_FRAME:
        result = replace(result, flange=_transform(behind))
    upright = float(result.base.rotation[:, 2] @ base[:3, 2]) > _UPRIGHT
    lost = [
        *([f"truths {', '.join(robot.truths)}"] if robot.truths else []),
        *(["link masses, because the base's z has turned"] if robot.masses and not upright else []),
    ]
    remarks = [
        f"converted from {robot.convention_name} to {convention_name}",
        *(["the base frame now lies on the first axis"] if moved else []),
        *([f"left out: {' and '.join(lost)}"] if lost else []),
    ]
    result = in_its_axes(robot, result)
    return replace(
        result,
        joints=_with_bearings(robot, result),
        masses=_moved_masses(robot, result) if upright else (),
        balancers=tuple(_moved_balancer(balancer, robot, result) for balancer in robot.balancers),
        history=(*robot.history, "; ".join(remarks)),
    )


def _based(robot: Robot, base: Array) -> Robot:
    """Return the robot at another place ``T_world_base`` ``(4, 4)``."""
    place = _transform(base)
    turned = replace(robot, base_quaternion=place.quaternion)
    slides = zip(("base_x", "base_y", "base_z"), place.translation, strict=True)
    return turned.with_parameters(turned.parameters[name].restarted(value) for name, value in slides if value != 0.0)


def _transform(frame: Array) -> Transform:
    tidy = np.round(frame, _DECIMALS) + 0.0
    return Transform.from_matrix(tidy[:3, :3], tidy[:3, 3])


def _tidy(row: Mapping[str, float], units: Mapping[str, str]) -> dict[str, float]:
    """Return a row in the order of its columns, without the roundings of right angles."""

    def tidy(value: float, unit: str) -> float:
        rounded = round(value, _DECIMALS) + 0.0
        return rounded if unit == "m" or rounded == 0.0 else value

    return {column: tidy(row[column], unit) for column, unit in units.items() if column in row}


def _with_bearings(before: Robot, after: Robot) -> tuple[Joint, ...]:
    """Return the joints with their bearings where they were; origins of joints are elsewhere now.

    Bearings that nobody has stated stay unknown in a robot none of whose effects asks where they are.
    """
    tilts = any(effect.tilts for effect in before.effects)
    rows = zip(after.joints, before.bearings, joint_axes(before), joint_axes(after), strict=True)
    joints = []
    for joint, bearing, old, new in rows:
        if joint.kind == "revolute" and (tilts or joint.bearing is not None):
            along = float((old.point - new.point) @ new.along)
            joints.append(replace(joint, bearing=round(bearing + along, _DECIMALS) + 0.0))
        else:
            joints.append(joint)
    return tuple(joints)


def _moved_masses(before: Robot, after: Robot) -> tuple[LinkMass, ...]:
    masses = []
    for mass in before.masses:
        place = _link_frames(before, after, mass.joint)
        centre = before.axial_slides.stayed(mass.joint, mass.cog, before.values)
        x, y, z, _ = (round(float(v), _DECIMALS) + 0.0 for v in place @ [*centre, 1.0])
        masses.append(replace(mass, cog=(x, y, z), inertia=_turned(mass.inertia, place[:3, :3])))
    return tuple(masses)


def _moved_balancer(balancer: Balancer, before: Robot, after: Robot) -> Balancer:
    def moved(anchor: Anchor) -> Anchor:
        point = before.axial_slides.stayed(anchor.link, anchor.point, before.values)
        moved_point = _link_frames(before, after, anchor.link) @ [*point, 1.0]
        x, y, z, _ = (round(float(v), _DECIMALS) + 0.0 for v in moved_point)
        return replace(anchor, point=(x, y, z))

    return replace(balancer, fixed=moved(balancer.fixed), moving=moved(balancer.moving))


def _link_frames(before: Robot, after: Robot, link: int) -> Array:
    """Return the frame of a link (0 is the base) of one robot seen from that of the other, joints at zero."""
    old, new = (
        at_zero(r, [*r.base_elements, *(e for each in r.link_elements[:link] for e in each)]) for r in (before, after)
    )
    return np.asarray(np.linalg.inv(new) @ old)


def _turned(inertia: Inertia, R: Array) -> Inertia:
    xx, yy, zz, xy, xz, yz = inertia
    turned = np.round(R @ [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] @ R.T, _DECIMALS) + 0.0
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = turned.tolist()
    return xx, yy, zz, xy, xz, yz
