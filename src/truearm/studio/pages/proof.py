"""What the calibration is worth, on configurations that the fit has not seen."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any, ClassVar, Final

from truearm.calibration.result import RESULT_FILES
from truearm.engine.base.errors import InputError, Notice
from truearm.engine.base.files import exists, read_text
from truearm.engine.base.units import mark_lines
from truearm.engine.data.excluded import read_exclusions
from truearm.studio import words
from truearm.studio.evaluated_with import OTHER_ROBOT, OTHER_SETTINGS
from truearm.studio.made_with import MadeWith, made_with
from truearm.studio.pages.error_arrows import ErrorArrows
from truearm.studio.pages.fields import NONE, offer
from truearm.studio.pictures import Picture, report_figures
from truearm.studio.project import stamp_of
from truearm.studio.window import Window

_PARTS: Final = (("nominal", "before"), ("validation", "after, held out"), ("train", "after, training"))
_KINDS: Final = (("position_mm", "mm"), ("length_mm", "mm"), ("orientation_mrad", "mrad"))


class ProofPage:
    """Shows what stands in the folder of results, whoever wrote it: figures, notices and the report's pictures."""

    title: ClassVar[str] = "Proof"

    def __init__(self, window: Window) -> None:
        self._window = window
        gui = window.gui
        self._figures: dict[str, Any] = {}
        self._shown: tuple[Any, ...] = ()
        self._now = gui.add_html("")
        self._table = gui.add_html("")
        self._picture = gui.add_dropdown("Picture", (NONE,), visible=False)
        self._drawn = Picture(window, "Picture")
        self._files = gui.add_button_group("Download", RESULT_FILES[:3], visible=False)
        self._arrows = ErrorArrows(window)
        self._notices = gui.add_html("")
        self._picture.on_update(window.action(self._draw))
        self._files.on_click(window.action(self._download))

    def refresh(self) -> None:
        """Show the result that stands in the folder."""
        project = self._window.project
        self._arrows.refresh()
        folder = project.file("result")
        if folder is None or not exists(folder / "result.json"):
            self._table.content = words.paragraph(
                f"There is no result yet in the folder {project.settings.result} of the project: calibrate first."
            )
            self._now.content, self._notices.content, self._shown, self._figures = "", "", (), {}
            self._picture.visible = self._files.visible = self._drawn.place.visible = False
            return
        stat = (folder / "result.json").stat()
        settings = project.settings
        robot = project.robot_file()  # no file for a robot of the library
        others = (folder / "calibrated.yaml", project.file("data"), project.file("exclude"), robot)
        shown = (folder, stat.st_mtime_ns, stat.st_size, *map(stamp_of, others), settings.dark, settings.robot)
        shown += (settings.model, settings.train, settings.seed, settings.loss, settings.payload, settings.data)
        if shown == self._shown:
            return
        result = _read_result(folder / "result.json")
        try:
            made, marks = made_with(result, self._window.calibrated()), mark_lines(result.get("simulated_parts", ()))
            about = [*marks, f"Of {made.line()}.", f"Status: {result['status']}"]
            shown_figures = words.lines(about) + figures_table(result)
            warnings = [Notice(one["code"], one["message"], one["level"]) for one in result.get("warnings", ())]
            now, told = words.notices(self._differing(result, made)), words.notices(warnings)
            told += words.lines(f"Next: {step['message']}" for step in result.get("next", ()))
        except InputError:  # of the robot or the measurements that are chosen
            raise
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise _no_result(folder / "result.json") from error
        self._now.content, self._table.content, self._notices.content = now, shown_figures, told
        self._figures = report_figures(folder / "report.html")
        self._files.visible = True
        self._picture.visible = self._drawn.place.visible = bool(self._figures)
        if self._figures:
            first = self._picture.value if self._picture.value in self._figures else next(iter(self._figures))
            offer(self._picture, self._figures, first, None)
            self._draw()
        self._shown = shown

    def _differing(self, result: dict[str, Any], made: MadeWith) -> list[Notice]:
        """Return the notices that say what the result is of, where something else is chosen now."""
        found = []
        other = self._window.result_of_another()
        if other:
            name, source = self._window.robot().name, self._window.project.settings.robot
            chosen_now = name if source == name else f"{name} ({source})"
            text = f"This result is of the robot {other}, and {chosen_now} is chosen: calibrate again."
            found.append(OTHER_ROBOT(text))
        if differing := made.differing(self._window.project.settings, self._window.robot()):
            was, is_now = ("; ".join(f"{name} {pair[i]}" for name, pair in differing.items()) for i in (0, 1))
            text = f"This result was made with {was}. Chosen now: {is_now}. Calibrate again to see what that is worth."
            found.append(OTHER_SETTINGS(text))
        data = self._window.project.file("data")
        if data is not None and exists(data):
            digest = hashlib.sha256(data.read_bytes()).hexdigest()[:12]
            if f"sha256 {digest}" not in str(result.get("history", "")):
                text = f"This result is of other measurements than {self._window.project.settings.data} as it is now."
                found.append(OTHER_SETTINGS(text))
        exclude = self._window.project.file("exclude")
        chosen = read_exclusions(exclude) if exclude is not None and exists(exclude) else ()
        excluded = [(one.configuration, one.target, one.reason) for one in chosen]
        if excluded != [(one["configuration"], one["target"], one["reason"]) for one in result.get("excluded", ())]:
            text = "This result is without other readings than those that are excluded now: calibrate again."
            found.append(OTHER_SETTINGS(text))
        return found

    def _draw(self) -> None:
        drawn = self._figures.get(self._picture.value)
        if drawn is not None:
            self._drawn.show(drawn)

    def _download(self) -> None:
        folder = self._window.project.file("result")
        if folder is not None:
            self._window.download(folder / self._files.value)


def figures_table(result: dict[str, Any]) -> str:
    """Return the errors of a result as a table of each kind, with as many digits as the command prints."""
    shown = ""
    for kind, unit in _KINDS:
        rows = []
        for part, name in _PARTS:
            spread = (result.get(part) or {}).get(kind)
            if spread is not None:
                figures = [f"{spread[what]:.3f}" for what in ("mean", "rms", "p95", "max")]
                rows.append([f"{name} ({result[part]['configurations']})", *figures])
        if rows:
            heads = [f"{what} [{unit}]" for what in ("mean", "rms", "95 %", "max")]
            shown += words.table([f"{kind.partition('_')[0]} (configurations)", *heads], rows)
    return shown


def _read_result(path: Path) -> dict[str, Any]:
    """Return a file result.json, or refuse what is none."""
    try:
        result = json.loads(read_text(path))
    except (json.JSONDecodeError, RecursionError) as error:
        raise _no_result(path) from error
    if not isinstance(result, dict) or not str(result.get("truearm")).startswith("truearm-result/"):
        raise _no_result(path)
    return result


def _no_result(path: Path) -> InputError:
    return InputError("this is no result of a calibration", where=str(path), cure="Calibrate again.")
