"""What a study is asked for: a published experiment made again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from truearm.engine.base.errors import InputError
from truearm.engine.command.groups import InParts, IntoFolder, Long, Repeatable
from truearm.engine.command.kinds import File, Text, Whole
from truearm.engine.command.request import as_in, job, option, required
from truearm.starting.published import find_papers

if TYPE_CHECKING:
    from truearm.engine.document.records import Record


class MakeStudy(InParts, IntoFolder, Repeatable, Long):
    """Make a published experiment again and set our figures beside the printed ones, over several seeds.

    Writes report.html and study.json into a folder.
    """

    job = "study"
    refuses = "If there is no such study, or its data are missing, or it needs none."
    study: str = required(
        Text("NAME"),
        "Which study; see above.",
        kw_only=False,
        more="One of :data:`papers.STUDIES` by name.",
        formerly="name",
    )
    data: str | Path | None = option(
        File("DIR"), "Folder of measured data, for a study that needs them.", default=None, shown=False
    )
    seeds: int = option(
        Whole(low=1, counts=True), "How often to do it anew.", default=10, more="With seeds 0, 1, 2 and so on."
    )
    workers: int = as_in(
        InParts, "workers", default=1, shown=True, more="One is this process itself. The figures do not depend on it."
    )

    @classmethod
    def help_text(cls) -> str:
        """Return what the help begins with: it lists the studies, where they are."""
        paragraphs = [
            "Make a published experiment again and set our figures beside the printed ones, over several seeds.",
            "Writes report.html and study.json into DIR. The studies:",
        ]
        try:
            find_papers()
        except InputError as error:
            return "\n\n".join([*paragraphs, error.message(str)])
        from papers import STUDIES

        paragraphs += [f"{entry.name}: {entry.about}{' (with `data`)' if entry.files else ''}" for entry in STUDIES]
        return "\n\n".join(paragraphs)

    def check(self) -> None:
        """Refuse several who do the seeds."""
        if self.executor is not None and self.workers != 1:
            raise InputError("one of them does the seeds", parameter="workers, executor", cure="Leave one out.")

    def run(self) -> Record:
        """Make it."""
        from truearm.starting.studying import made_again

        return made_again(self)


study = job(MakeStudy)
