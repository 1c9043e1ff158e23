"""A robot as one JSON object with everything a program needs, in SI units: schema ``truearm-model/1``."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from typing import Any, Final

from truearm.modeling.balancers import Balancer
from truearm.modeling.chain import Element
from truearm.modeling.effects.effect import Effect
from truearm.modeling.effects.joint_curve import JointCurve, curve_names
from truearm.modeling.parameters import Parameter
from truearm.modeling.robot import Robot

SCHEMA: Final = "truearm-model/1"


def model_json(robot: Robot, frames: str, left_out: Iterable[str]) -> str:
    """Return the JSON text of a robot.

    A frame is the product of its elements. An element turns (``R``) or slides (``T``) about or along x, y or z of the
    moving frame (``Rx`` to ``Tz``) or its own ``axis``, by ``value``, and by the position of ``joint`` (from 1) where
    it has one. Numbers are written so that they read back exactly.
    """
    content = {
        "truearm": SCHEMA,
        "name": robot.name,
        "title": robot.title,
        "source": robot.source,
        **({"simulated": True} if robot.simulated else {}),
        "units": {"length": "m", "angle": "rad", "force": "N", "mass": "kg"},
        "frames": frames,
        "left_out": list(left_out),
        "convention": robot.convention_name,
        "base": {"elements": _elements(robot, robot.base_elements)},
        "joints": [
            {
                "name": joint.name,
                "kind": joint.kind,
                "limits": None if joint.limits is None else list(joint.limits),
                "transmission_periods": joint.transmission_periods,
                "bearing": joint.bearing,
                "max_speed": joint.max_speed,
                "elements": _elements(robot, link),
            }
            for joint, link in zip(robot.joints, robot.link_elements, strict=True)
        ],
        "flange": {"elements": _elements(robot, robot.flange_elements)},
        "targets": [{"name": t.name, "elements": _elements(robot, t.chain.elements)} for t in robot.targets],
        "fixtures": [
            {"name": f.name, "kind": f.kind, "elements": _elements(robot, f.chain.elements)} for f in robot.fixtures
        ],
        "effects": [{"name": e.name, "parameters": _names(e)} for e in robot.effects],
        "curves": None,
        "masses": [
            {"link": m.joint, "mass": m.mass, "cog": list(m.cog), "inertia": list(m.inertia)} for m in robot.masses
        ],
        "balancers": [_balancer(b) for b in robot.balancers],
        "payload": {"mass": robot.payload.mass, "cog": list(robot.payload.cog)},
        "gravity": list(robot.gravity),
        "parameters": [_parameter(p) for p in robot.parameters.values() if p.group != JointCurve.name],
        "history": list(robot.history),
    }
    text = json.dumps(content, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    lines = ",\n  ".join(json.dumps(curve, allow_nan=False) for curve in _curves(robot))
    return text.replace('\n "curves": null', f'\n "curves": [\n  {lines}\n ]' if lines else '\n "curves": []', 1)


def _names(effect: Effect) -> list[str]:
    """Return the names of an effect's parameters; the hundreds of a curve stand in a place of their own."""
    return [] if effect.name == JointCurve.name else [p.name for p in effect.parameters]


def _curves(robot: Robot) -> Iterator[dict[str, Any]]:
    """Return what is known of each curve: of sine and cosine of 1, 2 .. periods in a turn, each an array."""
    for number in range(1, len(robot.joints) + 1):
        known = [robot.parameters[name] for name in curve_names(number) if name in robot.parameters]
        if known:
            yield {
                "joint": number,
                **{
                    field: {
                        "sin": [getattr(p, field) for p in known[0::2]],
                        "cos": [getattr(p, field) for p in known[1::2]],
                    }
                    for field in ("value", "prior", "deviation", "informed")
                },
            }


def _balancer(b: Balancer) -> dict[str, Any]:
    anchors = {name: {"link": a.link, "point": list(a.point)} for name, a in (("fixed", b.fixed), ("moving", b.moving))}
    return {"name": b.name, **anchors, "length": b.length, "force": b.force, "stiffness": b.stiffness}


def _elements(robot: Robot, elements: Iterable[Element]) -> list[dict[str, Any]]:
    found = []
    for element in elements:
        value = element.value if element.parameter is None else robot.values[element.parameter]
        entry: dict[str, Any] = {"motion": element.motion, "value": value}
        if element.axis is not None:
            entry["axis"] = list(element.axis)
        if element.parameter is not None:
            entry["parameter"] = element.parameter
        if element.variable is not None:
            entry["joint"] = element.variable + 1
        found.append(entry)
    return found


def _parameter(p: Parameter) -> dict[str, Any]:
    return {
        "name": p.name,
        "unit": p.unit,
        "group": p.group,
        "nominal": p.nominal,
        "value": p.value,
        "prior": p.prior,
        "deviation": p.deviation,
        "informed": p.informed,
    }
