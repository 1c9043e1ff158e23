"""What each parameter does to the pose of the tip, and identification by that beside the standard one."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from truearm.engine.base.errors import InputError, Notice, Rule, counted, listed, refusals_of
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import SHOWN_AS, Marked, from_si, parts_of
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    choice_argument,
    files_of,
    folder_beside,
    readings_argument,
    refuse_swapped,
    robot_argument,
)
from truearm.engine.command.split import check_split, check_trained_before, train_count
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.document.document import Block, detail, say, under
from truearm.engine.document.records import Record
from truearm.engine.document.summaries import error_line, errors_summary
from truearm.engine.fit.fit import identify, place
from truearm.engine.fit.models import MODELS, Model
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.simulation.influences import (
    WAYS,
    Influence,
    PoseByPose,
    Way,
    influence_based,
    least_squares,
    minimum_norm,
    positions_of,
)
from truearm.simulation.influences import influence as influence_of

if TYPE_CHECKING:
    from truearm.simulation.jobs import FindInfluence

#: What is written into a folder.
INFLUENCE_FILES: Final = ("influence.csv", "result.json", "report.html")
#: So many of the most influential parameters are told first.
_FIRST: Final = 3


@dataclass(frozen=True, eq=False)
class Identified:
    """The same parameters, identified in several ways from the same readings."""

    robots: Mapping[Way, Robot]  #: By the way they were found.
    #: Of each on configurations that none of them was made from, or on those that all were.
    errors: Mapping[Way, Errors]
    held_out: bool  #: Whether it is the former.
    training: int  #: How many configurations they were made from.
    by_influence: PoseByPose  #: by_influence, by_norm: what single poses said.
    by_norm: PoseByPose
    #: ``placed`` if base and targets were fitted with the nominal robot and held, ``robot`` if they are the file's.
    frames: str


@dataclass(frozen=True, eq=False, repr=False)
class InfluenceResult(Record):
    """What parameters do to the tip, configuration by configuration, and identification by that."""

    robot: Robot  #: The robot that was perturbed.
    made: Influence  #: What each parameter does.
    labels: tuple[str, ...]  #: Names of the configurations.
    tip: str  #: The target whose pose is meant, or the flange.
    identified: Identified | None  #: From readings; None without any.
    notices: tuple[Notice, ...]  #: What to know about it.
    command: str  #: How to run it again.
    inputs: tuple[Path, ...] = ()  #: The files that were read: none of them is overwritten.
    simulated_from: tuple[Marked, ...] = ()  #: What of it comes from a virtual instrument.

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What to know about the result."""
        return self.notices

    @property
    def written(self) -> tuple[str, ...]:
        """Names of its files."""
        return INFLUENCE_FILES

    def rows(self) -> list[dict[str, Any]]:
        """Return each parameter with its change and its influence, the most influential first, as JSON holds them."""
        turn = np.zeros_like(self.made.size) if self.made.turn is None else self.made.turn
        rows = []
        for index in np.argsort(-self.made.mean, kind="stable").tolist():
            name = self.made.names[index]
            unit = SHOWN_AS[self.robot.parameters[name].unit]
            size, turned = 1e3 * self.made.size[index], np.degrees(turn[index])
            rows.append(
                {
                    "name": name,
                    "change": from_si(float(self.made.perturbation[index]), unit),
                    "unit": unit,
                    "mean_mm": float(size.mean()),
                    "least_mm": float(size.min()),
                    "greatest_mm": float(size.max()),
                    "mean_deg": float(turned.mean()),
                    "greatest_deg": float(turned.max()),
                }
            )
        return rows

    def parameter_rows(self) -> list[dict[str, Any]]:
        """Return what each way found of each parameter, as JSON holds it; nothing without readings."""
        if self.identified is None:
            return []
        rows = []
        for name in self.made.names:
            unit = SHOWN_AS[self.robot.parameters[name].unit]
            values: dict[str, float] = {
                way: from_si(robot.values[name], unit) for way, robot in self.identified.robots.items()
            }
            deviation = self.identified.robots["calibrate"].parameters[name].deviation
            known = None if deviation is None else from_si(deviation, unit)
            rows.append({"name": name, "unit": unit, **values, "deviation": known})
        return rows

    def blocks(self) -> Iterator[Block]:
        """Give what parameters do, the most influential first, and what identification by that is worth [mm, mrad]."""
        rows = self.rows()
        width = max(len(row["name"]) for row in rows)
        configurations = len(self.labels)
        tell = say if self.identified is None else detail
        yield tell(
            f"What a change of each parameter does to {self.tip} at {counted(configurations, 'configuration')}:",
            configurations=configurations,
            tip=self.tip,
        )
        lines = []
        for row in rows:
            change = f"+{row['change']:.3g} {row['unit']}"
            lines.append(
                f"  {row['name']:<{width}} {change:<22} mean {row['mean_mm']:.4f} mm, {row['least_mm']:.4f} to "
                f"{row['greatest_mm']:.4f} mm; turned by {row['mean_deg']:.4f} deg"
            )
        yield tell(*lines[:_FIRST], influence=rows)
        yield detail(*lines[_FIRST:])
        if self.identified is not None:
            yield from _worth(self.identified)

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds."""
        identified = {} if self.identified is None else {"parameters": self.parameter_rows()}
        return {"truearm": "truearm-influence/1", **self.summary(), "command": self.command, **identified}

    def csv_text(self) -> str:
        """Return the influence of every parameter at every configuration as CSV."""
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["configuration", "parameter", "change", "unit", "moved [mm]", "turned [deg]"])
        turn = np.zeros_like(self.made.size) if self.made.turn is None else self.made.turn
        changes = []
        for name, change in zip(self.made.names, self.made.perturbation.tolist(), strict=True):
            unit = SHOWN_AS[self.robot.parameters[name].unit]
            changes.append((name, f"{from_si(change, unit):.9g}", unit))
        for at, label in enumerate(self.labels):
            for index, change in enumerate(changes):
                moved, turned = 1e3 * self.made.size[index, at], math.degrees(turn[index, at])
                writer.writerow([label, *change, f"{moved:.7g}", f"{turned:.7g}"])
        return stream.getvalue()

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write ``influence.csv``, ``result.json`` and ``report.html`` into a folder.

        Returns:
            The files written.
        """
        from truearm.simulation.influence_report import influence_html

        folder = output_folder(folder, INFLUENCE_FILES, self.inputs, ours=True)
        files: dict[str, str | bytes] = {
            "influence.csv": self.csv_text(),
            "result.json": json.dumps(self.result(), indent=2, allow_nan=False) + "\n",
            "report.html": influence_html(self),
        }
        write_files(folder, files, self.command)
        return tuple(folder / name for name in files)


