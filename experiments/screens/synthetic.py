"""The screen of a synthetic participant: answers are the participant's, waiting is the clock's that it is given."""

from __future__ import annotations

from device import GunStatus
from experiments.clock import Clock
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.plan import Condition, Plan
from experiments.live_run import LiveRun
from experiments.session import events
from experiments.session.events import Event
from experiments.session.history import chosen_levels
from experiments.session.judging import REARM_HELD_S
from experiments.session.remarks import Remark
from experiments.session.states import EMERGENCY, Position, State
from experiments.session.steps import Ask, Describe, Outcome, Present, Rate, Rest, Step
from experiments.synthetic.answers import SyntheticParticipant, synthetic_participant_of


def synthetic_screen(setup: Setup[DesignConfig], plan: Plan, clock: Clock) -> SyntheticScreen:
    """The screen of the synthetic participant that a setup asks for. Raises as `synthetic_participant_of` does."""
    return SyntheticScreen(setup.config, synthetic_participant_of(setup, plan), clock)


class SyntheticScreen:
    """Works a run as a person would, in as much time as the config plans for it, in the run's own thread."""

    def __init__(self, config: DesignConfig, participant: SyntheticParticipant, clock: Clock) -> None:
        self._config = config
        self._participant, self._clock = participant, clock
        self._live: LiveRun | None = None
        self._begun: tuple[int, float] = (0, 0.0)

    def begin(self, live: LiveRun) -> None:
        """Take the place."""
        self._live = live

    def show(self, position: Position) -> None:
        """Nothing to see."""

    def act(self, position: Position, until_s: float | None) -> None:
        """Do what the position asks for, in its time."""
        event = self._event(position, until_s)
        if event is not None and self._live is not None:
            self._live.offer(event)

    def _event(self, position: Position, until_s: float | None) -> Event | None:  # noqa: C901, PLR0911 - one case a state
        step = position.step
        match position.state:
            case State.REARMING:
                self._clock.sleep(REARM_HELD_S)
                return events.Rearm(held_s=REARM_HELD_S)
            case State.SETTING:
                return events.DamperSet()
            case State.PREPARING:
                self._clock.sleep(self._config.hand_over_s)
                return events.Fire()
            case State.TRAIN if isinstance(step, Present):
                return self._next(position, step, until_s)
            case State.ASKING if isinstance(step, Ask):
                return self._answer(position, step)
            case State.RATING if isinstance(step, Rate):
                self._clock.sleep(self._config.question_s)
                return events.Rating(rating=self._rating(step), by="synthetic")
            case State.DESCRIBING if isinstance(step, Describe):
                self._clock.sleep(self._config.question_s)
                return events.Description(text=self._participant.describe(step.trial, step.question), by="synthetic")
            case State.INFORMING:
                return events.Told()
            case State.RESTING if isinstance(step, Rest):
                self._clock.sleep(step.duration_s)
                return None
            case State.CLOSING:
                return events.Finish()
            case State.HALTED:
                return events.Stop(reason=EMERGENCY)
            case _:
                return None

    def _answer(self, position: Position, step: Ask) -> Event:
        """Answer after the participant's own response time."""
        answer = self._participant.answer(step.trial, step.question, self._chosen(step))
        onset_s = position.onset_s if position.onset_s is not None else self._clock.now()
        self._clock.sleep(onset_s + answer.response_time_s - self._clock.now())
        return events.Answer(response=answer.response, by="synthetic", response_time_s=answer.response_time_s)

    def _rating(self, step: Rate) -> float | None:
        return self._participant.rate(step.trial, step.question, self._chosen(step))

    def _chosen(self, step: Ask | Rate) -> Condition:
        """The levels that a procedure chose for what was felt."""
        return () if self._live is None else chosen_levels(self._live.history, step.trial)

    def _next(self, position: Position, step: Present, until_s: float | None) -> Event | None:
        """Say next once the participant has felt enough since the first onset; drawn when the stimulus begins."""
        if position.onset_s is None or until_s is None:
            return None
        if self._begun[0] != position.number:
            felt_s = max(self._participant.exposure_s(step.trial), step.least_exposure_s)
            self._begun = (position.number, position.onset_s + felt_s)
        next_at_s = self._begun[1]
        self._clock.sleep(min(next_at_s, until_s) - self._clock.now())
        return events.Next() if next_at_s <= until_s else None

    def acknowledge(self, step: Step | None, word: Outcome | Remark) -> None:
        """Nobody waits for it."""

    def trouble(self, text: str) -> None:
        """Nobody reads it."""

    def gun_seen(self, status: GunStatus | None, fault: str) -> None:
        """Nobody looks."""
