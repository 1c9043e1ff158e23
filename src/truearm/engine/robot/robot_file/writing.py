"""From a robot to a robot file."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Final

from truearm.engine.base.units import SHOWN_AS, written
from truearm.engine.robot.controller import AS_THE_MODEL
from truearm.engine.robot.parameters import Parameter
from truearm.engine.robot.parts import GRAVITY, NO_PAYLOAD, Joint, Truth
from truearm.engine.robot.proof import Proof, position_text
from truearm.engine.robot.robot_file.curve_entry import correlations_text, curve_entries
from truearm.engine.robot.robot_file.entries import NAME, balancer_entry, controller_entry, place_entry, reach_entry
from truearm.engine.robot.robot_file.schema import SCHEMA
from truearm.engine.robot.transform import Transform
from truearm.engine.robot.wrench import refuse_pushed

if TYPE_CHECKING:
    from ruamel.yaml.comments import CommentedMap, CommentedSeq

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
    return re.sub(f"(?<=[:-] ){token}([0-9]+)$", lambda match: rows[int(match[1])], stream.getvalue(), flags=re.M)


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
    curves, in_curves = curve_entries(robot.known, len(robot.joints))
    quaternion = robot.base_quaternion
    content: dict[str, Any] = {
        "truearm": SCHEMA,
        "name": robot.name,
        "title": robot.title,
        "maker": robot.maker or None,
        "source": robot.source,
        "units": _flow({"length": "mm", "angle": "deg"}),
        "convention": robot.convention_name,
        "joints": [_joint(robot, j) for j in robot.joints],
        "flange": None if robot.flange == Transform() else _flowing(place_entry(robot.flange)),
        "controller": None
        if robot.controller == AS_THE_MODEL
        else _flowing(controller_entry(robot.controller, robot.joints)),
        "masses": [
            _flow(
                {"link": m.joint, "mass": m.mass, "cog": _mm(m.cog)}
                | ({"inertia": _listed(m.inertia)} if any(m.inertia) else {})
            )
            for m in robot.masses
        ]
        or None,
        "balancers": [_flow(_on_its_line(balancer_entry(b))) for b in robot.balancers] or None,
        "payload": None
        if robot.payload == NO_PAYLOAD
        else _flow({"mass": robot.payload.mass, "cog": _mm(robot.payload.cog)}),
        "rated_load": robot.rated_load,
        "reach": None if robot.reach is None else _flow(reach_entry(robot.reach)),
        "gravity": None if robot.gravity == GRAVITY else _listed(robot.gravity),
        "tools": {
            name: {
                "targets": {_text(t): _mm(p) for t, p in tool.targets.items()},
                "mass": tool.mass,
                "cog": _mm(tool.cog),
            }
            for name, tool in robot.tools.items()
        }
        or None,
        "truths": {name: _truth(robot, truth) for name, truth in robot.truths.items()} or None,
        "priors": {{"m": "length", "rad": "angle"}[u]: written(v, SHOWN_AS[u]) for u, v in robot.priors.items()}
        or None,
        "effects": list(robot.effect_names) or None,
        "base_quaternion": None if quaternion == (1.0, 0.0, 0.0, 0.0) else _listed(quaternion),
        "targets": [
            _flow({"name": _text(t.name)} | ({"quaternion": _listed(t.quaternion)} if t.quaternion else {}))
            for t in robot.targets
        ]
        or None,
        "fixtures": [
            _flow(
                {"name": _text(f.name), "kind": f.kind}
                | ({} if f.kind == "point" else {"quaternion": _listed(f.quaternion)})
            )
            for f in robot.fixtures
        ]
        or None,
        "parameters": {
            _text(name): _flow(_parameter(robot.known[name]))
            for name in robot.parameters
            if name in robot.known and name not in in_curves
        }
        or None,
        "joint_curves": [
            {key: _quoted(part) if isinstance(part, str) else part for key, part in entry.items()} for entry in curves
        ]
        or None,
        "proof": None if robot.proof is None else _proof(robot, robot.proof),
        "simulated": robot.simulated or None,
        "history": list(robot.history) or None,
    }
    return {name: entry for name, entry in content.items() if entry is not None}


def _flow(content: Mapping[str, Any]) -> CommentedMap:
    """Return a table that is written on one line."""
    from ruamel.yaml.comments import CommentedMap

    mapping = CommentedMap(content)
    mapping.fa.set_flow_style()
    return mapping


def _listed(content: Iterable[Any]) -> CommentedSeq:
    """Return a list that is written on one line."""
    from ruamel.yaml.comments import CommentedSeq

    sequence = CommentedSeq(content)
    sequence.fa.set_flow_style()
    return sequence


def _mm(values: tuple[float, float, float]) -> CommentedSeq:
    return _listed([written(v, "mm") for v in values])


def _quoted(words: str) -> str:
    from ruamel.yaml.scalarstring import DoubleQuotedScalarString

    quoted: str = DoubleQuotedScalarString(words)
    return quoted


def _text(words: str) -> str:  # the writer leaves some texts without the quotes that its reader needs
    return words if re.fullmatch(NAME, words) else _quoted(words)


def _flowing(content: Any) -> Any:
    """Return an entry with its lists of numbers, and the rows of its tables, on one line each."""
    if isinstance(content, dict):
        return {key: _flowing(part) for key, part in content.items()}
    if isinstance(content, list):
        return [_flow(row) for row in content] if isinstance(content[0], dict) else _listed(content)
    return content


def _on_its_line(entry: Mapping[str, Any]) -> dict[str, Any]:
    """Return an entry whose tables and lists are written on its own line."""
    return {
        name: _flow(_on_its_line(part)) if isinstance(part, dict) else _listed(part) if isinstance(part, list) else part
        for name, part in entry.items()
    }


def _joint(robot: Robot, j: Joint) -> CommentedMap:
    units, unit = robot.convention.row_units(j.kind), "deg" if j.kind == "revolute" else "mm"
    vectors = [name for name in robot.convention.vectors if f"{name}_x" in j.row]
    entries = {c: written(v, SHOWN_AS[units[c]]) for c, v in j.row.items()}
    row: dict[str, Any] = {"name": j.name, "type": j.kind}
    row |= {name: _listed([entries.pop(f"{name}_{a}") for a in "xyz"]) for name in vectors} | entries
    if j.limits:
        row["limits"] = _listed([written(v, unit) for v in j.limits])
    if j.periods:
        periods = j.periods_entry
        row["transmission_periods"] = _listed(periods) if isinstance(periods, list) else periods
    if j.bearing is not None:
        row["bearing"] = written(j.bearing, "mm")
    if j.max_speed is not None:
        row["max_speed"] = written(j.max_speed, unit)
    return _flow(row)


def _truth(robot: Robot, truth: Truth) -> dict[str, Any]:
    content: dict[str, Any] = {
        "source": truth.source,
        "values": {n: written(v, SHOWN_AS[robot.parameters[n].unit]) for n, v in truth.values.items()},
        "compliance": dict(truth.compliance),
    }
    for kind, angles in (("backlash", truth.backlash), ("clearance", truth.clearance)):
        if angles:
            content[kind] = {n: written(v, SHOWN_AS["rad"]) for n, v in angles.items()}
    return content


def _parameter(p: Parameter) -> dict[str, Any]:
    unit = SHOWN_AS[p.unit]
    content: dict[str, Any] = {
        "unit": unit,
        "nominal": written(p.nominal, unit),
        "value": written(p.value, unit),
        "prior": written(p.prior, unit),
    }
    if p.deviation is not None:
        content["deviation"] = written(p.deviation, unit)
    if p.informed is not None:
        content["informed"] = p.informed
    return content


def _proof(robot: Robot, proof: Proof) -> dict[str, Any]:
    """Return the entry of a proof; of a robot that has other joints or parameters by now, without what needs them."""
    content: dict[str, Any] = {"status": proof.status}
    if proof.errors:
        content["errors"] = [{"code": error.code, "message": _text(error.message)} for error in proof.errors]
    if proof.warnings:
        content["warnings"] = [{"code": warning.code, "message": _text(warning.message)} for warning in proof.warnings]
    if proof.lower_bound:
        content["lower_bound"] = True
    if proof.held:
        content["held"] = _listed([_text(name) for name in proof.held])
    if len(proof.region) == len(robot.joints) and all(name in robot.parameters for name in proof.names):
        units = ["deg" if joint.kind == "revolute" else "mm" for joint in robot.joints]
        content["region"] = [_listed([written(v, u) for v in row]) for row, u in zip(proof.region, units, strict=True)]
        content["joint_error"] = _listed([written(v, u) for v, u in zip(proof.joint_error, units, strict=True)])
        if proof.loads:
            content["loads"] = [_listed(load) for load in proof.loads]
        content["deviations"] = _flow(
            {
                _text(name): written(deviation, SHOWN_AS[robot.parameters[name].unit])
                for name, deviation in zip(proof.names, proof.deviations, strict=True)
            }
        )
        correlations = correlations_text(proof.factor)
        content["correlations"] = (
            _text(correlations) if isinstance(correlations, str) else [_text(row) for row in correlations]
        )
        if proof.measured:
            content["measured"] = [
                _text(" ".join(position_text(v, u) for v, u in zip(row, units, strict=True))) for row in proof.measured
            ]
    content["sha256"] = proof.digest
    return content
