"""Trains of shots: asked for ahead, each for its own tick, never too soon, and each in the journal, come what may."""

from __future__ import annotations

import math
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from device import LimitError, LinkError, Pulse, Shot, ShotReport, ShotTiming
from device.words import GunStatus
from experiments.record.journal import read_journal
from experiments.runner import LEAD_S
from tests.serial_runs import of_trains
from tests.sittings import Sitting, TroubledGun, resumed_rows, sitting


def timing(report: ShotReport) -> ShotTiming:
    """How a shot on a line might have come about."""
    return ShotTiming(
        requested_s=report.requested_s,
        written_s=report.requested_s,
        acknowledged_s=report.pulse_end_s,
        accepted_s=report.requested_s,
        pulse_start_s=report.pulse_start_s,
        pulse_end_s=report.pulse_end_s,
        uncertainty_s=1e-4,
        gun_accepted_us=1,
        gun_start_us=2,
        gun_end_us=3,
        gun_count=1,
        asked=1,
    )


class ListeningGun(TroubledGun):
    """Keeps when each shot was asked for, and for when; tells of each how it came about."""

    def __init__(self, *of: Any) -> None:
        super().__init__(*of)
        self.clock = of[1]
        self.asks: list[tuple[float, float | None]] = []
        self.reports: list[ShotReport] = []

    def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
        self.asks.append((self.clock.now(), at_s))
        report = super().fire(shot, at_s)
        told = {name: getattr(report, name) for name in report.__slots__} | {"timing": timing(report)}
        self.reports.append(ShotReport(**told))
        return self.reports[-1]


def listening(
    folder: Path, troubles: dict[tuple[str, int], BaseException] | None = None, kind: type[ListeningGun] = ListeningGun
) -> tuple[Sitting, ListeningGun]:
    desk = sitting("preference", folder)
    gun = kind(desk.setup, desk.clock, troubles or {})
    desk.screen.gun = gun
    return desk._replace(gun=gun), gun


def test_a_trains_shots_are_asked_for_ahead_of_whole_ticks_since_the_first(tmp_path: Path) -> None:
    desk, gun = listening(tmp_path)
    desk.carry_out()
    first_s, ticks = 0.0, 0
    for (asked_s, at_s), report in zip(gun.asks, gun.reports, strict=True):
        ticks = 0 if at_s is None else ticks + 1
        first_s = report.pulse_start_s if at_s is None else first_s
        assert round(1e6 * report.pulse_start_s) == round(1e6 * first_s) + ticks * 1_000_000
        assert at_s is None or asked_s == pytest.approx(at_s - LEAD_S, abs=1e-9)
    assert ticks > 3


def test_a_shot_whose_magnet_is_not_home_by_its_tick_waits_for_it(tmp_path: Path) -> None:
    class Slow(ListeningGun):
        def status(self) -> GunStatus:
            found = super().status()
            late = {name: getattr(found, name) for name in found.__slots__}
            return GunStatus(**late | {"ready_at_s": found.ready_at_s + (1.1 if self.reports else 0.0)})

    desk, slow = listening(tmp_path, kind=Slow)
    desk.carry_out()
    # a gun counts in whole microseconds
    starts_homes_us = [(round(1e6 * one.pulse_start_s), round(1e6 * one.home_predicted_s)) for one in slow.reports]
    assert len(starts_homes_us) > 3
    assert all(start >= home + 1_100_000 for (_, home), (start, _) in pairwise(starts_homes_us))


@pytest.mark.slow
@pytest.mark.parametrize("stood_s", [0.5, 1.6, 3.4, 3.9])
def test_shots_that_a_standstill_of_the_machine_held_up_are_not_made_up_for(tmp_path: Path, stood_s: float) -> None:
    """None follows another within half of the design's interval."""

    class StandsStill(ListeningGun):
        def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
            if len(self.reports) == 2:
                self.clock.sleep(stood_s)
            return super().fire(shot, at_s)

    desk, gun = listening(tmp_path, kind=StandsStill)
    desk.carry_out()
    starts = [one.pulse_start_s - gun.reports[0].pulse_start_s for one in gun.reports[: int(desk.rows()[0]["shots"])]]
    first_tick = math.ceil(starts[2] + 0.5)
    assert starts[2] == pytest.approx(2.0 - LEAD_S + stood_s, abs=1e-6)
    assert starts[3:] == pytest.approx([first_tick + number for number in range(len(starts[3:]))], abs=1e-6)
    assert starts[3:]
    assert min(later - sooner for sooner, later in pairwise(starts)) >= 0.5