def _worth(identified: Identified) -> Iterator[Block]:
    """Give the errors of each way to identify, in mm and mrad."""
    part = "none of them has seen" if identified.held_out else "all of them were made from"
    judged = next(iter(identified.errors.values())).configurations
    yield say(
        f"On {counted(judged, 'configuration')} that {part}:",
        held_out=identified.held_out,
        training=identified.training,
        frames=identified.frames,
    )
    width = max(map(len, WAYS.values()))
    ways = (
        under(way, [say(f"  {WAYS[way]:<{width}}  {error_line(errors)}", **errors_summary(errors))])
        for way, errors in identified.errors.items()
    )
    yield under("errors", ways)


Frames = Literal["placed", "robot"]
#: Moves the tip by less than rounding [m].
_NOTHING: Final = 1e-12

#: Configurations from which on base and target are found.
_LEAST: Final = 5


@dataclass(frozen=True, eq=False)
class _Prepared:
    robot: Robot  #: As it was given.
    nominal: Robot  #: With what it carried, and the effects of the model.
    model: Model
    names: tuple[str, ...]  #: Of the parameters that are changed.
    changes: dict[str, float]  #: By how much, in SI units.
    measured: Dataset | None
    tip: str | None  #: None is the flange.


@dataclass(frozen=True, eq=False)
class _Parts:
    """The readings, and the nominal robot in their frames."""

    placed: Robot
    first: Dataset  #: What is trained on.
    second: Dataset | None  #: What judges; None if nothing is held out.


