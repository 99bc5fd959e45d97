import errno
import threading
import time
from datetime import UTC, datetime, timedelta, tzinfo

import pytest

from experiments import clock as clock_module
from experiments.clock import RealClock, VirtualClock, date_text
from tests.stolen_signal import Told, stolen_signal
from tests.waiting import PATIENCE_S


def moment(text: str) -> datetime:
    assert text.endswith("Z")
    return datetime.fromisoformat(text)


def test_a_virtual_clock_starts_at_zero_and_moves_only_by_waiting() -> None:
    clock = VirtualClock()
    assert clock.now() == 0.0
    assert clock.now() == 0.0
    clock.sleep(300.0)
    clock.sleep(0.25)
    assert clock.now() == 300.25


def test_a_virtual_break_waits_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(time, "sleep")
    clock = VirtualClock()
    clock.sleep(1e6)
    assert clock.now() == 1e6


@pytest.mark.parametrize("seconds", [0.0, -1.0, -float("inf")])
def test_waiting_for_a_time_that_is_over_never_runs_a_clock_backwards(seconds: float) -> None:
    clock = VirtualClock()
    clock.sleep(1.0)
    clock.sleep(seconds)
    assert clock.now() == 1.0
    RealClock().sleep(seconds)


def test_virtual_dates_go_with_virtual_seconds() -> None:
    clock = VirtualClock()
    before = moment(clock.utc())
    clock.sleep(20.5)
    assert moment(clock.utc()) - before == timedelta(seconds=20.5)


def test_dates_are_utc_to_the_microsecond_even_when_it_is_zero() -> None:
    clock = VirtualClock()
    clock.sleep(1.0 - moment(clock.utc()).microsecond / 1e6)
    assert clock.utc().endswith(".000000Z")


def test_the_real_clock_is_the_machines() -> None:
    clock = RealClock()
    in_order = [time.monotonic(), clock.now(), time.monotonic()]
    dates_in_order = [datetime.now(UTC), moment(clock.utc()), datetime.now(UTC)]
    assert in_order == sorted(in_order)
    assert dates_in_order == sorted(dates_in_order)
    before = clock.now()
    clock.sleep(0.01)
    assert clock.now() >= before + 0.01


def test_a_date_that_windows_has_no_local_time_of_stands_as_it_is() -> None:
    class Refusing(tzinfo):
        def utcoffset(self, _: datetime | None) -> timedelta:
            raise OSError(errno.EINVAL, "Invalid argument")  # of a date before 1970

        fromutc = utcoffset  # type: ignore[assignment]

    assert date_text("1925-01-01T00:00:00Z", Refusing()) == "1925-01-01T00:00:00Z"


def test_a_journal_can_tell_the_clocks_apart() -> None:
    assert (RealClock().name, VirtualClock().name) == ("real", "virtual")


def test_a_virtual_clock_goes_on_after_the_run_that_stopped_ahead_of_it() -> None:
    clock = VirtualClock()
    clock.go_on_after("2999-01-02T03:04:05.000006Z")
    assert clock.utc() == "2999-01-02T03:04:05.000006Z"
    for earlier in ("2001-01-01T00:00:00.000000Z", "yesterday", ""):
        clock.go_on_after(earlier)
    assert clock.utc() == "2999-01-02T03:04:05.000006Z"


@pytest.mark.slow
def test_a_signal_that_another_thread_takes_wakes_who_waits_for_news():
    news, clock = threading.Condition(), RealClock()
    end_s = clock.now() + PATIENCE_S

    def wait() -> None:
        with news:
            while clock.now() < end_s:
                clock.wait(news, PATIENCE_S)

    with stolen_signal(), pytest.raises(Told):
        wait()


def test_no_news_is_missed_at_any_moment(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(clock_module, "AWAKE_S", 1e-4)
    news, clock, turn = threading.Condition(), RealClock(), [0]

    def play(mine: int) -> None:
        for _ in range(2000):
            with news:
                while turn[0] % 2 != mine:
                    clock.wait(news, None)
                turn[0] += 1
                news.notify_all()

    other = threading.Thread(target=play, args=(1,), daemon=True)
    other.start()
    play(0)
    other.join(PATIENCE_S)
    assert turn == [4000]
