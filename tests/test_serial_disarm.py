"""Disarmed is disarmed: whatever other threads had begun, nothing arms or fires after `disarm` has returned."""

import threading
import time
from dataclasses import replace
from random import Random

import pytest

from device import LimitError, LinkError
from device.serial_gun import triggering
from device.serial_gun.lines import CalledOff
from tests.forger import a_lying_pair
from tests.twins import Troubles, a_pair, a_shot, is_up, said
from tests.waiting import wait_for

pytestmark = pytest.mark.slow

ENDS_S = 30.0


class Doing(threading.Thread):
    """Something done in a thread of its own; `outcome` is what it gave back, or the error."""

    def __init__(self, act):
        super().__init__(daemon=True)
        self.outcome = None
        self._act = act
        self.start()

    def run(self):
        try:
            self.outcome = self._act()
        except (LimitError, LinkError) as error:
            self.outcome = error

    def ended(self):
        self.join(ENDS_S)
        assert not self.is_alive()
        return self.outcome


class Watched:
    """A lock that tells how many have it or wait for it; `first` is done before it is given for the first time."""

    def __init__(self, lock, first=lambda: None):
        self.wait_for_it = 0
        self._lock, self._first = lock, [first]

    def __enter__(self):
        self.wait_for_it += 1
        if self._first:
            self._first.pop()()
        self._lock.acquire()

    def __exit__(self, *_):
        self._lock.release()
        self.wait_for_it -= 1


def watched_turn(gun):
    gun.turn = Watched(gun.turn)
    return gun.turn


def state(pair):
    return pair.twin.core.machine.state


def heard_by(forger, lost=lambda _: False):
    """What the gun hears from now on; frames that are `lost` are not among it."""
    bodies = []

    def swallow(body):
        if lost(body):
            return True
        if body != "TIME?":
            bodies.append(body.split()[0])
        return False

    forger.swallow = swallow
    return bodies


def answers_lost(forger, header):
    """The answer to this command is lost, until the list that is given back is emptied."""
    asked, lost = [], [True]

    def swallow(body):
        if body != "TIME?":
            asked.append(body.split()[0])
        return False

    forger.swallow = swallow
    forger.lie = lambda body: None if lost and asked and asked[-1] == header and not body.startswith("TIME") else body
    return asked, lost