def analysed(asked: FindInfluence) -> InfluenceResult:
    """Change the parameters, identify them if there are readings, and write what comes of it."""
    refuse_swapped(asked.robot, asked.data, "influence")
    inputs = (asked.robot, asked.data)
    folder = None if asked.out is None else folder_beside(INFLUENCE_FILES, INFLUENCE_FILES[0], asked.out, *inputs)
    asked.progress("reading the robot")
    prepared = _read(asked)
    names, measured = prepared.names, prepared.measured
    identified, notices = None, list[Notice]()
    if measured is None:
        n = asked.poses or 118
        refuse_beyond("derivatives", 9 * len(names) * n, parameter="poses")
        placed, labels = prepared.nominal, tuple(str(number) for number in range(1, n + 1))
        at = Postures(prepared.nominal.random_configurations(n, np.random.default_rng(asked.seed)))
    else:
        labels, at = measured.labels, measured.postures
        refuse_beyond("derivatives", 9 * len(names) * len(labels), parameter="data")
        with refusals_of("data"):
            asked.progress("placing the nominal robot")
            parts = _parts(asked, prepared, measured)
            placed = parts.placed
            split = train_count(asked.train, len(labels), measured.source), len(labels), asked.seed
            notices += check_trained_before(prepared.robot, measured, None, split, "")
            asked.progress("identifying the parameters in every way")
            identified = _identified(asked, prepared, parts)
        notices += _compared(identified)
    asked.progress("changing one parameter after the other")
    influence = influence_of(placed, at, names, prepared.tip, prepared.changes)
    notices += _still(influence)
    result = InfluenceResult(
        placed,
        influence,
        labels,
        "the flange" if prepared.tip is None else f"target {prepared.tip}",
        identified,
        tuple(notices),
        asked.again,
        files_of(*inputs),
        parts_of((prepared.robot, measured)),
    )
    if folder is not None:
        asked.progress("writing the files")
        result.save(folder)
    return result


def _read(asked: FindInfluence) -> _Prepared:
    """Read robot and data, and say what is changed by how much."""
    model = next(entry for entry in MODELS if entry.name == asked.model)
    robot = robot_argument(asked.robot)
    nominal = model.prepared(asked.loads.on(robot))
    names = _names(nominal, model)
    measured = None if asked.data is None else readings_argument(nominal, asked.data)
    tip = _tip(nominal, measured, asked.target)
    by_unit = {"rad": asked.angle, "m": asked.length}
    parameters = [nominal.parameters[name] for name in names]
    changes = {parameter.name: by_unit.get(parameter.unit, parameter.prior) for parameter in parameters}
    return _Prepared(robot, nominal, model, names, changes, measured, tip)


def _names(robot: Robot, model: Model) -> tuple[str, ...]:
    """Return the parameters of the arm that a model frees."""
    groups = (*model.groups, *model.effects)
    names = tuple(p.name for p in robot.parameters.values() if p.group in groups)
    if not names:
        raise InputError("the model has no parameter of this robot", parameter="model", came=model.name)
    return names


def _tip(robot: Robot, data: Dataset | None, target: object) -> str | None:
    """Return the target whose pose is meant, None for the flange of a robot without targets."""
    known = data.targets if data is not None else tuple(each.name for each in robot.targets)
    if target is not None:
        return choice_argument(target, "target", {name: name for name in known})
    if data is None:
        return known[0] if known else None
    with_positions = [name for i, name in enumerate(known) if (data.has_position & (data.target == i)).any()]
    if not with_positions:
        raise InputError(
            "one pose alone is identified from a position, and there is none",
            parameter="data",
            where=data.source,
            cure="Measure positions, or calibrate with 'truearm calibrate', which takes distances and heights.",
        )
    return with_positions[0]


