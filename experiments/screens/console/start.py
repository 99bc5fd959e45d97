"""The start window: who comes next, what is asked of them, and test shots, before a run begins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from PyQt6 import QtWidgets
from PyQt6.QtCore import QEvent, QEventLoop, pyqtSignal
from PyQt6.QtGui import QCloseEvent, QResizeEvent

from device.messages import RecoilError
from experiments.clock import Clock
from experiments.config.door import ConfigError
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.record.journal import JournalError
from experiments.run_request import Again, RunRequest
from experiments.screens.console import people, widgets, windows
from experiments.screens.console.form import Form, Opening, PeopleTable
from experiments.screens.console.over_all import AnyHeld, WhateverPressed
from experiments.screens.console.shot_check import ShotPage
from experiments.screens.console.widgets import SET_ASIDE, WHY, Option, QuestionBox, TextLines, start_sheet
from experiments.screens.phrases import phrase
from experiments.study import enrolment
from experiments.study.folders import (
    Overview,
    PlaceError,
    StudyFolder,
    files_of_people,
    overview,
    read_anew,
    refuse_gone,
)
from experiments.study.study import Participant, RunProgress

_NAME = "start"
_Found = TypeVar("_Found")
SIMULATED = "simulated"
NOTHING_ARMED = phrase("F12 is heard. Nothing is armed here: it stops test shots, practices and runs.")


class StartWindow(QtWidgets.QWidget):
    """A table of the participants, a form for the next one, and the ways to go on. `choice` is what was chosen."""

    closed = pyqtSignal()

    def __init__(self, study: StudyFolder, opening: Opening, clock: Clock) -> None:
        super().__init__()
        self._study, self._opening, self._clock = study, opening, clock
        self.choice: RunRequest | None = None
        self.question: QuestionBox | None = None
        self._simulation_is_known = False
        self._closing = self._was_left = self._refuses = False
        self._scale = 0.0
        self._build()
        self._fill()
        self._propose(opening.participant_id)
        self._say_first(opening)

    # building

    def _build(self) -> None:
        self.setWindowTitle("Recoil – start")
        self.form = Form(self._study.experiments, self._study.config.eligibility.ask, self._opening)
        self.shots = ShotPage(self._opening.gun, self._study.results, self._clock)
        self.table = PeopleTable(self._study.experiments)
        self.next, self.saved = TextLines("detail"), TextLines("saved", most_lines=5)
        self.pages = QtWidgets.QStackedWidget()
        for page in (self._page(), self.shots):
            self.pages.addWidget(page)
        place = TextLines("place", f"{self._study.config.title} · {self._study.results.resolve()}", most_lines=3)
        top = widgets.fill(QtWidgets.QHBoxLayout(), (place, 1), self._gun())
        widgets.fill(QtWidgets.QVBoxLayout(self), top, (self.pages, 1), margins=None)
        self._connect()

    def _page(self) -> QtWidgets.QWidget:
        page, self._foot = QtWidgets.QWidget(), QtWidgets.QVBoxLayout()
        left = widgets.fill(QtWidgets.QVBoxLayout(), (self.table, 1), self._foot)
        middle = widgets.fill(QtWidgets.QHBoxLayout(), (left, 3), (self.form, 2))
        widgets.fill(QtWidgets.QVBoxLayout(page), self.next, (middle, 1), self.saved, self._buttons(page))
        return page

    def _gun(self) -> QtWidgets.QWidget:
        simulated = self._opening.gun == SIMULATED
        made = widgets.text_label(
            "gun", phrase("SIMULATED GUN") if simulated else phrase("Gun: {gun}", gun=self._opening.gun), wrap=False
        )
        widgets.set_mood(made, "ask" if simulated else "wait")
        return made

    def _buttons(self, page: QtWidgets.QWidget) -> QtWidgets.QGridLayout:
        def button(text: str, key: str, slot: Callable[[], object], name: str = "") -> QtWidgets.QPushButton:
            return widgets.button(page, text, key, slot, name=name)

        self.test_button = button(phrase("Test shot"), "Ctrl+T", self._test_shot)
        self.exclude_button = button(phrase("Exclude…"), "Alt+E", self._ask_exclusion)
        grid = QtWidgets.QGridLayout()
        grid.addWidget(button(phrase("Start"), "Ctrl+Return", self._start, "large"), 0, 0, 2, 1)
        grid.addWidget(button(phrase("Practice"), "Ctrl+P", self._practice), 0, 1)
        grid.addWidget(button(phrase("Training (simulated gun)"), "Ctrl+R", self._training), 0, 2, 1, 2)
        grid.addWidget(self.test_button, 1, 1, 1, 2)
        grid.addWidget(self.exclude_button, 1, 3)
        grid.addWidget(button(phrase("Quit"), "Ctrl+Q", self.close), 0, 4, 2, 1)
        for column, stretch in enumerate((3, 2, 2, 2, 1)):
            grid.setColumnStretch(column, stretch)
        return grid

    def _connect(self) -> None:
        self.table.person_chosen.connect(self.form.code.setText)
        self.form.edited.connect(self._take_back)
        self.form.code_edited.connect(self._follow_code)
        self.form.experiment_edited.connect(self._show_choice)
        self.shots.left.connect(self._leave_shots)
        self.shots.over = self._shot_over
        AnyHeld(self, "F12", self._emergency_stop)
        AnyHeld(self, "Esc", self.shots.call_off, when=lambda: self.shots.is_running)
        WhateverPressed(self, self.shots.call_off, but="Ctrl+T")

    # showing

    def _fill(self) -> None:
        """Look at the study, and show how it stands."""
        unread: list[str] = []
        try:
            self._read_anew()
        except RecoilError as error:
            unread += str(error).splitlines()
        seen = overview(self._study)
        self._is_unread, problems = bool(unread), tuple(dict.fromkeys([*unread, *seen.problems]))
        self._seen: Overview = replace(seen, problems=problems, next=None if unread else seen.next)
        self._opening.had.update(files_of_people(self._study.results))
        self.table.show_people(self._seen.participants)
        self.next.say(people.coming_text(self._seen))

    def _read_anew(self, participant_id: str = "") -> None:
        """Have the study as its files are now. `ConfigError`; `PlaceError`: other fields, or as `refuse_gone`."""
        before, now = self._study, read_anew(self._study)
        fields = [(one.experiments, one.config.experiments, one.config.eligibility.ask) for one in (before, now)]
        if fields[0] != fields[1]:
            raise PlaceError(
                phrase(
                    "{source}: the experiments, or what participants are asked, are not those that this window opened "
                    "with: quit, and start it again",
                    source=before.source,
                )
            )
        self._study = now
        refuse_gone(now.results, self._opening.had, participant_id)

    def _say_first(self, opening: Opening) -> None:
        entered, bad = self.form.entered(), [*filter(None, [opening.said]), *self._seen.problems]
        code, experiment = entered.participant_id, entered.experiment
        named = people.named_text(opening.named, code, self._person(code), experiment)
        told = filter(None, [self.shots.owed_text, named, people.changed_text(self._seen)])
        self.say("\n".join([*bad, *told]), "bad" if bad else "ask", refuses=self._is_unread)

    def _propose(self, participant_id: str) -> None:
        """Who was there before if they have something left to do, else who comes next."""
        before, coming = self._person(participant_id), self._seen.next
        if before is None or before.gone or not before.open_runs:
            participant_id = "" if coming is None else coming.participant_id
        self.form.code.setText(participant_id)
        self._follow_code()
        self.form.code_again.setFocus()

    def _person(self, participant_id: str) -> Participant | None:
        return next((one for one in self._seen.participants if one.participant_id == participant_id), None)

    def _follow_code(self) -> None:
        """Show what is on record of the code, and the experiment that comes next for them in the order of the study."""
        person = self._person(self.form.participant_id)
        self.form.show_facts(person)
        self.form.experiment.setCurrentText(enrolment.next_experiment(person, self._study.experiments))
        self._show_choice()

    def _show_remark(self) -> None:
        """What there is to know of who is chosen, where nothing says that they may not begin."""
        said = people.remark_of_choice(self.form.entered(), self._study, self._seen, self._opening.had)
        self.form.remark.say(*("", "") if self._refuses else said)

    def _show_choice(self) -> None:
        self._show_remark()
        person = self._person(self.form.participant_id)
        out = person is not None and bool(person.gone)
        self.exclude_button.setText(f"{phrase('Readmit…') if out else phrase('Exclude…')}  [Alt+E]")
        self.shots.choose(self._setup())
        self.test_button.setText(phrase("{next}  [Ctrl+T]", next=self.shots.next_text()))

    def changeEvent(self, event: QEvent | None) -> None:  # noqa: N802 - Qt's name
        """Look again whenever somebody comes back to the window: what is typed, chosen or asked stays."""
        super().changeEvent(event)
        if event is None or event.type() != QEvent.Type.ActivationChange:
            return
        if not self.isActiveWindow():
            self.shots.call_off(phrase("Another window had the keys: F12 would not have been heard."))
        if self.isActiveWindow() and self._was_left and not self.shots.is_running:
            self._fill()
            self._show_choice()
        self._was_left = not self.isActiveWindow()

    def resizeEvent(self, event: QResizeEvent | None) -> None:  # noqa: N802 - Qt's name
        """Have the type grow with the window."""
        super().resizeEvent(event)
        if (scale := windows.type_scale(self.width(), self.height())) != self._scale:
            self._scale = scale
            self.setStyleSheet(windows.scaled_sheet(start_sheet(), scale))

    def closeEvent(self, event: QCloseEvent | None) -> None:  # noqa: N802 - Qt's name
        """Let whoever waits for a choice go on, once no test shot is under way."""
        if self.shots.is_running and not self._closing and event is not None:
            self._closing = True
            self.shots.emergency_stop()
            event.ignore()
            return
        super().closeEvent(event)
        self.shots.end(wait=False)
        windows.remember(self, _NAME)
        self.closed.emit()

    def say(self, text: str, mood: str, *, refuses: bool = False) -> None:
        """Show a line of answer; where it refuses somebody, what else there is to know of them gives way to it."""
        self.saved.say(text, mood)
        self._refuses = refuses
        self._show_remark()

    # questions

    def _ask(self, question: QuestionBox) -> None:
        self._take_back()
        self.question = question
        self._foot.addWidget(question)
        question.show()  # now, so that its keys answer at once

    def _take_back(self) -> None:
        """What was asked belonged to what stood in the form."""
        self.say("", "")
        if self.question is not None:
            self.question.hide()
            self.question.deleteLater()
            self.question = None

    def _leave_it(self) -> Option:
        return Option(text=phrase("Leave it"), key="Esc", do=lambda _: self._take_back())

    # choosing

    def _start(self) -> None:
        """Nothing goes on record before all is answered that is asked: they may leave it."""
        run = None if self._shot_is_owed() else self._allowed(practice=False)
        if run is None:
            return
        if self._asks_simulation:
            self._ask_simulation(phrase("Start all the same?"), phrase("Start, simulated"), self._start)
        elif run.state == "in progress":
            self._ask_resume(run)
        elif self._admit(practice=False) is not None:
            self._leave(self.form.participant_id)

    def _practice(self) -> None:
        if self._shot_is_owed() or self._allowed(practice=True) is None:
            return
        if self._asks_simulation:
            self._ask_simulation(phrase("Practise all the same?"), phrase("Practise, simulated"), self._practice)
        elif self._admit(practice=True) is not None:
            self._leave(self.form.participant_id, practice=True)

    def _training(self) -> None:
        if not self._shot_is_owed() and self._checked(lambda: True):
            self._leave("training", practice=True, training=True)

    @property
    def _asks_simulation(self) -> bool:
        return self._opening.gun == SIMULATED and not self._simulation_is_known

    def _allowed(self, *, practice: bool) -> RunProgress | None:
        """How the run stands that may begin now; `None`, with the reason shown, if it may not."""
        entered = self.form.entered()
        return self._checked(lambda: enrolment.may_run(self._study, entered, practice=practice)[0], theirs=True)

    def _admit(self, *, practice: bool) -> RunProgress | None:
        """As `_allowed`, with what was said on record."""
        entered = self.form.entered()
        return self._checked(lambda: enrolment.admit(self._study, entered, self._clock, practice=practice), theirs=True)

    def _checked(self, check: Callable[[], _Found], *, theirs: bool = False) -> _Found | None:
        """What a check found by the files as they are now, or `theirs`; `None`, with the reason said, if it refused."""
        self._take_back()
        try:
            self._read_anew(self.form.participant_id if theirs else "")
            return check()
        except (ConfigError, PlaceError, JournalError) as error:
            self._refused(str(error))
            return None

    def _refused(self, reason: str) -> None:
        """What stands in the window may be old: look again, then say the reason."""
        self._fill()
        self._show_choice()
        self.say(reason, "bad", refuses=True)

    def _ask_simulation(self, asked: str, sure: str, go_on: Callable[[], None]) -> None:
        def known(_: str) -> None:
            self._simulation_is_known = True
            go_on()

        code = self.form.participant_id
        text = phrase("The gun is SIMULATED: {participant_id} will feel nothing.", participant_id=code)
        options = (Option(text=sure, key="Ctrl+S", do=known), self._leave_it())
        self._ask(QuestionBox(f"{text} {asked}", options))

    def _ask_resume(self, run: RunProgress) -> None:
        answers = (
            Option(text=phrase("Go on with it"), key="Ctrl+G", do=lambda _: self._begin_again("resume", "")),
            Option(text=SET_ASIDE, key="Ctrl+N", do=lambda why: self._begin_again("fresh", why)),
            self._leave_it(),
        )
        text = phrase(
            "{stopped} Go on there, or set it aside and start anew?",
            stopped=people.stopped_text(self.form.participant_id, run),
        )
        self._ask(QuestionBox(text, answers, reason=phrase("to start anew: {why}", why=WHY)))

    def _begin_again(self, again: Again, reason: str) -> None:
        """Check everything once more, as Start does: the study may have gone on at another console meanwhile."""
        if again == "fresh" and not self._is_reason(reason):
            return
        run = self._admit(practice=False)
        if run is not None and run.state == "in progress":
            self._leave(self.form.participant_id, again=again, reason=reason)
        elif run is not None:
            self._start()

    def _is_reason(self, reason: str) -> bool:
        """Whether a reason can be kept, as the question that is open says."""
        return self.question is not None and self.question.takes(reason, self.say)

    def _leave(
        self, code: str, *, again: Again = "ask", reason: str = "", practice: bool = False, training: bool = False
    ) -> None:
        if self.choice is None:
            self._opening.had.update(files_of_people(self._study.results))
            self.choice = RunRequest(
                setup=self._setup(),
                participant_id=code,
                results=self._study.results,
                gun=SIMULATED if training else self._opening.gun,
                again=again,
                anew_reason=reason,
                practice=practice,
                training=training,
                screen="console",
                options=self.form.options(),
                sensor=self.form.sensor.text().strip(),
                markers=self.form.markers.isChecked(),
                language=self.form.language,
            )
            self.close()

    def _setup(self) -> Setup[DesignConfig]:
        return self._study.setup_of(self.form.experiment.currentText())

    # excluding

    def _ask_exclusion(self) -> None:
        person = self._person(self.form.participant_id)
        if person is None:
            self._take_back()
            self.say(phrase("Choose in the table who is to be excluded; a code that is not there needs none."), "bad")
            return
        out = bool(person.gone)
        verb, act = (phrase("Readmit"), enrolment.readmit) if out else (phrase("Exclude"), enrolment.exclude)
        text = f"{verb} {person.participant_id}? "
        text += (
            phrase("On record is: {note}.", note=people.note_text(person))
            if out
            else phrase("Their logs stay, but are left out of the analysis.")
        )

        def carry_out(reason: str) -> None:
            if self._is_reason(reason):
                self._change(lambda: act(self._study.results, person.participant_id, reason, self._clock))

        answers = (Option(text=f"{verb} {person.participant_id}", key="Ctrl+D", do=carry_out), self._leave_it())
        self._ask(question := QuestionBox(text, answers, reason=WHY))
        question.reason.setFocus()

    def _change(self, act: Callable[[], None]) -> None:
        """Change the register, and show how things stand then."""

        def changed() -> bool:
            act()
            return True

        if self._checked(changed, theirs=True) is None:
            return
        self._fill()
        self._show_choice()
        self.say("\n".join(self._seen.problems), "bad")
        self.form.code_again.setFocus()

    # test shots

    def _test_shot(self) -> None:
        self._take_back()
        if not self._shot_is_owed():
            self._enter_shots()

    def _shot_is_owed(self) -> bool:
        """Whether a test shot comes before all else, as the last one ended by an emergency stop: it is asked for."""
        if stopped := self.shots.owed_text:
            text = phrase("{stopped} A test shot comes first. Is the gun where it hurts nobody?", stopped=stopped)
            sure = Option(text=phrase("It is: test shot"), key="Ctrl+S", do=lambda _: self._enter_shots())
            self._ask(QuestionBox(text, (sure, self._leave_it())))
        return self.shots.owed

    def _enter_shots(self) -> None:
        if self._checked(lambda: True):
            self.shots.choose(self._setup())
            self.pages.setCurrentWidget(self.shots)
            self.shots.enter()
            self.shots.begin()

    def _emergency_stop(self) -> None:
        if self.pages.currentWidget() is self.shots:
            self.shots.emergency_stop()
        else:
            self.say(NOTHING_ARMED, "ask")

    def _shot_over(self) -> None:
        if self._closing:
            self.close()

    def _leave_shots(self) -> None:
        self.pages.setCurrentIndex(0)
        self._show_choice()
        self.say(self.shots.owed_text, "bad")
        self.form.code_again.setFocus()


def choose_run(study: StudyFolder, opening: Opening, clock: Clock) -> RunRequest | None:
    """Show the start window until something is chosen; `None`, if nothing was. `JournalError` as of its test shots."""
    window = StartWindow(study, opening, clock)
    loop = QEventLoop()
    window.closed.connect(loop.quit)
    with windows.signals_to(lambda _: window.close()):  # whoever asks for a choice hears of it as well
        windows.open_as_left(window, _NAME)
        windows.FreshShortcuts(window)
        window.activateWindow()
        loop.exec()
    window.shots.end(wait=True)
    choice = window.choice
    windows.let_go(window)
    return choice