def test_an_arming_whose_answer_was_lost_is_not_asked_for_again_after_a_disarming(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        asked, lost = answers_lost(forger, "ARM")
        arming = Doing(pair.gun.arm)
        wait_for(lambda: state(pair) == "ARMED")
        pair.gun.disarm()
        armed_before = asked[: asked.index("ABOR")].count("ARM")
        lost.clear()
        assert isinstance(arming.ended(), CalledOff)
        assert asked.count("ARM") == armed_before > 0
        assert state(pair) == "DISARMED"
        with pytest.raises(LimitError, match="disarmed"):
            pair.gun.fire(a_shot())


def test_an_arming_that_never_arrived_is_not_asked_for_again_after_the_line_was_lost(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        heard = heard_by(forger, lost=lambda body: body == "ARM")
        turn = watched_turn(pair.gun)
        arming = Doing(pair.gun.arm)
        wait_for(lambda: turn.wait_for_it == 1)
        pair.gun.disarm()
        forger.swallow = heard.append
        pair.gun.link.drop("to be greeted again")
        assert isinstance(arming.ended(), CalledOff)
        wait_for(lambda: pair.gun.link.session == 2)
        assert "ARM" not in heard
        assert state(pair) == "DISARMED"


def test_who_waits_for_a_gun_that_is_gone_does_not_arm_it_after_a_disarming(tmp_path):
    with a_pair(tmp_path, Troubles(replug_s=1.5), speed=1.0) as pair:
        pair.twin.order(pair.twin.unplug)
        wait_for(lambda: not is_up(pair.gun))
        turn = watched_turn(pair.gun)
        arming = Doing(pair.gun.arm)
        wait_for(lambda: turn.wait_for_it == 1)
        pair.gun.disarm()
        assert isinstance(arming.ended(), CalledOff)
        wait_for(lambda: is_up(pair.gun))
        assert state(pair) == "DISARMED"


def test_what_waited_for_its_turn_when_the_gun_was_disarmed_is_called_off(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        pair.ready()
        heard, turn = heard_by(forger), watched_turn(pair.gun)
        firing = Doing(lambda: pair.gun.fire(a_shot(), pair.clock() + 1.9))
        wait_for(lambda: state(pair) == "WAITING")
        others = [Doing(pair.gun.arm), Doing(lambda: pair.gun.fire(a_shot()))]
        wait_for(lambda: turn.wait_for_it == 3)
        pair.gun.disarm()
        assert "not fired: the gun was disarmed meanwhile" in str(firing.ended())
        assert isinstance(others[0].ended(), CalledOff)
        assert "disarmed" in str(others[1].ended())
        assert heard[-1] == "ABOR"
        assert heard.count("TRIG") == 1
        assert pair.twin.body.ledger == []


def test_a_disarming_between_the_answer_to_an_arming_and_its_note_counts(tmp_path):
    with a_pair(tmp_path, speed=1.0) as pair:
        arming = pair.gun.arming
        arming.lock = Watched(arming.lock, pair.gun.disarm)
        with pytest.raises(CalledOff, match="disarmed meanwhile"):
            pair.gun.arm()
        with pytest.raises(LimitError, match="the gun is disarmed"):
            pair.gun.fire(a_shot())
        assert said(pair, "ARM", "ABOR", "TRIG") == ["ARM", "ABOR"]


def test_a_shot_that_was_asked_for_before_a_disarming_is_not_fired_on_a_later_arming(tmp_path):
    with a_pair(tmp_path) as pair:
        pair.ready()

        def as_another_thread_would():
            pair.gun.disarm()
            pair.gun.arming.arm(pair.gun.arming.disarms)

        pair.gun.turn = Watched(pair.gun.turn, as_another_thread_would)
        with pytest.raises(LimitError, match="the gun is disarmed"):
            pair.gun.fire(a_shot())
        assert said(pair, "TRIG") == []
        assert pair.gun.fire(a_shot()).timing.gun_count == 1  # asked for after it


def test_a_trigger_that_was_lost_is_not_written_again_after_a_disarming(tmp_path):
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        pair.ready()
        triggers = []

        def lost(body):
            triggers.extend([body] if body.startswith("TRIG ") else [])
            return len(triggers) == 1 and body.startswith("TRIG ")

        heard = heard_by(forger, lost)
        firing = Doing(lambda: pair.gun.fire(a_shot()))
        wait_for(lambda: triggers)
        pair.gun.disarm()
        assert "not fired: the gun was disarmed meanwhile" in str(firing.ended())
        assert len(triggers) == 1
        assert "TRIG" not in heard
        assert pair.twin.body.ledger == []


@pytest.mark.parametrize("ahead_s", [None, 1.0])
def test_the_status_is_read_back_after_a_disarming_while_a_shot_waits_for_its_lost_answer(
    tmp_path, monkeypatch, ahead_s
):
    monkeypatch.setattr(triggering, "PATIENCE_S", 300.0)  # only the status must not wait for it
    with a_lying_pair(tmp_path, speed=1.0) as (pair, forger):
        pair.ready()
        forger.lie = lambda body: None if body.startswith(("SHOT ", "ERR ")) else body
        firing = Doing(lambda: pair.gun.fire(a_shot(), ahead_s and pair.clock() + ahead_s))
        wait_for(lambda: state(pair) == "WAITING" or pair.twin.body.ledger)
        pair.gun.disarm()
        assert pair.gun.status().state == "disarmed"
        assert firing.is_alive()
        shots = len(pair.twin.body.ledger)
        forger.lie = lambda body: body
        pair.gun.link.drop("so that it need not wait any longer")
        assert isinstance(firing.ended(), LinkError) or shots == 1
        assert len(pair.twin.body.ledger) == shots


def test_a_gun_that_did_not_say_that_it_is_armed_is_disarmed(tmp_path):
    with a_lying_pair(tmp_path) as (pair, forger):
        asked, lost = answers_lost(forger, "ARM")
        with pytest.raises(LinkError, match="no answer to ARM"):
            pair.gun.arm()
        assert asked[-1] == "ABOR"
        assert lost
        assert state(pair) == "DISARMED"


@pytest.mark.parametrize("seed", range(6))
def test_no_shot_begins_after_a_disarming_that_threads_which_arm_and_fire_have_seen(tmp_path, seed):
    """Three hands on one gun, on a bad line, each of which looks at a latch after it armed, as a run does."""
    draw, halted = Random(seed), threading.Event()
    noise = Troubles(jitter_s=0.002, lose=0.01, double=0.01, corrupt=0.01, partial=0.01)
    with a_pair(tmp_path, replace(noise, unplug_idle=0.01, replug_s=0.05), speed=20.0, seed=seed) as pair:

        def hand():
            while not halted.is_set():
                try:
                    pair.gun.arm()
                    if halted.is_set():
                        pair.gun.disarm()
                        return
                    pair.gun.fire(a_shot())
                except (LimitError, LinkError):
                    continue

        hands = [Doing(hand) for _ in range(3)]
        time.sleep(0.3 + draw.random())
        halted.set()
        pair.gun.disarm()
        disarmed_s = pair.clock()
        assert all(one.ended() is None for one in hands)
        time.sleep(0.2)  # for a shot that should not come; if the machine is slow it is only missed
        late = [shot for shot in pair.twin.body.ledger if shot.start_s > disarmed_s]
        assert late == []
        assert len(pair.twin.body.ledger) > 0
        wait_for(lambda: state(pair) == "DISARMED")
