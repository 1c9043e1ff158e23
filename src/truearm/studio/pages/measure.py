"""Measuring a plan, reading by reading: with a virtual instrument, from a folder, or from a port of this machine."""

from __future__ import annotations

import threading
from typing import Any, ClassVar, Final

from truearm.engine.base.errors import InputError, Rule
from truearm.engine.base.files import confined_reads, exists
from truearm.measuring.reading_log import LOG
from truearm.measuring.report import drift_figure, quality_figure
from truearm.measuring.result import DATA, PAGE
from truearm.studio import words
from truearm.studio.measure_fields import SOURCES
from truearm.studio.measuring import HEAD, Measuring
from truearm.studio.pages.check import choose_measurements
from truearm.studio.pages.fields import NONE, Fields, offer
from truearm.studio.pages.measured_with import MeasuredWith
from truearm.studio.pages.measuring_scene import MeasuringScene
from truearm.studio.pictures import Picture
from truearm.studio.window import Window
from truearm.studio.work import unforeseen

#: So often a source is asked [s], and in every so manyth of these turns the pictures are drawn anew.
_TURN: Final = 0.2
_PICTURES: Final = 10
#: So many readings of a real instrument are taken in a turn, and so many of those that could not be read are told.
_MOST: Final = 20
_TOLD: Final = 5
#: So many of the last readings stand in the table.
_ROWS: Final = 12
_RULE: Final = (
    "A reading is kept or set aside for reasons of the instrument alone. How well readings fit is not shown here: "
    "whoever repeats what fits badly falsifies the proof."
)
_FINISH: Final = "closes the measuring; the settings come back"
_ALL: Final = (
    "All is measured: the measurements are written, and are those of the project. Press Finish to end. Until then a "
    "reading can be set aside, and is then asked for again; and the air can be read."
)
_DONE: Final = "Measured: the page Check tells whether the measurements can be believed."


NOT_TAKEN: Final = Rule(
    "not-taken", "warning", "rows or lines of an instrument that could not be read, by file and line"
)
MEASURED: Final = Rule("measured", "note", "the measurements are written and chosen")


