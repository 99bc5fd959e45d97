"""A gun that lies, well framed: no word of it is believed that contradicts the order, itself or the host's clock."""

import math
import re
from dataclasses import replace
from random import Random

import pytest

from device import LinkError
from device.limits import DriveHistory
from device.methods import paper_methods
from device.serial_gun.lines import Contradiction, CutShort, HostTime, Reply
from device.serial_gun.reports import (
    MAX_UNCERTAINTY_S,
    BelievedShot,
    ShotOrder,
    asked,
    check_record,
    check_standing,
    check_times,
    ready_s,
)
from device.wire.records import ShotRecord, StatusRecord
from experiments.record.journal import read_journal
from experiments.study.folders import place
from tests.forger import FORGERIES, ShotLiar, a_lying_pair, a_lying_twin
from tests.serial_runs import SPEED, check, hasty, run_all, timings_of
from tests.twins import Troubles, a_pair, a_shot
from tests.waiting import wait_for

pytestmark = pytest.mark.slow

FAR_US = 60_000_000


def once(pair, shot=None):
    pair.ready()
    return pair.gun.fire(shot or a_shot())


@pytest.mark.parametrize("kind", FORGERIES)
def test_a_forged_record_is_refused_with_its_cause_and_the_next_shot_is_fired(tmp_path, kind):
    with a_lying_pair(tmp_path) as (pair, forger):
        first = once(pair)
        forger.lie = liar = ShotLiar(1.0, FAR_US, kinds=(kind,))
        with pytest.raises(LinkError, match=FORGERIES[kind][1]) as refused:
            once(pair)
        assert "may have been fired" in str(refused.value)
        assert str(refused.value).endswith("; the gun's COUNT was 1 before it")
        assert set(liar.told) == {kind}  # once more where a record was asked for again
        assert pair.gun.status().state == "disarmed"
        assert abs(pair.gun.history.ready_s - pair.clock()) < 60  # 3 s of the world: nobody waits for a forged time
        forger.lie = lambda body: body
        third = once(pair)
        assert [first.timing.gun_count, third.timing.gun_count] == [1, 3]
        assert len(pair.twin.body.ledger) == 3


def swallow_and_invent(pair, forger, count):
    """No trigger reaches the gun any more; of each, the host hears that its shot was done, in perfect order."""
    triggers = []

    def swallow(body):
        if body.startswith("TRIG "):
            triggers.append(body)
        return body.startswith("TRIG ")

    def invent(body):
        if not (triggers and body.startswith("SHOT ")):
            return body
        mark, start_us = int(re.match(r"TRIG (\d+)", triggers[-1])[1]), pair.twin.clock_us() - 50_000
        setting = "asymmetric-2,FORW,PULS,16000,10000,211005"
        return f"SHOT {count},{mark},DONE,{start_us},{start_us},{start_us + 10_000},{start_us + 211_005},{setting}"

    forger.swallow, forger.lie = swallow, invent


