"""What an import of circles that the robot drew is asked for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import Declared, IntoFile
from truearm.engine.command.kinds import Given, NamedFiles, Number
from truearm.engine.command.request import job, option, required

if TYPE_CHECKING:
    from truearm.engine.document.records import ImportedCircles


class _Dots(Given):
    """Dots per inch: one number, or those along x and y."""

    def check(self, value: Any, name: str) -> Any:
        """Return one number or two."""
        from truearm.engine.base.arrays import finite_number
        from truearm.engine.command.arguments import numbers_argument

        allowed = "a number above zero, or two"
        if not isinstance(value, Sequence) or isinstance(value, str):
            return finite_number(value, name, allowed=allowed)
        return numbers_argument(value, name, 2, allowed)

    def read(self, typed: Any, name: str) -> Any:
        """Return the numbers of a text, a single one as it is."""
        from truearm.engine.command.texts import read_numbers

        numbers = read_numbers(typed, name, "a number, or X,Y")
        return numbers[0] if len(numbers) == 1 else numbers

    def typed_again(self, value: Any) -> list[str]:
        """Return them with commas between."""
        return [
            ",".join(Number().typed_again(number)[0] for number in (value if isinstance(value, tuple) else (value,)))
        ]


class ImportCircle(Declared, IntoFile):
    """Circles that the robot drew with a pencil: scanned pages and the potentiometer's readings."""

    job = "import_circle"
    words = "import circle"
    refuses = "If a page shows no circle, or a file cannot be used."
    scans: Mapping[str, str | Path] = required(
        NamedFiles("NAME=IMAGE"), "A scanned page.", kw_only=False, word="scan", more="By the names of the pages."
    )
    points: Mapping[str, str | Path] = required(
        NamedFiles("NAME=FILE"),
        "Joints, angle and height read while it was drawn; one a page.",
        kw_only=False,
        word="points",
        more="CSV, by the same names.",
    )
    dpi: float | Sequence[float] | None = option(
        _Dots("N|X,Y"), "Dots per inch of the scans.", default=None, shown="as the files say"
    )

    def check(self) -> None:
        """Refuse scans and tables that are not of the same pages."""
        if not self.scans:
            raise InputError("no page is given", parameter="scans", cure="Give at least one.")
        for name in (*self.scans, *self.points):
            if name not in self.scans or name not in self.points:
                raise InputError(
                    "every page needs a scan and a table",
                    parameter="points" if name in self.scans else "scans",
                    came=f"nothing for {name}",
                    allowed="the same names in `scans` and `points`",
                )

    def run(self) -> ImportedCircles:
        """Import."""
        from truearm.drawn_circle.pages import of_pages

        return of_pages(self)


import_circle = job(ImportCircle)
