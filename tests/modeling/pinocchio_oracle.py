"""Kinematics of a chain by Pinocchio, sharing no code with ``Chain.sweep``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from truearm.modeling.chain import Array, Chain, Element

_UNIT = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


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

    def __init__(self, chain: Chain, values: Mapping[str, float]) -> None:
        pin = pytest.importorskip("pinocchio")
        model = pin.Model()
        parent, placement = 0, pin.SE3.Identity()
        variables: list[int] = []
        for element in chain.elements:
            amount = element.value if element.parameter is None else values.get(element.parameter, element.value)
            placement = placement * _placement(pin, element, amount)
            if element.variable is not None:
                parent = model.addJoint(parent, _joint(pin, element), placement, f"joint_{len(variables)}")
                placement = pin.SE3.Identity()
                variables.append(element.variable)
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
