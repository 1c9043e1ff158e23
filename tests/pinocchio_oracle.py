"""Kinematics and dynamics of a chain by Pinocchio, sharing no code with ``Chain.sweep``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from truearm.engine.robot.chain import Array, Chain, Element

_UNIT = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Body:
    """A rigid body in the frame behind the first `place` elements of a chain; `inertia` is ``(3, 3)`` about its cog."""

    place: int
    mass: float
    cog: Array
    inertia: Array


def _axis(element: Element) -> Array:
    return np.array(element.axis if element.axis is not None else _UNIT[element.motion[1]])


def _placement(pin: Any, element: Element, amount: float) -> Any:
    axis = _axis(element)
    if element.motion[0] == "R":
        return pin.SE3(pin.AngleAxis(amount, axis).toRotationMatrix(), np.zeros(3))
    return pin.SE3(np.eye(3), amount * axis)


def _joint(pin: Any, element: Element) -> Any:
    if element.axis is not None:
        unaligned = pin.JointModelRevoluteUnaligned if element.motion == "R" else pin.JointModelPrismaticUnaligned
        return unaligned(_axis(element))
    kinds = {
        "Rx": pin.JointModelRX,
        "Ry": pin.JointModelRY,
        "Rz": pin.JointModelRZ,
        "Tx": pin.JointModelPX,
        "Ty": pin.JointModelPY,
        "Tz": pin.JointModelPZ,
    }
    return kinds[element.motion]()


class PinocchioChain:
    """A chain as a Pinocchio model: elements with a variable are joints, the others add up to placements."""

    def __init__(self, chain: Chain, values: Mapping[str, float], bodies: Sequence[Body] = ()) -> None:
        pin = pytest.importorskip("pinocchio")
        model = pin.Model()
        parent, placement = 0, pin.SE3.Identity()
        variables: list[int] = []
        for place, element in enumerate(chain.elements, 1):
            amount = element.value if element.parameter is None else values.get(element.parameter, element.value)
            placement = placement * _placement(pin, element, amount)
            if element.variable is not None:
                parent = model.addJoint(parent, _joint(pin, element), placement, f"joint_{len(variables)}")
                placement = pin.SE3.Identity()
                variables.append(element.variable)
            for body in bodies:
                if body.place == place and parent:
                    model.appendBodyToJoint(parent, pin.Inertia(body.mass, body.cog, body.inertia), placement)
        self._tip = model.addFrame(pin.Frame("tip", parent, placement, pin.FrameType.OP_FRAME))
        self._pin, self._model, self._variables = pin, model, variables

    def tip(self, variables: Array) -> tuple[Array, Array, Array]:
        """Return position (3,), rotation (3, 3) and Jacobian (6, joints), linear rows first, in the world.

        A column of the Jacobian belongs to an element with a variable, in the order of the chain.
        """
        pin, model = self._pin, self._model
        data = model.createData()
        q = np.array([variables[i] for i in self._variables], float)
        jacobian = np.array(pin.computeFrameJacobian(model, data, q, self._tip, pin.LOCAL_WORLD_ALIGNED)).reshape(6, -1)
        pin.framesForwardKinematics(model, data, q)
        place = data.oMf[self._tip]
        return np.array(place.translation), np.array(place.rotation), jacobian

    def reactions(self, q: Array, v: Array, a: Array, gravity: Array, wrench: Array) -> Array:
        """Return what holds each joint, force then moment in the frame behind the joint's element, ``(joints, 6)``.

        `wrench` is an external force and moment on the tip at its origin, in the axes of the world.
        """
        pin, model = self._pin, self._model
        data = model.createData()
        model.gravity.linear = gravity
        pin.framesForwardKinematics(model, data, q)
        external = [pin.Force.Zero() for _ in range(model.njoints)]
        arm = data.oMf[self._tip].translation
        moved = pin.Force(wrench[:3], wrench[3:] + np.cross(arm, wrench[:3]))
        external[-1] = data.oMi[model.njoints - 1].actInv(moved)
        pin.rnea(model, data, q, v, a, external)
        return np.array([data.f[i].vector for i in range(1, model.njoints)])

    def tip_motion(self, variables: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array]:
        """Return the tip's velocity and its derivative by time (6,), linear rows first, in the world."""
        pin, model = self._pin, self._model
        data = model.createData()
        given = (variables, velocity, acceleration)
        pin.forwardKinematics(model, data, *(np.array([row[i] for i in self._variables], float) for row in given))
        place = (model, data, self._tip, pin.LOCAL_WORLD_ALIGNED)
        return pin.getFrameVelocity(*place).vector, pin.getFrameClassicalAcceleration(*place).vector
