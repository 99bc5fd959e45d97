"""Signals end windows in order: the inner one is told first, then what lies around it; afterwards all is as before."""

from __future__ import annotations

import os
import signal

import pytest

pytest.importorskip("PyQt6")

from experiments.screens.console.signals import signals_to


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_is_told_by_its_name_and_the_handlers_from_before_come_back(name: str) -> None:
    number, told = getattr(signal, name), list[str]()
    before = signal.getsignal(number)
    with signals_to(told.append):
        os.kill(os.getpid(), number)
    assert told == [name]
    assert signal.getsignal(number) is before


def test_what_ends_a_run_ends_the_day_around_it() -> None:
    told: list[str] = []
    with signals_to(lambda name: told.append(f"day {name}")):
        with signals_to(lambda name: told.append(f"run {name}")):
            os.kill(os.getpid(), signal.SIGTERM)
        assert told == ["run SIGTERM", "day SIGTERM"]
        os.kill(os.getpid(), signal.SIGTERM)
    assert told == ["run SIGTERM", "day SIGTERM", "day SIGTERM"]
