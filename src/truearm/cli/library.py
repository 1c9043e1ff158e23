"""``truearm robots`` and ``truearm show``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from truearm.cli.output import Json, print_json

if TYPE_CHECKING:
    from truearm.modeling.robot import Robot


def robots(json: Json = False) -> None:
    """List the robots of the library."""
    from truearm.library import library, load_robot

    found = [load_robot(robot_id) for robot_id in library()]
    if json:
        rows = [{"id": r.name, "title": r.title, "joints": len(r.joints), "source": r.source} for r in found]
        print_json({"robots": rows})
        return
    width = max(len(r.name) for r in found)
    for r in found:
        typer.echo(f"{r.name:{width}}  {len(r.joints)} joints  {r.title}")


def show(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="A library id, a robot file or a URDF.")],
    json: Json = False,
) -> None:
    """Show a robot: its joints, its reach at zero, what is known about it."""
    from truearm.library import load_robot
    from truearm.modeling.parts import GRAVITY

    loaded = load_robot(robot)
    content = _content(loaded)
    if json:
        print_json(content)
        return
    typer.echo(f"{loaded.title} ({loaded.name})")
    typer.echo(f"Source: {loaded.source}")
    typer.echo(f"Convention: {loaded.convention_name}, lengths in mm, angles in deg")
    for joint in content["joints"]:
        row = "  ".join(f"{name} {value:g}" for name, value in joint["values"].items())
        limits = "  limits {:g} to {:g}".format(*joint["limits"]) if joint["limits"] else ""
        typer.echo(f"  {joint['name']} ({joint['type']})  {row}{limits}")
    x, y, z = content["flange_at_zero_mm"]
    typer.echo(f"Flange at zero readings, from the base: x {x:.3f}  y {y:.3f}  z {z:.3f} mm")
    if content["masses_kg"]:
        typer.echo(f"Link masses: {', '.join(f'{k} {v:g} kg' for k, v in content['masses_kg'].items())}")
    if content["payload"]["mass_kg"]:
        x, y, z = content["payload"]["cog_mm"]
        typer.echo(f"Payload: {content['payload']['mass_kg']:g} kg at x {x:g}  y {y:g}  z {z:g} mm of the flange")
    if loaded.gravity != GRAVITY:
        typer.echo("Free fall: {:g}, {:g}, {:g} m/s^2 in the base frame".format(*loaded.gravity))
    if content["controller"]:
        typer.echo(f"Controller: {content['controller'].get('source', 'as its file says')}")
        for line in _controller_lines(content["controller"], content["joints"]):
            typer.echo(f"  {line}")
    for key, label in (("effects", "Joint effects"), ("truths", "Truths for simulation"), ("targets", "Targets")):
        if content[key]:
            typer.echo(f"{label}: {', '.join(content[key])}")
    for line in loaded.history:
        typer.echo(f"History: {line}")


def _controller_lines(entry: dict[str, Any], joints: list[dict[str, Any]]) -> Iterator[str]:
    """Say what of a controller differs from the model; `entry` is what a robot file would say of it."""
    units = {joint["name"]: "deg" if joint["type"] == "revolute" else "mm" for joint in joints}
    for row in entry.get("joints", []):
        counted = [row["joint"], *(_share(value, name) for name, value in row.get("coupling", {}).items())]
        text = " + ".join(counted).replace("+ -", "- ")
        if "sign" in row:
            text = f"-({text})" if len(counted) > 1 else f"-{text}"
        if "zero" in row:
            text += f" {'-' if row['zero'] < 0 else '+'} {abs(row['zero']):g} {units[row['joint']]}"
        text += "".join(
            f", {row[f'pulses_per_{unit}']:.9g} pulses per {unit}"
            for unit in ("degree", "mm")
            if f"pulses_per_{unit}" in row
        )
        yield f"reading of {row['joint']} = {text}"
    for name in ("base", "flange"):
        if name in entry:
            x, y, z = entry[name]["translation"]
            quaternion = " ".join(f"{v:g}" for v in entry[name]["quaternion"])
            yield f"{name} frame at x {x:g}  y {y:g}  z {z:g} mm of the model's, quaternion {quaternion}"
    if entry.keys() <= {"source"}:
        yield "joints and frames are the model's"


def _share(value: float, name: str) -> str:
    return {1.0: name, -1.0: f"-{name}"}.get(value, f"{value:g} {name}")


def _content(robot: Robot) -> dict[str, Any]:
    import numpy as np

    from truearm.modeling.formats.controller_entry import controller_entry
    from truearm.simulation.truths import truth_names
    from truearm.units import SHOWN_AS, from_si, written

    shown = SHOWN_AS
    base = robot.base
    position, _ = robot.world_poses(np.zeros((1, len(robot.joints))))
    joints = []
    for number, joint in enumerate(robot.joints, 1):
        values = {
            p.name: from_si(p.value, shown[p.unit])
            for element in robot.link_elements[number - 1]
            if element.parameter is not None
            for p in [robot.parameters[element.parameter]]
        }
        unit = "deg" if joint.kind == "revolute" else "mm"
        limits = [from_si(v, unit) for v in joint.limits] if joint.limits else None
        joints.append({"name": joint.name, "type": joint.kind, "values": values, "limits": limits})
    return {
        "name": robot.name,
        "title": robot.title,
        "source": robot.source,
        "convention": robot.convention_name,
        "units": {"length": "mm", "angle": "deg"},
        "joints": joints,
        "flange_at_zero_mm": [
            round(float(v) * 1e3, 9) for v in base.rotation.T @ (position[0] - np.array(base.translation))
        ],
        "effects": list(robot.effect_names),
        "masses_kg": {f"link {m.joint}": m.mass for m in robot.masses},
        "payload": {
            "mass_kg": robot.payload.mass,
            "cog_mm": [written(v, "mm") for v in robot.payload.cog],
        },
        "gravity": list(robot.gravity),
        "controller": controller_entry(robot.controller, robot.joints),
        "tools": list(robot.tools),
        "truths": list(truth_names(robot)),
        "targets": [target.name for target in robot.targets],
        "history": list(robot.history),
    }