class MeasurePage:
    """Measures a plan as :func:`truearm.measure` does."""

    title: ClassVar[str] = "Measure"

    def __init__(self, window: Window) -> None:
        self._window = window
        self.measuring: Measuring | None = None
        self._written = False
        self._told: list[str] = []  # what came of it, as it stands in the notices
        self._shown: str | None = None  # the folder whose readings are shown
        self._turn = 0
        self._due = 0.0
        gui = window.gui
        self.settings = gui.add_folder("What is measured")
        with self.settings:
            self.fields = fields = Fields(window, self._now, self._change)
            fields.file(
                "plan", "Plan", (".csv",), "configurations in the order of measuring; the page Plan writes them"
            )
            fields.choice("source", "Readings from", list(SOURCES), "nothing listens before Start", none=None)
            self._of_source = {source: gui.add_folder(source.capitalize(), visible=False) for source in SOURCES}
            self._source_fields()
            fields.text(
                "targets", "Targets", "names with commas between them; those of the robot or device if not said"
            )
            fields.text("nests", "Nests", "fixed points beside the robot: n1, n2, n3")
            fields.number(
                "every", "Nests after", "how many configurations lie between two rounds", optional=False, whole=True
            )
            with gui.add_folder("What is kept", expand_by_default=False):
                by = "of a virtual instrument what is expected of it, if not said"
                fields.number("most_deviation", "Deviation [mm]", f"largest scatter of a sample; {by}")
                fields.number("most_settling", "Settling [mm]", f"between the halves of a dwell; {by}")
                fields.number("fewest_samples", "Samples", f"fewest of a dwell; {by}", whole=True)
            fields.text("out", "Write to", "a folder of the project, for log, measurements and report")
        self.about = MeasuredWith(window, fields)
        self._begin = gui.add_button("Start")
        self._stop: Any = gui.add_button_group("Measuring", ("stop", "finish"), visible=False)
        self._end_all = gui.add_button("Finish", visible=False, color="green", hint=_FINISH)
        self._bar: Any = gui.add_progress_bar(0.0, visible=False)
        self._next = gui.add_html("")
        self._last = gui.add_html("")
        with gui.add_folder("By the operator's word", visible=False) as self._by_hand:
            self._reading: Any = gui.add_text("Reading", "", hint="its number; the last one that is kept if not said")
            self._point: Any = gui.add_dropdown("Point", (NONE,), hint="that cannot be measured here")
            self._why: Any = gui.add_text("Why", "", hint="words for the log: the nest was not clean")
            self._act: Any = gui.add_button_group("Do", ("set the reading aside", "leave the point out"))
        self._notices = gui.add_html("")
        self._drift = Picture(window, "How the nests moved (no reading is corrected for it)")
        self._quality = Picture(window, "How the readings were taken")
        self.scene = MeasuringScene(window)
        self._file: Any = gui.add_dropdown("File", (NONE,), visible=False)
        self._download = gui.add_button("Download the file", visible=False)
        self._callbacks()

    def _source_fields(self) -> None:
        from truearm.measuring.virtual_instrument import VIRTUAL

        gui, fields = self._window.gui, self.fields
        with self._of_source["virtual instrument"]:
            fields.choice("device", "Device", list(VIRTUAL), "that reads where targets are", none=None)
            self._pace: Any = gui.add_slider("Readings a second", 1, 50, 1, 5)
            with gui.add_folder("What it measures, and how well", expand_by_default=False):
                fields.text("truth", "Truth", "the twin that is measured, or a file of it; random if not said")
                fields.number("noise", "Noise [mm]", "of a coordinate; that of the device if not said")
                fields.number("seed", "Seed", "of all that is drawn", optional=False, whole=True)
                fields.number("disturbed", "Disturbed", "share of readings that go wrong, up to 0.9")
                fields.number("drift", "Drift [mm]", "how far the instrument moves till the end")
                boxes = "whose boxes hide nests: of the page Cell, or a file"
                fields.file("constraints", "Constraints", (".yaml", ".yml"), boxes)
        with self._of_source["watched folder"]:
            fields.text("watch", "Folder", "of the project, into which software writes rows: its name")
            fields.text("mapping", "Mapping", "what the columns mean: a file of the project, or a known program's name")
        with self._of_source["port of this machine"]:
            gui.add_html(words.paragraph("Programs of this machine send lines, with a token that Start shows once."))
            fields.number("listen", "Port", "of 127.0.0.1; 0 for any that is free", optional=False, whole=True)

    def _callbacks(self) -> None:
        window = self._window
        self._begin.on_click(window.action(self._start))
        self._stop.on_click(window.action(lambda: self._end() if self._stop.value == "stop" else self._finish()))
        self._end_all.on_click(window.action(self._finish))
        self._act.on_click(window.action(self._said_by_hand))
        self._download.on_click(window.action(lambda: window.download(window.project.path(self._file.value))))

    # What the window asks for ------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show the settings, and where the measuring stands."""
        self.fields.refresh()
        self.about.refresh()
        said = self._window.project.settings.measure
        for source, folder in self._of_source.items():
            folder.visible = source == said.source
        self._show()
        self._pictures()
        first = [f"{said.out}/{name}" for name in (DATA, PAGE)]
        files = [name for name in self._window.project.names() if name.startswith(f"{said.out}/")]
        files.sort(key=lambda name: first.index(name) if name in first else len(first))
        self._file.visible = self._download.visible = bool(files)
        if files:
            chosen_now = self._file.value in files and self._file.options[0] == files[0]
            offer(self._file, files, self._file.value if chosen_now else files[0], None)

    def _now(self) -> dict[str, Any]:
        return self._window.project.settings.measure.model_dump()

    def _change(self, name: str, value: Any) -> None:
        said = self._window.project.settings.measure.model_dump(mode="json")
        self._window.edit(measure={**said, name: "measured" if name == "out" and value is None else value})

    # Measuring ---------------------------------------------------------------------------------------------------

    def _start(self) -> None:
        if self.measuring is not None:
            return
        window = self._window
        self.measuring = measuring = Measuring(window.project, window.robot())
        self._written, self._told = measuring.campaign.session.done, []
        if measuring.address:
            window.show_once("Programs of this machine send lines to", [*measuring.address, "It is shown once."])
        before = measuring.campaign.before
        if before:
            window.tell_lines("Measure", [f"Going on after {before} entries of the log."])
        for notice in measuring.campaign.sighted:
            window.tell(notice)
        self._noted()
        window.refresh()
        threading.Thread(target=self._run, args=(measuring,), daemon=True).start()

    def _run(self, measuring: Measuring) -> None:
        """Ask the source again and again, until it is stopped."""
        while True:
            with self._window.lock, confined_reads(self._window.project.folder):
                if self.measuring is not measuring:
                    return
                if self._window.stopped:
                    self._close()
                    return
                try:
                    self._taken(measuring)
                except InputError as error:
                    self._given_up(error)
                    return
                except Exception as error:  # it is told, and its place is on standard error
                    self._given_up(unforeseen(error))
                    return
            self._window.rest(_TURN)

    def _given_up(self, error: InputError) -> None:
        self._close()
        self._window.refuse(error, self._begin)
        self._window.refresh()

    def _taken(self, measuring: Measuring) -> None:
        """Take what has come, show it, and write the files once all is measured."""
        self._due += float(self._pace.value) * _TURN
        most = int(self._due) if measuring.is_virtual else _MOST
        self._due %= 1.0
        entries, told = measuring.step(most)
        if told:
            more = f" and {len(told) - _TOLD} more" if len(told) > _TOLD else ""
            self._window.tell(NOT_TAKEN(f"{' '.join(told[:_TOLD])}{more}"))
        if not measuring.is_virtual or entries:
            self._noted()
        self._turn += 1
        if entries or told:
            self._show()
            if self._turn % _PICTURES == 0:
                self._pictures()
        if entries and not measuring.campaign.session.done:
            self._written = False
        if measuring.campaign.session.done and not self._written:
            self._written = True
            self._hand_over(measuring)

    def _finish(self) -> None:
        """Write what is there, choose it as the project's measurements, and end."""
        measuring = self._going()
        try:
            measuring.with_what_is_said_now()
        except InputError:
            self._close()
            raise
        self._hand_over(measuring)
        self._close()
        self._window.refresh()

    def _end(self) -> None:
        """Write what is there, and end; Start goes on."""
        measuring = self._going()
        measured = measuring.finish()
        self._close()
        self._window.tell_lines("Measure", measuring.outcome(measured))
        self._window.refresh()

    def _hand_over(self, measuring: Measuring) -> None:
        """Write what is there and choose it as the project's measurements; say what came of it, unless that stands."""
        measured = measuring.finish()
        self._noted()
        outcome, before = measuring.outcome(measured), self._told
        self._told = outcome
        if outcome != before:
            self._window.tell_lines("Measure", outcome)
        if not measured.files:
            raise InputError(
                "no reading of a target is kept, so there are no measurements", cure="Go on, or choose another plan."
            )
        choose_measurements(self._window, measuring.data)
        if outcome != before:
            self._window.tell(MEASURED(_DONE))
        self._window.refresh()

    def _close(self) -> None:
        if self.measuring is not None:
            self._noted()
            self._window.project.theirs = ()
            self.measuring.campaign.close()
            self.measuring = None

    def _noted(self) -> None:
        """Take note of what was written: by the measuring, and by the software whose folder is watched."""
        project = self._window.project
        fields = project.settings.measure if self.measuring is None else self.measuring.fields
        project.theirs = (fields.watch,) if fields.watch is not None and fields.source == "watched folder" else ()
        project.look(fields.out, *project.theirs)

    def _said_by_hand(self) -> None:
        measuring, why = self._going(), str(self._why.value).strip()
        session = measuring.campaign.session
        if self._act.value == "set the reading aside":
            text = str(self._reading.value).strip()
            if text and not text.isdecimal():
                raise InputError("the number of a reading belongs here", parameter="Reading", came=text)
            if not text and not session.kept:
                raise InputError("no reading is kept yet", parameter="Reading")
            measuring.campaign.set_aside(int(text) if text else session.kept[-1].number, why)
            self._reading.value = ""
        else:
            step = session.next
            if step is None or self._point.value not in step.names:
                raise InputError(
                    "there is nothing to leave out", parameter="Point", cure="Choose a point that is to be measured."
                )
            measuring.campaign.leave_out(step.label, str(self._point.value), why)
        self._why.value = ""
        self._written = False
        self._noted()
        self._show()
        self._pictures()

    def _going(self) -> Measuring:
        if self.measuring is None:
            raise InputError("nothing is being measured", cure="Press Start: it goes on where it stood.")
        return self.measuring

    # What is shown -----------------------------------------------------------------------------------------------

    def _show(self) -> None:
        """Show what is next, the last readings, and what to know."""
        measuring = self.measuring
        going = measuring is not None
        self.settings.visible = self._begin.visible = not going
        self._bar.visible = self._by_hand.visible = going
        all_done = measuring is not None and measuring.campaign.session.done
        self._stop.visible, self._end_all.visible = going and not all_done, all_done
        if measuring is None:
            self._next.content = words.paragraph(self._before_start()) + words.paragraph(_RULE)
            if self._shown not in (None, self._window.project.settings.measure.out):
                self._clear()
            return
        self._shown = measuring.fields.out
        session, (done, of) = measuring.campaign.session, measuring.progress()
        self._bar.value = 100.0 * done / of
        kept = f"{done} of {of} steps done; {measuring.kept_words()}."
        said = [_ALL, kept] if all_done else [*measuring.next_words(), kept]
        self._next.content = "".join(words.paragraph(text) for text in said)
        reasons = measuring.reasons()
        self._last.content = (
            words.paragraph(measuring.last_words())
            + words.table(HEAD, measuring.rows(_ROWS))
            + (words.table(("readings", "why not kept", "what it means"), reasons) if reasons else "")
        )
        warnings = [warning for warning in measuring.measured().warnings if warning.code != "unfinished"]
        self._notices.content = words.notices(warnings)
        step = session.next
        points = (NONE,) if step is None else step.names
        offer(self._point, points, self._point.value if self._point.value in points else points[0], None)
        self.scene.show(measuring)

    def _clear(self) -> None:
        """Show no longer what was measured into another folder."""
        self._shown = None
        self._last.content = self._notices.content = ""
        self._drift.place.visible = self._quality.place.visible = False
        self.scene.clear()

    def _before_start(self) -> str:
        project = self._window.project
        out = project.settings.measure.out
        if exists(project.path(out, "out") / LOG):
            return (
                f"In {out} a plan was measured already, as a whole or in part: Start goes on where it stood, with the "
                "plan and the robot of then. For others choose another folder."
            )
        return "Start begins with the first configuration of the plan, or with the nests."

    def _pictures(self) -> None:
        if self.measuring is None:
            return
        session = self.measuring.campaign.session
        for place, drawn in ((self._drift, drift_figure(session)), (self._quality, quality_figure(session))):
            if drawn is not None:
                place.show(drawn, self.measuring)
            else:
                place.place.visible = False
