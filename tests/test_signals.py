"""Signals end windows in order, and the day around them: by the event loop, never in the midst of something."""

from __future__ import annotations

import os
import signal

import pytest

pytest.importorskip("PyQt6")
os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PyQt6.QtCore import QCoreApplication

from experiments.screens.console.app import application
from experiments.screens.console.windows import signals_to

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def qt() -> None:
    application()


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT"])
def test_a_signal_is_told_by_its_name_and_the_handlers_from_before_come_back(name: str) -> None:
    number, told = getattr(signal, name), list[str]()
    before = signal.getsignal(number)
    with signals_to(told.append) as came:
        os.kill(os.getpid(), number)
        assert (came, told) == ([name], [])  # it came in the midst of something, which is not disturbed
        QCoreApplication.processEvents()
    assert told == [name]
    assert signal.getsignal(number) is before


def test_what_ends_a_run_ends_the_day_around_it() -> None:
    told: list[str] = []
    with signals_to() as day:
        with signals_to(told.append) as run:
            os.kill(os.getpid(), signal.SIGTERM)
            assert run == day == ["SIGTERM"]
        QCoreApplication.processEvents()
        assert told == ["SIGTERM"]


def test_a_signal_between_two_windows_interrupts_the_day() -> None:
    with pytest.raises(KeyboardInterrupt, match="SIGTERM"), signals_to():
        os.kill(os.getpid(), signal.SIGTERM)