def test_a_shot_of_a_trigger_that_never_arrived_is_not_believed(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        swallow_and_invent(pair, forger, count=0)
        with pytest.raises(LinkError, match="COUNT is 0; it must be 1"):
            once(pair)
        assert pair.twin.body.ledger == []


def test_a_lie_without_a_flaw_is_found_out_by_the_next_count(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        swallow_and_invent(pair, forger, count=1)
        assert once(pair).timing.gun_count == 1
        forger.swallow, forger.lie = lambda _: False, lambda body: body
        with pytest.raises(LinkError, match="COUNT is 1; it must be 2"):
            once(pair)
        assert once(pair).timing.gun_count == 2


@pytest.mark.parametrize(
    ("forge", "cause"),
    [
        (lambda shot: replace(shot, mark=shot.mark - 1), "was not fired, but COUNT is 1; it must be 0, as before"),
        (lambda shot: replace(shot, ending="NONE"), "was not fired, but COUNT is 1; it must be 0, as before"),
        (lambda shot: replace(shot, mark=shot.mark - 1, count=0), "the shot was fired, and its answer was lost"),
    ],
    ids=["another mark", "never begun", "another mark and its count"],
)
def test_a_shot_that_was_fired_is_not_fired_again_whatever_is_said_of_it(tmp_path, forge, cause):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        pair.ready()
        lost = []

        def lie(body):
            if not body.startswith("SHOT "):
                return body
            lost.append(body)
            return None if len(lost) == 1 else forge(ShotRecord.parse(body)).text()

        forger.lie = lie
        with pytest.raises(LinkError, match=cause):
            pair.gun.fire(a_shot())
        assert len(pair.twin.body.ledger) == 1


def test_a_gun_that_says_for_ever_that_it_drives_is_given_up(tmp_path):
    with a_lying_pair(tmp_path) as (pair, forger):
        lost = []

        def lie(body):
            if ",DONE," not in body:
                return body
            lost.append(body)
            return None if len(lost) == 1 else body.replace(",DONE,", ",DRIV,")

        forger.lie = lie
        with pytest.raises(LinkError, match=r"not believed: DRIV, driven for 10000"):
            once(pair)
        assert pair.gun.status().state == "disarmed"


def test_a_clock_that_was_misread_is_learnt_again_before_a_shot_is_disbelieved(tmp_path):
    draw = Random(1)

    def lie(body):
        if not body.startswith("TIME ") or draw.random() > 0.3:
            return body
        return f"TIME {max(0, int(body.split()[1]) + draw.choice((-FAR_US, FAR_US)))}"

    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        pair.ready()
        forger.lie = lie
        done = 0
        for _ in range(12):
            try:
                report = once(pair)
            except LinkError as error:
                assert "earlier than" in str(error) or "later than" in str(error) or "not fired" in str(error)  # noqa: PT017
            else:
                done += 1
                timing = report.timing
                near_s = 0.01 + timing.uncertainty_s  # on a busy machine the clock is known less well
                assert timing.written_s - near_s <= report.pulse_start_s <= timing.acknowledged_s + near_s
        assert done > 4


def test_a_gun_whose_ready_time_is_beyond_all_bounds_is_not_waited_for(tmp_path):
    with a_lying_pair(tmp_path) as (pair, forger):
        forger.lie = lambda body: re.sub(r"(STAT \w+,\d+,\d+),\d+", r"\1,9000000000000000", body)
        with pytest.raises(LinkError, match=r"STAT\? is not believed: READY is \d+ microseconds after CLOCK"):
            pair.gun.status()
        pair.gun.arm()
        with pytest.raises(LinkError, match="READY is"):
            pair.gun.fire(a_shot())
        assert pair.twin.body.ledger == []


def test_a_misread_clock_does_not_put_off_the_next_shot(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        once(pair)
        forger.lie = lambda body: f"TIME {max(0, int(body.split()[1]) - 500_000)}" if body.startswith("TIME ") else body
        pair.gun.link.ask("TIME?")
        before_s = pair.clock()
        assert pair.gun.status().ready_at_s <= pair.clock() + 0.211005
        assert pair.gun.history.ready_s < before_s + 1


def test_a_run_with_a_lying_gun_goes_on_and_each_row_has_one_valid_shot(tmp_path, quick_configs):
    with a_lying_twin(tmp_path, speed=SPEED, drift_ppm=60.0) as (twin, forger):
        forger.lie = liar = ShotLiar(0.3, FAR_US)
        gun = f"serial:{forger.address}?speed={SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, 3))
        figures = check(tally, twin, slack_s=1e-4)
    assert figures["trials"] == figures["done"] == 120
    assert liar.accepted(fired.timing for _, fired in tally.done) == 0
    assert set(liar.told) == set(FORGERIES)
    for _, cause in FORGERIES.values():
        assert any(re.search(cause, found) for found in tally.causes)
    counts = [
        one["gun_count"] for one in timings_of(read_journal(place(tmp_path / "results", "P0001", "direction").journal))
    ]
    assert counts == sorted(set(counts))
    assert len(counts) == 60 < counts[-1]  # the gaps are the shots that were not believed


def test_a_run_whose_answers_are_all_lost_once_is_recovered(tmp_path, quick_configs):
    lost = []

    def lose(body):
        if body.startswith("SHOT ") and body.split(",")[1] not in lost:
            lost.append(body.split(",")[1])
            return None
        return body

    with a_lying_twin(tmp_path, speed=SPEED) as (twin, forger):
        forger.lie = lose
        gun = f"serial:{forger.address}?speed={SPEED:g}"
        tally = run_all(hasty(quick_configs), tmp_path / "results", gun, range(1, 2))
        figures = check(tally, twin, slack_s=1e-4)
    assert figures["trials"] == figures["done"] == 60
    assert figures["marked"] == figures["rendered and marked"] == 0
    assert len(lost) >= 60


def test_a_line_too_slow_for_a_shots_time_fires_nothing(tmp_path):
    with a_pair(tmp_path, Troubles(latency_s=0.08), speed=1.0) as pair:
        pair.gun.arm()
        with pytest.raises(
            LinkError, match=r"not fired: the gun's clock is known to 0\.\d+ s only.*0\.05 s or less"
        ) as told:
            pair.gun.fire(a_shot())
        assert not told.value.may_have_fired
        assert pair.twin.body.ledger == []


def test_after_a_reset_the_gun_is_counted_from_its_new_base(tmp_path):
    with a_pair(tmp_path, Troubles(replug_s=0.05)) as pair:
        assert [once(pair).timing.gun_count for _ in range(2)] == [1, 2]
        pair.twin.order(pair.twin.reset)
        wait_for(lambda: pair.gun.link.boot == 2)
        assert once(pair).timing.gun_count == 1


# the rules by themselves


WANTED = asked(a_shot(), paper_methods())
ORDER = ShotOrder(
    mark=7,
    wanted=WANTED,
    requested_s=9.9,
    written_s=10.0,
    at_s=None,
    at_us=0,
    count=4,
    boot=1,
    session=1,
    disarms=0,
)
RECORD = ShotRecord(
    count=5,
    mark=7,
    ending="DONE",
    accepted_us=1_000_000,
    start_us=1_000_000,
    end_us=1_010_000,
    home_predicted_us=1_211_005,
    setting=WANTED.setting,
)


def told(accepted_s=10.001, end_s=10.011, uncertainty_s=0.001, received_s=10.012):
    reply = Reply(body="", written_s=10.0, received_s=received_s, session=1)
    times = {"uncertainty_s": uncertainty_s}
    return BelievedShot(
        reply=reply,
        record=RECORD,
        tries=1,
        accepted=HostTime(time_s=accepted_s, **times),
        start=HostTime(time_s=accepted_s, **times),
        end=HostTime(time_s=end_s, **times),
    )


def test_a_true_record_passes_every_rule():
    check_record(RECORD, ORDER)
    check_times(told(), ORDER, 1.0)
    at_a_tick = replace(RECORD, start_us=1_500_000, end_us=1_510_000)
    check_record(at_a_tick, replace(ORDER, at_us=1_500_000))
    check_record(RECORD, replace(ORDER, at_us=900_000))  # its tick was over when it was accepted


@pytest.mark.parametrize("at_us", [0, 900_000, 1_500_001, 1_499_999])
def test_the_start_is_the_later_of_tick_and_acceptance_to_the_microsecond(at_us):
    with pytest.raises(Contradiction, match="START is 1500000"):
        check_record(replace(RECORD, start_us=1_500_000, end_us=1_510_000), replace(ORDER, at_us=at_us))


def test_a_shot_that_was_switched_off_early_is_no_lie():
    with pytest.raises(CutShort, match="fired and cut short: driven for 4000 of 10000 microseconds"):
        check_record(replace(RECORD, ending="CUT", end_us=1_004_000), ORDER)


@pytest.mark.parametrize(
    ("times", "rule"),
    [
        ({"accepted_s": 9.998}, "ACCEPTED is 0.00.* s earlier"),
        ({"end_s": 10.014}, "END is 0.00.* s later"),
        ({"uncertainty_s": 0.0501}, "known to 0.0501 s only; it must be 0.05 s or less"),
        ({"uncertainty_s": math.inf}, "known to inf s only"),
        ({"accepted_s": math.nan, "uncertainty_s": math.nan}, "known to nan s only"),
    ],
)
def test_a_shot_outside_its_trigger_and_its_record_is_refused(times, rule):
    with pytest.raises(Contradiction, match=rule):
        check_times(told(**times), ORDER, 1.0)


@pytest.mark.parametrize("times", [{"accepted_s": 9.9995}, {"end_s": 10.0125}, {"uncertainty_s": MAX_UNCERTAINTY_S}])
def test_what_the_clocks_leave_open_is_allowed(times):
    check_times(told(**times), ORDER, 1.0)


def test_of_a_twin_in_a_hurry_the_clocks_may_differ_as_much_in_the_worlds_time():
    check_times(told(uncertainty_s=1.9), ORDER, 40.0)
    with pytest.raises(Contradiction, match=r"known to 0\.0525 s"):
        check_times(told(uncertainty_s=2.1), ORDER, 40.0)


STANDING = StatusRecord(state="RESETTING", count=1, clock_us=2_000_000, ready_us=2_200_000, coil_mC=25_000, fault=0)


def test_a_magnet_is_home_within_ten_seconds_or_the_gun_is_not_believed():
    check_standing(replace(STANDING, ready_us=12_000_000))
    with pytest.raises(Contradiction, match="READY is 10000001 microseconds after CLOCK"):
        check_standing(replace(STANDING, ready_us=12_000_001))


@pytest.mark.parametrize(("clocks_say_s", "ready_at_s"), [(5.0, 20.2), (20.21, 20.211), (500.0, 20.2202)])
def test_the_next_shot_is_ready_when_the_clocks_say_but_never_beyond_what_the_exchange_makes_certain(
    clocks_say_s, ready_at_s
):
    reply = Reply(body="", written_s=20.0, received_s=20.02, session=1)
    found = ready_s(STANDING, reply, HostTime(time_s=clocks_say_s, uncertainty_s=0.001))
    assert found == pytest.approx(ready_at_s, abs=1e-9)


def test_history_of_a_forged_shot_is_kept_from_its_time(tmp_path):
    with a_lying_pair(tmp_path) as (pair, forger):
        forger.lie = ShotLiar(1.0, FAR_US, kinds=("in 285 years",))
        with pytest.raises(LinkError):
            once(pair)
        history: DriveHistory = pair.gun.history
        (pulse,) = history.pulses
        (true,) = pair.twin.body.ledger
        assert true.start_s <= pulse[0] / 1e6 <= pair.clock()  # never earlier than it was, and not in the future
