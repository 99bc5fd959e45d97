"""The line of answer of the console's window: what stands there, and for how long; off screen."""

from __future__ import annotations

from typing import Any

import pytest

from experiments.clock import VirtualClock
from experiments.design import planning
from experiments.live_run import HALT_UNSAVED
from experiments.load import load_setup
from experiments.screens.console.view import About, Saved, Trouble
from experiments.session.remarks import Halted, Noted
from experiments.session.steps import Answered, Failed, FireShot, Prepare, Prepared
from tests.asked import ask

pytest.importorskip("PyQt6")
pytestmark = pytest.mark.slow

LOST = "The participant’s screen stood still for 2.1 s"
SETUP = load_setup("direction")
PLAN = planning.plan_of(SETUP.config, "P01", 1)


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setenv("QT_QPA_PLATFORM", "offscreen")
    from experiments.screens.console.app import application
    from experiments.screens.console.window import ConsoleWindow
    from experiments.screens.console.windows import let_go

    application()
    window = ConsoleWindow(About(setup=SETUP, plan=PLAN), VirtualClock())
    yield window
    let_go(window)


def answered(number: int) -> Saved:
    return Saved(step=ask(PLAN.trials[number]), word=Answered(value="forward", by="participant"))


def test_what_befell_one_trial_stands_until_something_is_said_of_another(window: Any) -> None:
    one, other = PLAN.trials[:2]
    window.take(Trouble(text=LOST, trial=one))
    window.take(answered(0))
    window.take(Saved(step=Prepare(trial=other, attempt=1), word=Prepared()))
    assert LOST in window.saved.text()
    window.take(Saved(step=FireShot(trial=other, attempt=1), word=Failed(cause="no answer")))
    assert "The gun failed" in window.saved.text()
    assert LOST not in window.saved.text()
    window.take(answered(1))
    assert LOST not in window.saved.text()


def test_that_something_is_well_again_does_not_come_back_after_a_refusal(window: Any) -> None:
    window.take(Trouble(text="Starting it …", mood="wait"))
    window.take(Trouble(text="It is there again.", mood="good"))
    assert window.saved.text() == "It is there again."
    window.say("Set the damper first.", "bad")
    window.clock.sleep(5.0)
    window.refresh()
    assert window.saved.text() == ""


def test_what_the_disk_refused_of_an_emergency_stop_is_said_until_it_is_on_record(window: Any) -> None:
    stop = Saved(step=None, word=Halted(by="experimenter"))
    window.take(Trouble(text=f"journal: no space. {HALT_UNSAVED}"))
    window.take(Saved(step=None, word=Noted(trial=PLAN.trials[0], text="room was made")))
    window.take(stop)
    assert window.saved.text() == "Saved. The emergency stop is on record now."
    window.take(Trouble(text="The gun does not say that it is disarmed"))
    window.take(stop)
    assert window.saved.text() == "The gun does not say that it is disarmed"
