"""A board that begins shots late: what the host is told is what was rendered."""

from __future__ import annotations

from contextlib import suppress

import pytest

from device import LinkError, ShotReport
from device.twin.machine import LATE_PULSE_US
from device.twin.twin import Rendered
from tests.twins import PULSE, Pair, Troubles, a_pair, a_shot

SHOTS = 40


def fired(pair: Pair) -> list[ShotReport]:
    reports = []
    for _ in range(SHOTS):
        with suppress(LinkError):
            pair.ready()
            reports.append(pair.gun.fire(a_shot()))
    return reports


def lasted_s(rendered: Rendered) -> float:
    assert rendered.end_s is not None
    return rendered.end_s - rendered.start_s


@pytest.mark.slow
def test_no_shot_that_the_board_shortened_or_lost_is_reported_as_fired_and_none_is_rendered_twice(tmp_path):
    with a_pair(tmp_path, Troubles(late=0.5), seed=3) as pair:
        reports, ledger = fired(pair), pair.twin.body.ledger
    allowed_s = LATE_PULSE_US / 1e6
    whole = [rendered for rendered in ledger if lasted_s(rendered) >= PULSE.pulse_s - allowed_s - 1e-6]
    assert pair.twin.accidents.count("late") > SHOTS / 4
    assert 0 < len(reports) == len(whole) < len(ledger)
    assert len({rendered.mark for rendered in ledger}) == len(ledger)
    for report, rendered in zip(reports, whole, strict=True):
        assert report.timing is not None
        assert report.pulse_start_s == pytest.approx(rendered.start_s, abs=report.timing.uncertainty_s + allowed_s)
