"""From a robot to a robot file."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

from truearm.engine.base.units import SHOWN_AS, written
from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.parts import GRAVITY, NO_PAYLOAD, Joint
from truearm.engine.robot.proof import Proof, position_text
from truearm.engine.robot.robot_file.curve_entry import correlations_text, curve_entries
from truearm.engine.robot.robot_file.entries import NAME, balancer_entry, controller_entry, place_entry, reach_entry
from truearm.engine.robot.robot_file.schema import SCHEMA
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import refuse_pushed

if TYPE_CHECKING:
    from truearm.engine.robot.robot import Robot

#: Texts that stand without quotes, but for words that are no texts in some YAML.
_PLAIN: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NO_TEXTS: Final = ("null", "true", "false", "yes", "no", "on", "off", "y", "n")
#: Beyond this many characters the general writer begins new lines.
_LONGEST_ROW: Final = 4000


def robot_text(robot: Robot) -> str:
    """Return the robot as the text of a robot file, in mm and degrees.

    Raises:
        InputError: If something acts on its tool, which a robot file does not hold.
    """
    refuse_pushed(robot)
    from ruamel.yaml import YAML

    yaml = YAML()
    yaml.width = 4096
    yaml.indent(mapping=2, sequence=4, offset=2)
    content, stream, rows = file_content(robot), io.StringIO(), list[str]()
    token = "row-"
    while token in f"{content}":
        token += "x-"
    yaml.dump(_without_rows(content, token, rows), stream)
    return re.sub(f"(?<=[:-] ){token}([0-9]+)$", lambda found: rows[int(found[1])], stream.getvalue(), flags=re.M)


def _without_rows(entry: Any, token: str, rows: list[str]) -> Any:
    """Return an entry with `token` and a number for each table on one line, whose texts are appended to `rows`.

    They are most of a robot file, and its general writer takes far longer for them.
    """
    from ruamel.yaml.comments import CommentedMap

    if isinstance(entry, CommentedMap) and entry.fa.flow_style():
        row = _row(entry)
        if row is None or len(row) > _LONGEST_ROW:
            return entry
        rows.append(row)
        return f"{token}{len(rows) - 1}"
    if type(entry) is dict:
        return {name: _without_rows(part, token, rows) for name, part in entry.items()}
    return [_without_rows(part, token, rows) for part in entry] if type(entry) is list else entry


def _row(entry: Any) -> str | None:
    """Return a table, a list or a value on one line; None where the general writer has to say how it is written."""
    if isinstance(entry, dict):
        pairs = [(_row(name), _row(part)) for name, part in entry.items()]
        known = all(name is not None and part is not None for name, part in pairs)
        return "{" + ", ".join(f"{name}: {part}" for name, part in pairs) + "}" if known else None
    if isinstance(entry, list):
        parts = [part for part in map(_row, entry) if part is not None]
        return f"[{', '.join(parts)}]" if len(parts) == len(entry) else None
    if type(entry) is float:
        return repr(entry) if math.isfinite(entry) else None
    if type(entry) is int:
        return repr(entry)
    return entry if type(entry) is str and _PLAIN.fullmatch(entry) and entry.lower() not in _NO_TEXTS else None


def file_content(robot: Robot) -> dict[str, Any]:
    """Return the entries of a robot file, as its writer takes them."""
    from ruamel.yaml.comments import CommentedMap, CommentedSeq
    from ruamel.yaml.scalarstring import DoubleQuotedScalarString

    def flow(content: Mapping[str, Any]) -> CommentedMap:
        made = CommentedMap(content)
        made.fa.set_flow_style()
        return made

    def listed(content: list[Any]) -> CommentedSeq:
        made = CommentedSeq(content)
        made.fa.set_flow_style()
        return made

    def flowing(content: Any) -> Any:
        """Return an entry with its lists of numbers, and the rows of its tables, on one line each."""
        if isinstance(content, dict):
            return {key: flowing(part) for key, part in content.items()}
        if isinstance(content, list):
            return [flow(row) for row in content] if isinstance(content[0], dict) else listed(content)
        return content

    def mm(values: tuple[float, float, float]) -> CommentedSeq:
        return listed([written(v, "mm") for v in values])

    def text(words: str) -> str:  # the writer leaves some texts without the quotes that its reader needs
        return words if re.fullmatch(NAME, words) else DoubleQuotedScalarString(words)

    shown = SHOWN_AS

    def joint(j: Joint) -> CommentedMap:
        row: dict[str, Any] = {"name": j.name, "type": j.kind}
        units = robot.convention.row_units(j.kind)
        vectors = [name for name in robot.convention.vectors if f"{name}_x" in j.row]
        entries = {c: written(v, shown[units[c]]) for c, v in j.row.items()}
        row |= {name: listed([entries.pop(f"{name}_{a}") for a in "xyz"]) for name in vectors} | entries
        if j.limits:
            row["limits"] = listed([written(v, "deg" if j.kind == "revolute" else "mm") for v in j.limits])
        if j.transmission_periods:
            row["transmission_periods"] = j.transmission_periods
        if j.bearing is not None:
            row["bearing"] = written(j.bearing, "mm")
        if j.max_speed is not None:
            row["max_speed"] = written(j.max_speed, "deg" if j.kind == "revolute" else "mm")
        return flow(row)

    content: dict[str, Any] = {
        "truearm": SCHEMA,
        "name": robot.name,
        "title": robot.title,
        **({"maker": robot.maker} if robot.maker else {}),
        "source": robot.source,
        "units": flow({"length": "mm", "angle": "deg"}),
        "convention": robot.convention_name,
        "joints": [joint(j) for j in robot.joints],
    }
    if robot.flange != Transform():
        content["flange"] = flowing(place_entry(robot.flange))
    if robot.controller != AS_THE_MODEL:
        content["controller"] = flowing(controller_entry(robot.controller, robot.joints))
    if robot.masses:
        content["masses"] = [
            flow(
                {"link": m.joint, "mass": m.mass, "cog": mm(m.cog)}
                | ({"inertia": listed(list(m.inertia))} if any(m.inertia) else {})
            )
            for m in robot.masses
        ]
    if robot.balancers:
        content["balancers"] = [flow(_flowing(balancer_entry(b), flow, listed)) for b in robot.balancers]
    if robot.payload != NO_PAYLOAD:
        content["payload"] = flow({"mass": robot.payload.mass, "cog": mm(robot.payload.cog)})
    if robot.rated_load is not None:
        content["rated_load"] = robot.rated_load
    if robot.reach is not None:
        content["reach"] = flow(reach_entry(robot.reach))
    if robot.gravity != GRAVITY:
        content["gravity"] = listed(list(robot.gravity))
    if robot.tools:
        content["tools"] = {
            name: {"targets": {text(t): mm(p) for t, p in tool.targets.items()}, "mass": tool.mass, "cog": mm(tool.cog)}
            for name, tool in robot.tools.items()
        }
    if robot.truths:
        content["truths"] = {
            name: {
                "source": truth.source,
                "values": {n: written(v, shown[robot.parameters[n].unit]) for n, v in truth.values.items()},
                "compliance": dict(truth.compliance),
                **{
                    kind: {n: written(v, shown["rad"]) for n, v in angles.items()}
                    for kind, angles in (("backlash", truth.backlash), ("clearance", truth.clearance))
                    if angles
                },
            }
            for name, truth in robot.truths.items()
        }
    if robot.priors:
        names = {"m": "length", "rad": "angle"}
        content["priors"] = {names[u]: written(v, shown[u]) for u, v in robot.priors.items()}
    if robot.effect_names:
        content["effects"] = list(robot.effect_names)
    if robot.base_quaternion != (1.0, 0.0, 0.0, 0.0):
        content["base_quaternion"] = listed(list(robot.base_quaternion))
    if robot.targets:
        content["targets"] = [
            flow({"name": text(t.name)} | ({"quaternion": listed(list(t.quaternion))} if t.quaternion else {}))
            for t in robot.targets
        ]
    if robot.fixtures:
        content["fixtures"] = [
            flow(
                {"name": text(f.name), "kind": f.kind}
                | ({} if f.kind == "point" else {"quaternion": listed(list(f.quaternion))})
            )
            for f in robot.fixtures
        ]
    curves, in_curves = curve_entries(robot.known, len(robot.joints))
    single = [name for name in robot.parameters if name in robot.known and name not in in_curves]
    if single:
        content["parameters"] = {text(name): flow(_parameter(robot.known[name], shown)) for name in single}
    if curves:
        content["joint_curves"] = [
            {key: DoubleQuotedScalarString(part) if isinstance(part, str) else part for key, part in entry.items()}
            for entry in curves
        ]
    if robot.proof is not None:
        content["proof"] = _proof(robot, robot.proof, flow, listed, text)
    if robot.simulated:
        content["simulated"] = True
    if robot.history:
        content["history"] = list(robot.history)
    return content


def _flowing(
    entry: Mapping[str, Any], flow: Callable[[Mapping[str, Any]], Any], listed: Callable[[list[Any]], Any]
) -> dict[str, Any]:
    """Return an entry whose tables and lists are written on its own line."""
    return {
        name: flow(_flowing(part, flow, listed))
        if isinstance(part, dict)
        else listed(part)
        if isinstance(part, list)
        else part
        for name, part in entry.items()
    }


def _parameter(p: Parameter, shown: Mapping[str, str]) -> dict[str, Any]:
    unit = shown[p.unit]
    made: dict[str, Any] = {
        "unit": unit,
        "nominal": written(p.nominal, unit),
        "value": written(p.value, unit),
        "prior": written(p.prior, unit),
    }
    if p.deviation is not None:
        made["deviation"] = written(p.deviation, unit)
    if p.informed is not None:
        made["informed"] = p.informed
    return made


def _proof(
    robot: Robot,
    proof: Proof,
    flow: Callable[[Mapping[str, Any]], Any],
    listed: Callable[[list[Any]], Any],
    text: Callable[[str], str],
) -> dict[str, Any]:
    """Return the entry of a proof; of a robot that has other joints or parameters by now, without what needs them."""
    made: dict[str, Any] = {"status": proof.status}
    if proof.errors:
        made["errors"] = [{"code": error.code, "message": text(error.message)} for error in proof.errors]
    if proof.warnings:
        made["warnings"] = [{"code": warning.code, "message": text(warning.message)} for warning in proof.warnings]
    if proof.lower_bound:
        made["lower_bound"] = True
    if proof.held:
        made["held"] = listed([text(name) for name in proof.held])
    if len(proof.region) == len(robot.joints) and all(name in robot.parameters for name in proof.names):
        units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
        made["region"] = [listed([written(v, u) for v in one]) for one, u in zip(proof.region, units, strict=True)]
        made["joint_error"] = listed([written(v, u) for v, u in zip(proof.joint_error, units, strict=True)])
        if proof.loads:
            made["loads"] = [listed([*one]) for one in proof.loads]
        made["deviations"] = flow(
            {
                text(name): written(deviation, SHOWN_AS[robot.parameters[name].unit])
                for name, deviation in zip(proof.names, proof.deviations, strict=True)
            }
        )
        found = correlations_text(proof.factor)
        made["correlations"] = text(found) if isinstance(found, str) else [text(row) for row in found]
        if proof.measured:
            made["measured"] = [
                text(" ".join(position_text(v, u) for v, u in zip(row, units, strict=True))) for row in proof.measured
            ]
    made["sha256"] = proof.digest
    return made
