"""Which response times a pause lies in."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

from experiments import events
from experiments.clock import VirtualClock
from experiments.live_run import LiveRun
from experiments.load import load_setup
from experiments.preference.plan import make_plan
from experiments.states import State


class Paper:
    """A journal and a screen that take everything, and a gun that is never asked."""

    def submit(self, *_: object, **__: object) -> Future[None]:
        done: Future[None] = Future()
        done.set_result(None)
        return done

    def __getattr__(self, name: str) -> Any:
        return lambda *_: None


def test_a_pause_lies_in_the_time_since_its_end_or_before_and_in_none_that_began_later() -> None:
    clock, paper = VirtualClock(), Paper()
    plan = make_plan(load_setup("preference").config, "P01", 1, None)
    live = LiveRun(plan=plan, gun=paper, journal=paper, clock=clock, screen=paper, guard_s=0.0)  # type: ignore[arg-type]
    live.enter(State.ASKING)
    clock.sleep(1.0)
    assert not live.paused_since(0.0)
    live.offer(events.Pause())
    assert live.paused_since(0.0)
    clock.sleep(1.0)
    assert live.paused_since(1.5)  # a shot that was on its way when the pause began
    live.offer(events.GoOn())
    clock.sleep(1.0)
    assert live.paused_since(0.0)
    assert live.paused_since(1.5)
    assert not live.paused_since(2.5)
