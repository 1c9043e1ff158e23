"""What imports of other programs' files are asked for: tables, a guess at their mapping, matrices, RoboDK, sockets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import ByMapping, Declared, IntoFile, JointsGiven
from truearm.engine.command.kinds import Choice, File, Given, NamedFiles, Number
from truearm.engine.command.request import Request, as_in, job, option, required

if TYPE_CHECKING:
    from truearm.engine.data.readers.robodk import AngleUnit, Decimal, Delimiter
    from truearm.engine.document.records import Imported, ImportedRoboDK
    from truearm.importing.guess import GuessedMapping

_LENGTHS = ("mm", "m", "um", "in")


class _Apart(Given):
    """How far apart two sockets are, and how well that is known: a text with units, or two numbers."""

    def check(self, value: Any, name: str) -> Any:
        """Return the distance and its standard deviation."""
        from truearm.importing.files import Apart

        known = Apart.of_text(value, name) if isinstance(value, str) else Apart.of_numbers(value, name)
        known.refuse_vague(name)
        return known.distance, known.sigma

    def typed_again(self, value: Any) -> list[str]:
        """Return it in mm."""
        return [",".join(f"{text}mm" for number in value for text in Number("mm").typed_again(number))]


class _Diameter(Given):
    """How large a ball is: a text with its unit, or a number."""

    def check(self, value: Any, name: str) -> Any:
        """Return the diameter."""
        from truearm.engine.base.units import quantity_si
        from truearm.engine.command.arguments import length_argument

        is_text = isinstance(value, str)
        diameter = quantity_si(value, _LENGTHS, name, "25", "25mm") if is_text else length_argument(value, name)
        if diameter <= 0.0:
            size = f"{1e3 * diameter:g} mm"
            raise InputError("the ball has no size", parameter=name, came=size, allowed="above 0 mm")
        return diameter

    def typed_again(self, value: Any) -> list[str]:
        """Return it in mm."""
        return [f"{text}mm" for text in Number("mm").typed_again(value)]


class _OfTable(Request):
    """Which table."""

    file: str | Path = required(File("FILE"), "A CSV, another delimited text, or an Excel workbook.", kw_only=False)


class ImportTable(ByMapping, _OfTable, JointsGiven, IntoFile):
    """Any table of points or poses, by a mapping that says which column is what ('truearm import guess' writes one).

    The mapping says whose joint positions they are, unless an option does.
    """

    job = "import_table"
    words = "import table"
    refuses = "If a file cannot be used; the message names the line and the column."
    joints_file: str | Path | None = option(
        File("FILE"),
        "File with the joint positions, one configuration a row.",
        default=None,
        shown="as the mapping says",
        formerly="joints",
    )

    def run(self) -> Imported:
        """Import."""
        from truearm.importing.files import of_table

        return of_table(self)


class GuessMapping(_OfTable, IntoFile):
    """Look at a table and write the mapping that it seems to need, for you to confirm. Nothing is imported.

    Every guess is marked, and the mapping is refused until somebody has written confirmed: yes into it. A file
    that exists is not overwritten.
    """

    job = "import_guess"
    words = "import guess"
    refuses = "If the file does not look like a table of measurements."

    def run(self) -> GuessedMapping:
        """Guess."""
        from truearm.importing.guess import guessed_mapping

        return guessed_mapping(self)


class ImportMatrices(JointsGiven, IntoFile):
    """White-space separated matrices, one configuration a row. A row of zeros or NaN is a missing reading."""

    job = "import_matrices"
    words = "import matrices"
    refuses = "If a file cannot be used; the message names the line and the column."
    joints_file: str | Path = as_in(
        ImportTable,
        "joints_file",
        kw_only=False,
        word="joints_file",
        shown=False,
        more="One column a joint; all joints are revolute.",
    )
    targets: Mapping[str, str | Path] = required(
        NamedFiles("NAME=FILE"),
        "Positions of a target.",
        kw_only=False,
        word="target",
        more="By the names of the targets on the tool; columns x, y, z.",
    )
    references: Mapping[str, str | Path] | None = option(
        NamedFiles("NAME=FILE"),
        "Positions of a fixed point beside the robot.",
        default=None,
        kw_only=False,
        word="reference",
        shown=False,
    )
    angle_unit: str = required(
        Choice(known=("deg", "rad"), what="unit of angles"), "Unit of angles.", kw_only=True, word="angle_unit"
    )
    length_unit: str = required(
        Choice(known=_LENGTHS, what="unit of lengths"), "Unit of the positions.", kw_only=True, word="length_unit"
    )

    def run(self) -> Imported:
        """Import."""
        from truearm.importing.files import of_matrices

        return of_matrices(self)


class ImportRoboDK(JointsGiven, IntoFile):
    """Calibration or validation measurements of RoboDK: joints, measured points and tool points.

    Six joints, the measured point and the tool's point of each measurement, or poses instead of points.
    """

    job = "import_robodk"
    words = "import robodk"
    refuses = "If the file cannot be used; the message names the line and the column."
    file: str | Path = required(File("FILE"), "Calibration or validation measurements, as exported.", kw_only=False)
    angle_unit: AngleUnit | None = as_in(ImportMatrices, "angle_unit", default=None, more="Of measured poses.")
    delimiter: Delimiter = option(
        Choice(known=("comma", "semicolon", "tab")), "What stands between columns.", default="comma"
    )
    decimal: Decimal = option(Choice(known=("point", "comma")), "The decimal sign.", default="point")

    def check(self) -> None:
        """Refuse commas for two things."""
        if self.decimal == self.delimiter == "comma":
            raise InputError(
                "commas cannot stand between columns and in numbers",
                parameter="decimal",
                came="comma",
                allowed="point, or another `delimiter`",
            )

    def run(self) -> ImportedRoboDK:
        """Import."""
        from truearm.importing.files import of_robodk

        return of_robodk(self)


class ImportSockets(Declared, IntoFile):
    """Joint positions of a ball on the flange that was put into two sockets, without any instrument."""

    job = "import_sockets"
    words = "import sockets"
    refuses = "If there are not two sockets, they are closer than the ball is large, or a file cannot be used."
    file: str | Path = required(
        File("TOUCHES.csv"),
        "Joint positions, and the socket, row by row.",
        kw_only=False,
        more="With the columns ``configuration``, ``joint_1 [deg]`` .. or ``axis_1 [deg]`` .., and ``socket``.",
    )
    apart: str | Sequence[float] = required(
        _Apart("DISTANCE,SIGMA"),
        "How far apart the sockets are, with units: 200mm,0.02mm.",
        kw_only=True,
        word="apart",
        more="Of their centres, with the standard deviation; or both as numbers [m].",
    )
    ball: str | float = required(
        _Diameter("DIAMETER"), "Of the ball, with its unit: 25mm.", kw_only=True, word="ball", more="Or a number [m]."
    )

    def run(self) -> Imported:
        """Import."""
        from truearm.importing.files import of_sockets

        return of_sockets(self)


import_table = job(ImportTable)
import_guess = job(GuessMapping)
import_matrices = job(ImportMatrices)
import_robodk = job(ImportRoboDK)
import_sockets = job(ImportSockets)