def test_a_gun_that_is_always_late_keeps_its_rate(tmp_path: Path) -> None:
    class Late(ListeningGun):
        def fire(self, shot: Shot, at_s: float | None = None) -> ShotReport:
            return super().fire(shot, None if at_s is None else at_s + 0.4)

    desk, gun = listening(tmp_path, kind=Late)
    desk.carry_out()
    starts = [one.pulse_start_s for one in gun.reports[: int(desk.rows()[0]["shots"])]]
    assert [later - sooner for sooner, later in pairwise(starts[1:])] == pytest.approx(
        [1.0] * (len(starts) - 2), abs=1e-6
    )
    assert len(starts) > 3


def test_every_shot_of_a_train_is_in_the_journal_with_its_times(tmp_path: Path) -> None:
    desk, gun = listening(tmp_path)
    desk.carry_out()
    trains = list(of_trains(read_journal(desk.where.journal)))
    assert [len(shots) for shots, _ in trains] == [int(row["shots"]) for row in desk.rows()]
    shots = [shot for train, _ in trains for shot in train]
    assert [shot["pulse_start_s"] for shot in shots] == [report.pulse_start_s for report in gun.reports]
    assert all(shot["timing"]["acknowledged_s"] == shot["pulse_end_s"] for shot in shots)
    assert all([shot["shot"] for shot in train] == list(range(1, len(train) + 1)) for train, _ in trains)


def test_a_train_that_fails_keeps_the_shots_that_were_felt_before(tmp_path: Path) -> None:
    desk, gun = listening(tmp_path, {("fire", 5): LinkError("no answer")})
    desk.carry_out()
    (felt, outcome), (_, again), *_ = of_trains(read_journal(desk.where.journal))
    assert outcome == {"kind": "failed", "cause": "no answer", "presented": True}
    assert [shot["shot"] for shot in felt] == [1, 2, 3, 4]
    assert [shot["pulse_start_s"] for shot in felt] == [report.pulse_start_s for report in gun.reports[:4]]
    assert again is not None
    assert again["kind"] == "presented"


@pytest.mark.parametrize("stop", [KeyboardInterrupt(), RuntimeError("a bug")], ids=lambda stop: type(stop).__name__)
def test_a_train_that_is_stopped_keeps_them_as_well_and_is_presented_again(tmp_path: Path, stop: BaseException) -> None:
    desk, _ = listening(tmp_path, {("fire", 4): stop})
    with suppress(type(stop)):
        desk.carry_out()
    ((felt, outcome),) = of_trains(read_journal(desk.where.journal))
    assert [shot["shot"] for shot in felt] == [1, 2, 3]
    assert outcome is None
    rows = resumed_rows(desk)
    assert (rows[0]["attempts"], rows[0]["flags"]) == ("2", "interrupted")


def test_a_shot_too_far_ahead_is_refused_by_the_gun_that_is_none(tmp_path: Path) -> None:
    desk, gun = listening(tmp_path)
    gun.arm()
    shot = Shot(method="asymmetric-1", direction="forward", drive=Pulse(voltage_V=16.0, pulse_s=0.010))
    for at_s in (desk.clock.now() + 2.001, float("nan"), float("inf")):
        with pytest.raises(LimitError, match="2 s ahead" if math.isfinite(at_s) else "a finite time"):
            gun.fire(shot, at_s)
    assert gun.reports == []
    assert gun.fire(shot, desk.clock.now() + 2.0).pulse_start_s == desk.clock.now() + 2.0
