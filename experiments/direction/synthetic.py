"""Synthetic participants of experiment 1: from the published rates, from a table, or from what the gun does (`felt`).

The observers of rates and tables do not heed instructions; whoever feels the gun is hurried or made careful by them.
In probit units, with z the probit of the mean correct rate of a method and direction, a person answers "forward" with
probability Phi(S z_forward + ability + bias) to a forward shot and Phi(-S z_backward - ability + bias) to a backward
one; S = sqrt(1 + ability_sd^2 + bias_sd^2) keeps the mean over people at the given rates.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

from device.words import DIRECTIONS, Direction
from experiments.config.setup import Setup
from experiments.design.plan import Plan, Trial
from experiments.design.streams import Stream
from experiments.direction.config import DirectionConfig, Rates, ResponseTime
from experiments.direction.session import QUESTION
from experiments.synthetic.model_based import NEUTRAL, ModelBasedParticipant, ModelParameters
from experiments.synthetic.percept import Percept, percepts_of

_NORMAL = NormalDist()

TABLE_COLUMNS = ("participant_id", "method", "forward_correct", "backward_correct")
"""The table of answers: how many trials of each direction a participant gets right."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SyntheticAnswer:
    """A synthetic participant's answer to one shot."""

    response: Direction
    response_time_s: float


def synthetic_participant(
    setup: Setup[DirectionConfig], plan: Plan
) -> RatesParticipant | TableParticipant | ModelParticipant:
    """The synthetic participant that a setup asks for. `ValueError`: a table or numbers that make none."""
    kind = setup.config.synthetic.observer
    if kind == "table":
        return TableParticipant(setup.config, plan, setup.answers)
    if kind == "felt":
        model = model_parameters(setup.config)
        methods = setup.gun.renderings(setup.config.design.methods)
        return ModelParticipant(model, percepts_of(methods, model.percept.leak_s), plan)
    return RatesParticipant(setup.config, plan)


def model_parameters(config: DirectionConfig) -> ModelParameters:
    """What a config's participants who feel the gun are made of."""
    synthetic = config.synthetic
    return ModelParameters(
        percept=synthetic.percept.own,
        boundaries=synthetic.diffusion.boundaries,
        non_decision_s=synthetic.diffusion.non_decision_s,
        lapses=synthetic.diffusion.lapses.own,
        people=synthetic.people.own,
    )


def probit_of_forward(rates: Rates, method: str, direction: Direction) -> float:
    """The probit of answering "forward", for a person without own ability and bias; mean bias included."""
    spread = math.sqrt(1 + rates.ability_sd**2 + rates.bias_sd**2)
    rate = rates.forward[method] if direction == "forward" else 1 - rates.backward[method]
    return spread * _NORMAL.inv_cdf(rate) + rates.bias_mean


class RatesParticipant:
    """A person drawn once, by the seed, who then answers each trial from what they are like.

    Each trial has a stream of its own, so an answer does not depend on what was answered before.
    """

    def __init__(self, config: DirectionConfig, plan: Plan) -> None:
        self._seed, self._who = plan.seed, (plan.experiment, plan.participant_id)
        self._rates, self._times = config.synthetic.rates, config.synthetic.response_time
        person = Stream(plan.seed, "person", *self._who)
        self._ability = self._rates.ability_sd * person.normal()
        self._bias = self._rates.bias_sd * person.normal()

    def answer(self, trial: Trial, question: str = QUESTION) -> SyntheticAnswer:  # noqa: ARG002 - there is one
        """The answer to a shot of this trial's method and direction."""
        draws = _trial_stream(self._seed, self._who, trial)
        towards = self._ability if trial.direction == "forward" else -self._ability
        probit = probit_of_forward(self._rates, trial.method, trial.direction) + towards + self._bias
        forward = draws.uniform() < _NORMAL.cdf(probit)
        return SyntheticAnswer(
            response="forward" if forward else "backward", response_time_s=_response_time(self._times, draws)
        )


class TableParticipant:
    """A person who gets exactly as many trials right as the table says, at random ones.

    `ValueError` if the table has no row for the participant and method, or a count beyond the planned trials.
    """

    def __init__(self, config: DirectionConfig, plan: Plan, answers: Sequence[Mapping[str, str]]) -> None:
        self._seed, self._who = plan.seed, (plan.experiment, plan.participant_id)
        self._times = config.synthetic.response_time
        self._correct: dict[Trial, bool] = {}
        for method in plan.methods:
            for direction in DIRECTIONS:
                trials = [trial for trial in plan.trials if (trial.method, trial.direction) == (method, direction)]
                marks = _marks(len(trials), answers, plan.participant_id, method, direction)
                shuffled = Stream(self._seed, "correct", *self._who, method, direction).shuffled(marks)
                self._correct |= dict(zip(trials, shuffled, strict=True))

    def answer(self, trial: Trial, question: str = QUESTION) -> SyntheticAnswer:  # noqa: ARG002 - there is one
        """The answer that the table leaves for this trial."""
        other: Direction = "backward" if trial.direction == "forward" else "forward"
        draws = _trial_stream(self._seed, self._who, trial)
        return SyntheticAnswer(
            response=trial.direction if self._correct[trial] else other,
            response_time_s=_response_time(self._times, draws),
        )


class ModelParticipant:
    """A person who feels each shot by the full model and decides by a diffusion, as hurried as the trial's instruction.

    Raises as `ModelBasedParticipant` does.
    """

    def __init__(self, model: ModelParameters, percepts: Mapping[str, Percept], plan: Plan) -> None:
        self._participant = ModelBasedParticipant(model, percepts, plan)

    def answer(self, trial: Trial, question: str = QUESTION) -> SyntheticAnswer:  # noqa: ARG002 - there is one
        """The answer to a shot of this trial's method and direction."""
        decision = self._participant.decide(trial, trial.instruction or NEUTRAL)
        response: Direction = "forward" if decision.upper else "backward"
        return SyntheticAnswer(response=response, response_time_s=_as_boxed(decision.time_s))


def _trial_stream(seed: int, who: tuple[str, str], trial: Trial) -> Stream:
    return Stream(seed, "answer", *who, str(trial.session), str(trial.trial))


def _marks(
    planned: int, answers: Sequence[Mapping[str, str]], participant: str, method: str, direction: Direction
) -> list[bool]:
    correct = _cell(answers, participant, method, direction)
    if correct > planned:
        raise ValueError(
            f"participant {participant}, {method}, {direction}_correct is {correct}; "
            f"the plan has {planned} such trials, so it must be 0 to {planned}"
        )
    return [True] * correct + [False] * (planned - correct)


def _cell(answers: Sequence[Mapping[str, str]], participant: str, method: str, direction: Direction) -> int:
    rows = [row for row in answers if (row["participant_id"], row["method"]) == (participant, method)]
    if len(rows) != 1:
        raise ValueError(f"{len(rows)} rows for participant {participant}, method {method}; there must be one")
    cell = rows[0][f"{direction}_correct"]
    if not re.fullmatch(r"[0-9]{1,6}", cell):
        raise ValueError(f"participant {participant}, {method}, {direction}_correct is {cell!r}; not a whole number")
    return int(cell)


def _response_time(law: ResponseTime, draws: Stream) -> float:
    """A shifted log-normal time."""
    return _as_boxed(law.shift_s + law.median_s * math.exp(law.sigma * draws.normal()))


def _as_boxed(time_s: float) -> float:
    """A time in whole milliseconds as a response box gives it, at least one."""
    return max(round(time_s, 3), 0.001)