def _parts(asked: FindInfluence, prepared: _Prepared, data: Dataset) -> _Parts:
    """Split the readings, and put the nominal robot into their frames."""
    nominal, tip = prepared.nominal, str(prepared.tip)
    if not (data.has_position & (data.target == data.targets.index(tip))).any():
        raise InputError("there is no position reading of this target", where=data.source, came=tip)
    count = train_count(asked.train, data.configurations, data.source)
    if count < _LEAST:
        raise InputError(
            "base, target and parameters are not found from so few configurations",
            parameter="train",
            where=data.source,
            came=counted(count, "training configuration"),
            allowed=f"{_LEAST} or more",
        )
    order = np.random.default_rng(asked.seed).permutation(data.configurations)
    first = data.of_configurations(order[:count])
    second = data.of_configurations(order[count:]) if count < data.configurations else None
    if second is not None:
        check_split(first, second)
    alone = positions_of(first, tip)
    if not len(alone.position):
        raise InputError(
            "the training part has no position of the tip", where=data.source, came=tip, cure="Change `seed`."
        )
    others = None if second is None else positions_of(second, tip)
    if asked.placement == "robot":
        if tip not in [target.name for target in nominal.targets]:
            raise InputError(
                "the robot file does not say where this target is",
                parameter="placement",
                came=tip,
                allowed=listed([target.name for target in nominal.targets]) or "placed",
                cure="Use `placement=placed`.",
            )
        return _Parts(nominal, alone, others)
    return _Parts(place(nominal, alone), alone, others)


def _identified(asked: FindInfluence, prepared: _Prepared, parts: _Parts) -> Identified:
    """Identify the same parameters in every way from the same readings."""
    nominal, names, tip, first = prepared.nominal, prepared.names, str(prepared.tip), parts.first
    units = {n: nominal.parameters[n].prior for n in names if nominal.parameters[n].unit not in ("rad", "m")}
    combination = asked.combination
    by_norm = minimum_norm(parts.placed, first, names, tip, combination=combination, units=units)
    by_influence = influence_based(
        parts.placed, first, names, tip, combination=combination, units=units, perturbations=prepared.changes
    )
    robots: dict[Way, Robot] = {
        "nominal": parts.placed,
        "minimum norm": by_norm.robot,
        "influence": by_influence.robot,
        "least squares": least_squares(parts.placed, first, names, tip),
        "calibrate": identify(nominal, first, prepared.model).robot,
    }
    judges = first if parts.second is None else parts.second
    errors = {way: errors_of(robot, judges) for way, robot in robots.items()}
    held_out = parts.second is not None
    return Identified(robots, errors, held_out, first.configurations, by_influence, by_norm, asked.placement)


POSES_UNMET: Final = Rule(
    "poses-unmet", "warning", "the parameters cannot meet these poses; their sets are where the steps ended"
)
INFLUENCE_WORSE: Final = Rule(
    "influence-worse",
    "note",
    "influence leaves more on the poses that judge than least squares over all poses",
    cure="Calibrate with 'truearm calibrate'.",
)


def _compared(identified: Identified) -> list[Notice]:
    """Say if poses were not met, and which way is the better one."""
    notices = []
    unmet = int((~identified.by_influence.converged).sum())
    if unmet:
        notices.append(
            POSES_UNMET(
                f"{counted(unmet, 'pose')} of {len(identified.by_influence.converged)} could not be met by these "
                "parameters: their sets are where the steps ended."
            )
        )
    by_influence, at_once = (identified.errors[way].position for way in ("influence", "least squares"))
    if by_influence is not None and at_once is not None and at_once.mean < by_influence.mean:
        notices.append(
            INFLUENCE_WORSE(
                f"Identification by influence leaves {by_influence.mean * 1e3:.3f} mm, least squares from all poses at "
                f"once {at_once.mean * 1e3:.3f} mm: one pose sees three combinations of the parameters, and what it "
                "does not see stays wrong."
            )
        )
    return notices


NO_INFLUENCE: Final = Rule("no-influence", "note", "these parameters do not change the pose of the tip anywhere")


def _still(influence: Influence) -> list[Notice]:
    """Name parameters that move nothing."""
    still = [
        name
        for name, size, turn in zip(
            influence.names,
            influence.size,
            influence.turn if influence.turn is not None else influence.size,
            strict=True,
        )
        if size.max() < _NOTHING and turn.max() < _NOTHING
    ]
    if not still:
        return []
    message = f"{listed(still)} {'does' if len(still) == 1 else 'do'} not change the pose of the tip anywhere."
    return [NO_INFLUENCE(message)]
