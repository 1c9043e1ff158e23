"""What each parameter does to the pose of the tip, and identification by that beside the standard one."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, get_args

import numpy as np

from truearm.engine.base.arrays import finite_number
from truearm.engine.base.errors import InputError, Notice, counted, has_error, listed, refusals_of
from truearm.engine.base.limits import refuse_beyond
from truearm.engine.base.units import SHOWN_AS, Marked, from_si, parts_of
from truearm.engine.base.writing import output_folder, write_files
from truearm.engine.command.arguments import (
    choice_argument,
    command_argument,
    count_argument,
    files_of,
    folder_beside,
    gravity_argument,
    length_argument,
    payload_argument,
    progress_argument,
    python_call,
    readings_argument,
    refuse_swapped,
    robot_argument,
    whole_argument,
)
from truearm.engine.command.groups import Train
from truearm.engine.command.split import check_split, check_trained_before, train_count
from truearm.engine.data.dataset import Dataset
from truearm.engine.data.statistics import Errors, errors_of
from truearm.engine.document.records import Record, notice_lines, notice_summaries
from truearm.engine.document.summaries import error_line, errors_summary
from truearm.engine.fit.fit import identify, place
from truearm.engine.fit.models import MODELS, Model
from truearm.engine.robot.parts import Payload
from truearm.engine.robot.postures import Postures
from truearm.engine.robot.robot import Robot
from truearm.simulation.influences import (
    WAYS,
    Combination,
    Influence,
    PoseByPose,
    Way,
    influence_based,
    least_squares,
    minimum_norm,
    positions_of,
)
from truearm.simulation.influences import influence as influence_of

#: What is written into a folder.
INFLUENCE_FILES: Final = ("influence.csv", "result.json", "report.html")


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
    def finished(self) -> bool:
        """Whether no notice is an error."""
        return not has_error(self.notices)

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

    def found(self) -> list[dict[str, Any]]:
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

    def summary(self) -> dict[str, Any]:
        """Return the figures as ``result.json`` begins with them: errors in mm and mrad."""
        told: dict[str, Any] = {
            "configurations": len(self.labels),
            "tip": self.tip,
            "warnings": notice_summaries(self.notices),
            "influence": self.rows(),
        }
        if self.identified is not None:
            told |= {
                "held_out": self.identified.held_out,
                "training": self.identified.training,
                "frames": self.identified.frames,
                "errors": {str(way): errors_summary(errors) for way, errors in self.identified.errors.items()},
            }
        return told

    def result(self) -> dict[str, Any]:
        """Return what ``result.json`` holds."""
        found = {} if self.identified is None else {"parameters": self.found()}
        return {"truearm": "truearm-influence/1", **self.summary(), "command": self.command, **found}

    def lines(self) -> list[str]:
        """Return the most influential parameters, then what identification by influence is worth."""
        rows = self.rows()
        width = max(len(row["name"]) for row in rows)
        text = [f"What a change of each parameter does to {self.tip} at {counted(len(self.labels), 'configuration')}:"]
        for row in rows:
            change = f"+{row['change']:.3g} {row['unit']}"
            text.append(
                f"  {row['name']:<{width}} {change:<22} mean {row['mean_mm']:.4f} mm, {row['least_mm']:.4f} to "
                f"{row['greatest_mm']:.4f} mm; turned by {row['mean_deg']:.4f} deg"
            )
        if self.identified is not None:
            found = self.identified
            part = "none of them has seen" if found.held_out else "all of them were made from"
            judged = next(iter(found.errors.values())).configurations
            text.append(f"On {counted(judged, 'configuration')} that {part}:")
            width = max(map(len, WAYS.values()))
            text += [f"  {WAYS[way]:<{width}}  {error_line(errors)}" for way, errors in found.errors.items()]
        return text + notice_lines(self.notices)

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


Frames = Literal["placed", "robot"]
#: What is too large to be an error of an angle or a length [rad, m].
_LARGEST: Final = (math.radians(10.0), 0.1)
#: Moves the tip by less than rounding [m].
_NOTHING: Final = 1e-12

#: Configurations from which on base and target are found.
_LEAST: Final = 5


def influence(
    robot: Robot | str | Path,
    data: Dataset | str | Path | None = None,
    *,
    out: str | Path | None = None,
    model: str = "geometric",
    target: str | None = None,
    angle: float = math.radians(0.05),
    length: float = 1e-4,
    poses: int | None = None,
    frames: Frames = "placed",
    combination: Combination = "mean",
    train: Train = None,
    seed: int = 0,
    payload: Payload | str | None = None,
    gravity: Sequence[float] | None = None,
    command: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> InfluenceResult:
    """Change one parameter after the other and see what the tip does; with readings, identify by that.

    Parameters
    ----------
    robot
        Perturbed about its values, or what :func:`truearm.load_robot` takes.
    data
        Position readings, or a canonical CSV file: then the configurations are theirs, and the parameters are
        identified pose by pose by minimum norm and by influence (Patel, sections 3.6 and 3.7), from all poses at once,
        and as :func:`truearm.calibrate` does it.
    out
        Folder for influence.csv, result.json and report.html; None writes nothing, see :meth:`InfluenceResult.save`.
    model
        Whose parameters are changed, one of :data:`truearm.engine.fit.models.MODELS` by name.
    target
        The tip; the first one of the readings or the robot if None, or the flange of a robot without any.
    angle, length
        By how much angles [rad] and lengths [m] are changed; what has another unit is changed by its prior.
    poses
        How many configurations, drawn evenly within the limits; 118 if None. Not with `data`.
    frames
        ``placed``: base and targets are fitted with the nominal robot and then held, except where the whole
        calibration finds them anew; ``robot``: they are where the robot file has them, and the readings in that frame.
    combination
        How one set is made of those of all poses: ``mean``, ``scaled-mean`` or ``best-pose``.
    train, seed
        Split of the readings, as in :func:`truearm.calibrate`; without readings the seed is that of the configurations.
    payload, gravity
        What the robot carried (an object, or a text such as ``2.7kg,50mm,25mm,100mm``) and free fall in its base frame
        [m/s^2].
    command
        How to run it again, for the report; None writes the call in Python.
    progress
        Called with a few words at each step.

    Raises
    ------
    InputError
        For anything that cannot be used, with a message that says what to do.
    """
    progress_argument(progress)
    wanted = choice_argument(model, "model", {m.name: m for m in MODELS})
    choice_argument(frames, "frames", {name: name for name in get_args(Frames)})
    choice_argument(combination, "combination", {name: name for name in get_args(Combination)})
    turned = finite_number(angle, "angle")
    if not 0.0 < turned <= _LARGEST[0]:
        raise InputError(
            "no angle errs by that",
            parameter="angle",
            came=f"{math.degrees(turned):g} deg",
            allowed="above 0, to 10 deg",
        )
    moved = length_argument(length, "length")
    if not 0.0 < moved <= _LARGEST[1]:
        raise InputError(
            "no length errs by that", parameter="length", came=f"{moved * 1e3:g} mm", allowed="above 0, to 100 mm"
        )
    count = None if poses is None else count_argument(poses, "poses")
    seed = whole_argument(seed, "seed")
    carried, fall = payload_argument(payload), gravity_argument(gravity)
    call = command_argument(command) or python_call(
        "influence",
        robot,
        data,
        model=model,
        target=target,
        angle=angle,
        length=length,
        poses=poses,
        frames=frames,
        combination=combination,
        train=train,
        seed=seed,
        payload=carried,
        gravity=fall,
    )
    refuse_swapped(robot, data, "influence")
    folder = None if out is None else folder_beside(INFLUENCE_FILES, INFLUENCE_FILES[0], out, robot, data)
    progress("reading the robot")
    given = robot_argument(robot)
    nominal = wanted.prepared(given.with_payload(carried, fall))
    names = _names(nominal, wanted)
    measured = None if data is None else readings_argument(nominal, data)
    _refuse_unused(measured, count, train)
    tip = _tip(nominal, measured, target)
    changes = {
        name: {"rad": turned, "m": moved}.get(nominal.parameters[name].unit, nominal.parameters[name].prior)
        for name in names
    }
    identified, notices = None, list[Notice]()
    if measured is None:
        n = count or 118
        refuse_beyond("derivatives", 9 * len(names) * n, parameter="poses")
        placed, labels = nominal, tuple(str(number) for number in range(1, n + 1))
        at = Postures(nominal.random_configurations(n, np.random.default_rng(seed)))
    else:
        labels, at = measured.labels, measured.postures
        refuse_beyond("derivatives", 9 * len(names) * len(labels), parameter="data")
        with refusals_of("data"):
            progress("placing the nominal robot")
            placed, parts = _parts(nominal, measured, str(tip), frames, train, seed)
            split = train_count(train, measured.configurations, measured.source), measured.configurations, seed
            notices += check_trained_before(given, measured, None, split, "")
            progress("identifying the parameters in every way")
            identified = _identified(nominal, placed, *parts, wanted, names, str(tip), changes, combination, frames)
        notices += _compared(identified)
    progress("changing one parameter after the other")
    made = influence_of(placed, at, names, tip, changes)
    notices += _still(made)
    found = InfluenceResult(
        placed,
        made,
        labels,
        "the flange" if tip is None else f"target {tip}",
        identified,
        tuple(notices),
        call,
        files_of(robot, data),
        parts_of((given, measured)),
    )
    if folder is not None:
        progress("writing the files")
        found.save(folder)
    return found


def _names(robot: Robot, model: Model) -> tuple[str, ...]:
    """Return the parameters of the arm that a model frees."""
    groups = (*model.groups, *model.effects)
    names = tuple(p.name for p in robot.parameters.values() if p.group in groups)
    if not names:
        raise InputError("the model has no parameter of this robot", parameter="model", came=model.name)
    return names


def _refuse_unused(data: Dataset | None, poses: int | None, train: object) -> None:
    """Refuse what says nothing with readings, or nothing without them."""
    if data is not None and poses is not None:
        raise InputError(
            "the configurations are those of the readings", parameter="poses", came=poses, cure="Leave `poses` out."
        )
    if data is None and train is not None:
        raise InputError("there are no readings to split", parameter="train", cure="Give `data`, or leave it out.")


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


def _parts(
    nominal: Robot, data: Dataset, tip: str, frames: str, train: Train, seed: int
) -> tuple[Robot, tuple[Dataset, Dataset | None]]:
    """Return the nominal robot in the frames of the readings, and the readings to train on and to judge by."""
    if not (data.has_position & (data.target == data.targets.index(tip))).any():
        raise InputError("there is no position reading of this target", where=data.source, came=tip)
    count = train_count(train, data.configurations, data.source)
    if count < _LEAST:
        raise InputError(
            "base, target and parameters are not found from so few configurations",
            parameter="train",
            where=data.source,
            came=counted(count, "training configuration"),
            allowed=f"{_LEAST} or more",
        )
    order = np.random.default_rng(seed).permutation(data.configurations)
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
    if frames == "robot":
        if tip not in [target.name for target in nominal.targets]:
            raise InputError(
                "the robot file does not say where this target is",
                parameter="frames",
                came=tip,
                allowed=listed([target.name for target in nominal.targets]) or "placed",
                cure="Use `frames=placed`.",
            )
        return nominal, (alone, others)
    return place(nominal, alone), (alone, others)


def _identified(
    nominal: Robot,
    placed: Robot,
    first: Dataset,
    second: Dataset | None,
    model: Model,
    names: tuple[str, ...],
    tip: str,
    changes: dict[str, float],
    combination: Combination,
    frames: str,
) -> Identified:
    """Identify the same parameters in every way from the same readings."""
    units = {n: nominal.parameters[n].prior for n in names if nominal.parameters[n].unit not in ("rad", "m")}
    by_norm = minimum_norm(placed, first, names, tip, combination=combination, units=units)
    by_influence = influence_based(
        placed, first, names, tip, combination=combination, units=units, perturbations=changes
    )
    robots: dict[Way, Robot] = {
        "nominal": placed,
        "minimum norm": by_norm.robot,
        "influence": by_influence.robot,
        "least squares": least_squares(placed, first, names, tip),
        "calibrate": identify(nominal, first, model).robot,
    }
    judges = first if second is None else second
    errors = {way: errors_of(one, judges) for way, one in robots.items()}
    return Identified(robots, errors, second is not None, first.configurations, by_influence, by_norm, frames)


def _compared(found: Identified) -> list[Notice]:
    """Say if poses were not met, and which way is the better one."""
    told = []
    unmet = int((~found.by_influence.converged).sum())
    if unmet:
        told.append(
            Notice(
                "poses-unmet",
                f"{counted(unmet, 'pose')} of {len(found.by_influence.converged)} could not be met by these parameters:"
                " their sets are where the steps ended.",
            )
        )
    by_influence, at_once = (found.errors[way].position for way in ("influence", "least squares"))
    if by_influence is not None and at_once is not None and at_once.mean < by_influence.mean:
        told.append(
            Notice(
                "influence-worse",
                f"Identification by influence leaves {by_influence.mean * 1e3:.3f} mm, least squares from all poses at "
                f"once {at_once.mean * 1e3:.3f} mm: one pose sees three combinations of the parameters, and what it "
                "does not see stays wrong. Calibrate with 'truearm calibrate'.",
                "note",
            )
        )
    return told


def _still(made: Influence) -> list[Notice]:
    """Name parameters that move nothing."""
    still = [
        name
        for name, size, turn in zip(
            made.names, made.size, made.turn if made.turn is not None else made.size, strict=True
        )
        if size.max() < _NOTHING and turn.max() < _NOTHING
    ]
    if not still:
        return []
    message = f"{listed(still)} {'does' if len(still) == 1 else 'do'} not change the pose of the tip anywhere."
    return [Notice("no-influence", message, "note")]
